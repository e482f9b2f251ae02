//! The drives that are compared with their manuals. `lexican_registry` has their crates, without mutants.

mod kollmorgen_akd;
mod siko_ag02;
mod siko_ag02_serial;
mod siko_ag03_1;
mod siko_profibus;

use crate::drive::Drive;

/// All drives.
pub const ALL: &[Drive] = &[
    siko_ag03_1::DRIVE,
    siko_ag02::DRIVE,
    kollmorgen_akd::DRIVE,
    siko_ag02_serial::DRIVE,
    siko_profibus::AG02,
    siko_profibus::AG03_1,
];

/// Where a simulated drive differs from the script for what its manual leaves open (`scripts/*_beyond.txt`).
/// [`crate::verify`] finds this, too.
#[must_use]
pub fn left_open(drive: &Drive) -> Vec<String> {
    match drive.name {
        "siko/ag03-1" => siko_ag03_1::left_open(),
        "siko/ag02" => siko_ag02::left_open(),
        "kollmorgen/akd" => kollmorgen_akd::left_open(),
        _ => Vec::new(),
    }
}
