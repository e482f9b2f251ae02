//! Each mutant of the AKD's driver and simulator is found: by their own tests, which are quicker, or by the
//! verification against the manual.

use std::path::Path;

use kollmorgen_akd::mutant::{MUTANTS, PACKAGE, VARIABLE};
use lexican_verify::{DRIVES, Drive, Inputs, finds, left_open};
use runner::Mutants;

#[allow(unexpected_cfgs, reason = "the features are those of the drive's crate")]
#[path = "../../drives/kollmorgen-akd/tests/driver.rs"]
mod driver;

mod runner;

/// The names of tests in this file that a mutant is tried by, one after the other until one fails.
const TRIALS: [&[&str]; 3] = [&["driver::"], &["it_does_what_its_manual_leaves_open"], &["it_agrees_with_its_manual"]];

/// Mutants that are not found because they behave the same, and why.
const UNFOUND: &[(&str, &str)] = &[
    ("sim MODEL: 6 => 6 + 1", "the ramp of code 6, 6085h, does not exist: it is the strongest one, as that of code 7"),
    (
        "sim manufacturer_status: ! causes.is_empty () => true",
        "without a cause no code is among them, and looking for one is only slower",
    ),
    ("sim manufacturer_status: homing => true", "a following error is a fault at once, since 6066h does not exist"),
];

#[test]
fn every_mutant_is_found() {
    let mutants = Mutants {
        package: PACKAGE,
        variable: VARIABLE,
        names: MUTANTS,
        are_tried: |_| true,
        unfound: UNFOUND,
        trials: &TRIALS,
        samples: 25,
    };
    println!("{}", mutants.find());
}

/// The drive, or the mutant that the environment names.
fn akd() -> &'static Drive {
    DRIVES.iter().find(|drive| drive.name == "kollmorgen/akd").unwrap()
}

#[test]
fn it_does_what_its_manual_leaves_open() {
    assert_eq!(left_open(akd()), [""; 0]);
}

#[test]
fn it_agrees_with_its_manual() {
    let drive = akd();
    let inputs = Inputs::read(drive, &Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")).unwrap();
    assert!(!finds(drive, &inputs));
}
