//! Each mutant of the simulated drive is found: by the simulator's own tests, which are quicker, or by the verification
//! against the manual.

#![allow(clippy::duplicate_mod, reason = "the AG02's tests are a program of their own, with its rig")]

use std::path::Path;

use lexican_verify::{DRIVES, Inputs, finds, left_open};
use runner::Mutants;
use siko::mutant::{MUTANTS, PACKAGE, VARIABLE};

#[path = "../../drives/siko-ag02/tests/simulator.rs"]
mod ag02;
#[path = "../../drives/siko/tests/all/controller.rs"]
mod controller;
#[path = "../../drives/siko/tests/all/node.rs"]
mod node;
#[path = "../../drives/siko/tests/all/parts.rs"]
mod parts;
#[path = "../../drives/siko/tests/all/power.rs"]
mod power;

// Support code of these tests.
#[path = "../../drives/siko/tests/all/support.rs"]
mod support;

mod runner;
mod unfound;

/// The names of tests in this file that a mutant is tried by, one after the other until one fails.
const TRIALS: [&[&str]; 3] = [
    &["ag02::", "controller::", "node::", "parts::", "power::", "it_does_what_the_manuals_leave_open"],
    &["the_ag03_1_agrees_with_its_manual"],
    &["the_ag02_agrees_with_its_manual"],
];

#[test]
fn every_mutant_of_the_simulated_drive_is_found() {
    let mutants = Mutants {
        package: PACKAGE,
        variable: VARIABLE,
        names: MUTANTS,
        are_tried: |name| !name.starts_with("gateway"),
        unfound: unfound::UNFOUND,
        trials: &TRIALS,
        samples: 25,
    };
    println!("{}", mutants.find());
}

/// The drive, or the mutant that the environment names.
fn agrees_with_its_manual(name: &str) {
    let drive = DRIVES.iter().find(|drive| drive.name == name).unwrap();
    let inputs = Inputs::read(drive, &Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")).unwrap();
    assert!(!finds(drive, &inputs));
}

#[test]
fn it_does_what_the_manuals_leave_open() {
    let drives = DRIVES.iter().filter(|drive| drive.name.starts_with("siko/"));
    assert_eq!(drives.flat_map(left_open).collect::<Vec<_>>(), [""; 0]);
}

#[test]
fn the_ag03_1_agrees_with_its_manual() {
    agrees_with_its_manual("siko/ag03-1");
}

#[test]
fn the_ag02_agrees_with_its_manual() {
    agrees_with_its_manual("siko/ag02");
}
