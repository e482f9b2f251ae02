//! What a data sheet cannot say about a drive: where the descriptions by hand differ from those that are read from the
//! data sheets.

use std::collections::{BTreeMap, BTreeSet};

use lexican_driver::Description;
use lexican_eds::library;

/// The fields of a description as they print themselves, so that new fields are included.
fn fields(description: &Description) -> BTreeMap<String, String> {
    let text = format!("{description:#?}");
    let mut fields = BTreeMap::<String, String>::new();
    let mut last = None;
    for line in text.lines() {
        let field = line.strip_prefix("    ").filter(|rest| !rest.starts_with([' ', '}', ']', ')']));
        if let Some((name, _)) = field.and_then(|field| field.split_once(':')) {
            last = Some(name.to_owned());
        }
        if let Some(name) = &last {
            *fields.entry(name.clone()).or_default() += line.trim();
        }
    }
    fields
}

/// A description by hand differs from the data sheet's only in these fields, and says why.
#[track_caller]
fn check(device: &str, by_hand: &Description, differ: &[(&str, &str)]) {
    let sheet = library::find(device).unwrap().input();
    let read = fields(Description::of_data_sheet(&sheet).unwrap());
    let by_hand = fields(by_hand);
    assert!(by_hand.len() > 30, "{by_hand:?}");
    let found = by_hand.iter().filter(|(name, text)| read.get(*name) != Some(text));
    let found: BTreeSet<&str> = found.map(|(name, _)| name.as_str()).collect();
    assert_eq!(found, differ.iter().map(|(name, _)| *name).collect());
}

/// The fields that both of SIKO's drives have by hand.
const SIKO: [(&str, &str); 20] = [
    ("approaches", "loop positioning is the maker's own"),
    ("calibration", "607Ch becomes the position as soon as it is written"),
    ("codes", "which codes are faults, and their letters"),
    ("conditions", "the bits of 1002h"),
    ("control", "Stop is set while nothing is to move"),
    ("identity", "order of characters, beginning of 1008h"),
    ("inching", "inching is the maker's own"),
    ("inputs", "which PDOs the drive sends by itself"),
    ("modes", "2 is profile velocity"),
    ("name", "with its maker"),
    ("objects", "1002h, and limits that are not asked of the data sheet"),
    ("outputs", "the PDO of the velocity, whose mode has another number"),
    ("parameters", "the table of the manual"),
    ("release", "the bit of a new set-point stays"),
    ("restore", "sets of parameters"),
    ("set_points", "no queue, though the bits are not the sheet's matter"),
    ("status", "the maker's own bits"),
    ("times", "settles sooner"),
    ("transitions", "the maker's own ways"),
    ("velocity", "2 is profile velocity"),
];

#[test]
fn the_ag03_1_has_what_only_its_manual_says() {
    let own = [
        ("battery", "of the maker"),
        ("temperature", "of the maker"),
        ("torque_deactivation", "of the maker"),
        ("units", "spindle and gear"),
    ];
    check("siko/ag03-1", &siko_ag03_1::driver::AG03_1, &[&SIKO[..], &own].concat());
}

#[test]
fn the_ag02_has_what_only_its_manual_says() {
    let own = [("emergencies", "bit 30 of 1014h"), ("units", "spindle and gear")];
    check("siko/ag02", &siko_ag02::driver::AG02, &[&SIKO[..], &own].concat());
}

#[test]
fn the_akd_has_what_only_its_manual_says() {
    let differ = [
        ("codes", "which codes are faults, and their labels"),
        ("conditions", "the bits of 1002h"),
        ("identity", "beginning of 1008h"),
        ("latches", "20A0h and following are the maker's own"),
        ("modes", "6502h has neither torque nor cyclic position"),
        ("name", "with its maker"),
        ("objects", "1002h, and the window in 35C6h"),
        ("profile", "what --velocity sets; its units are set in the drive"),
        ("referenced", "bit 23 of 1002h"),
        ("set_points", "bit 5 blends"),
        ("status", "from when on it stands, and the unit of velocities"),
        ("torque", "6502h does not have the mode"),
        ("velocity", "bit 9 of 1002h says that it is reached"),
    ];
    check("kollmorgen/akd", &kollmorgen_akd::driver::AKD, &differ);
}
