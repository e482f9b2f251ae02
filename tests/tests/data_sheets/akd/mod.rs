//! The Kollmorgen AKD: its data sheet against the tables of its manual, and the frames that the manual prints against
//! the runtime and the generated dictionary.

mod driver;
mod frames;
mod meanings;
mod network;
mod replay;
mod sheet;
mod tables;

use crate::manual::Judge;
use tables::MANUAL;

mod od {
    lexican_runtime::include_od!("kollmorgen_akd");
}

/// Every cell that can be compared agrees with the data sheet, its overlay or the runtime, or is one of the errata.
#[test]
fn the_data_sheet_is_what_the_manual_prints() {
    let device = crate::device("kollmorgen/akd");
    let mut judge = Judge::default();
    sheet::judge(&device, &mut judge);
    meanings::judge(&device, &mut judge);
    network::judge(&device, &mut judge);
    judge.finish(&MANUAL, &["errata", "frames"]);
    MANUAL.check_folder();
}
