//! The data sheet of the Kollmorgen AKD against the tables of its manual (`tests/manual/akd`), and the frames that the
//! manual prints against the runtime and the generated dictionary. No simulated drive is needed.

#![allow(unreachable_pub, reason = "none of the modules of a test is reachable")]

mod frames;
mod manual;
mod meanings;
mod network;
mod replay;
mod sheet;

mod od {
    lexican_runtime::include_od!("kollmorgen_akd");
}

/// Every cell that can be compared agrees with the data sheet, its overlay or the runtime, or is one of the errata.
#[test]
fn the_data_sheet_is_what_the_manual_prints() {
    let device = sheet::device();
    let mut judge = manual::Judge::default();
    sheet::judge(&device, &mut judge);
    meanings::judge(&device, &mut judge);
    network::judge(&device, &mut judge);
    judge.finish(&["errata", "frames"]);
}
