//! The cases of CiA's conformance test plan (CCT 3.0.3.10), cases beyond it, and those of device profiles. The numbers
//! are those of the plan, the words are ours. A case has access to the device only through its
//! [`Tester`](crate::tester::Tester).

mod block;
mod dictionary;
mod drive;
mod error_control;
pub(crate) mod lss;
mod messages;
mod nmt;
mod pdo;
pub(crate) mod pdo_mapping;
mod receiving;
mod robustness;
mod sdo;
mod storing;
mod sync;
mod transmission;

use crate::case::Case;

/// The cases of communication, for every device, in the order of the plan.
pub fn cases() -> impl Iterator<Item = &'static Case> {
    let chapters = [
        sdo::CASES,
        pdo::CASES,
        pdo_mapping::CASES,
        dictionary::CASES,
        messages::CASES,
        error_control::CASES,
        storing::CASES,
        nmt::CASES,
        block::CASES,
        transmission::CASES,
        receiving::CASES,
        robustness::CASES,
        lss::CASES,
    ];
    chapters.into_iter().flatten()
}

/// The cases of device profiles, each for devices of [its profile](Case::profile).
pub fn profile_cases() -> impl Iterator<Item = &'static Case> {
    drive::cases()
}
