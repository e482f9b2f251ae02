//! Drives (CiA 402). The id of each case begins with `402/`, and each needs [`Hazard::Motion`](crate::Hazard::Motion).
//!
//! The second part of an id is a clause of CiA 402-2 (8.1: states, 8.3: modes, 8.4.1: control word, 8.4.2: status word), or the
//! object that the case is about.

mod cyclic;
mod faults;
mod homing;
mod modes;
mod options;
mod position;
mod states;
mod velocity;

use crate::case::Case;

/// All cases of drives.
pub(crate) fn cases() -> impl Iterator<Item = &'static Case> {
    let chapters = [
        states::CASES,
        modes::CASES,
        options::CASES,
        faults::CASES,
        position::CASES,
        velocity::CASES,
        homing::CASES,
        cyclic::CASES,
    ];
    chapters.into_iter().flatten()
}
