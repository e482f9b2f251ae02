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

/// What a simulated drive does otherwise than the script of what its manual leaves open (`scripts/*_beyond.txt`). [`crate::verify`]
/// finds it, too.
#[must_use]
pub fn left_open(drive: &Drive) -> Vec<String> {
    match drive.name {
        "siko/ag03-1" => siko_ag03_1::left_open(),
        "siko/ag02" => siko_ag02::left_open(),
        "kollmorgen/akd" => kollmorgen_akd::left_open(),
        _ => Vec::new(),
    }
}
