//! The drives that are compared with their manuals. `lexican_registry` has the crates of those without mutants.

mod kollmorgen_akd;
mod siko_ag02;
mod siko_ag02_serial;
mod siko_ag03_1;
mod siko_profibus;

use crate::drive::Drive;

/// All of them.
pub const ALL: &[Drive] = &[
    siko_ag03_1::DRIVE,
    siko_ag02::DRIVE,
    kollmorgen_akd::DRIVE,
    siko_ag02_serial::DRIVE,
    siko_profibus::AG02,
    siko_profibus::AG03_1,
];

/// What the simulated drives of SIKO do otherwise than `scripts/siko_beyond.txt` says; [`crate::verify`] finds it, too.
#[must_use]
pub fn left_open() -> Vec<String> {
    [siko_ag03_1::left_open(), siko_ag02::left_open()].concat()
}
