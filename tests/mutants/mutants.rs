//! Each mutant of the simulated drive is found: by the simulator's own tests, which are the quicker ones, or by the
//! verification against the manual.

#![allow(clippy::duplicate_mod, reason = "each file of tests brings its own bench")]

use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use lexican_verify::{DRIVES, Inputs, finds};
use siko::mutant::{MUTANTS, VARIABLE};

#[path = "../../drives/siko-ag02/tests/simulator.rs"]
mod ag02;
#[path = "../../drives/siko/tests/controller.rs"]
mod controller;
#[path = "../../drives/siko/tests/node.rs"]
mod node;
#[path = "../../drives/siko/tests/objects.rs"]
mod objects;
#[path = "../../drives/siko/tests/orders.rs"]
mod orders;
#[path = "../../drives/siko/tests/other_doors.rs"]
mod other_doors;
#[path = "../../drives/siko/tests/parts.rs"]
mod parts;
#[path = "../../drives/siko/tests/power.rs"]
mod power;
#[path = "../../drives/siko/tests/remains.rs"]
mod remains;
#[path = "../../drives/siko/tests/variants.rs"]
mod variants;

mod unfound;

/// What each mutant is tried by, until one fails: names of tests of this file.
const TRIALS: [&[&str]; 3] = [
    &[
        "ag02::",
        "controller::",
        "node::",
        "objects::",
        "orders::",
        "other_doors::",
        "parts::",
        "power::",
        "remains::",
        "variants::",
    ],
    &["the_ag03_1_agrees_with_its_manual"],
    &["the_ag02_agrees_with_its_manual"],
];

/// So many mutants of each file, unless `LEXICAN_VERIFY_ALL` is set. `LEXICAN_VERIFY_SEED` is a number that chooses others.
const SAMPLES: usize = 25;

#[test]
fn every_mutant_of_the_simulated_drive_is_found() {
    let chosen = sample();
    let (next, outcomes) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    let work = || {
        while let Some(&number) = chosen.get(next.fetch_add(1, Ordering::Relaxed)) {
            let found = TRIALS.iter().position(|tests| !passes(number, tests));
            outcomes.lock().unwrap().push((number, found));
        }
    };
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| (0..threads).for_each(|_| drop(scope.spawn(work))));
    let mut outcomes = outcomes.into_inner().unwrap();
    outcomes.sort_unstable();
    let count = |by| outcomes.iter().filter(|(_, found)| *found == by).count();
    let (tests, verification) = (count(Some(0)), count(Some(1)) + count(Some(2)));
    println!(
        "of {} mutants {} tried: tests find {tests}, the verification {verification}",
        MUTANTS.len(),
        chosen.len()
    );
    let survivors = outcomes.iter().filter(|(_, found)| found.is_none());
    let names: Vec<String> =
        survivors.map(|(number, _)| format!("{VARIABLE}={number}: {}", MUTANTS[*number])).collect();
    assert!(names.is_empty(), "{} not found:\n{}", names.len(), names.join("\n"));
}

/// What is said not to be found is a mutant.
#[test]
fn every_exception_is_about_a_mutant() {
    for (name, _) in unfound::UNFOUND {
        assert!(MUTANTS.contains(name), "no mutant is called {name:?}");
    }
}

/// A drive as it is, or as the mutant that the environment names.
fn agrees_with_its_manual(name: &str) {
    let drive = DRIVES.iter().find(|drive| drive.name == name).unwrap();
    let inputs = Inputs::read(drive, &Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")).unwrap();
    assert!(!finds(drive, &inputs));
}

#[test]
fn the_ag03_1_agrees_with_its_manual() {
    agrees_with_its_manual("siko/ag03-1");
}

#[test]
fn the_ag02_agrees_with_its_manual() {
    agrees_with_its_manual("siko/ag02");
}

/// The mutants to try, in their order.
fn sample() -> Vec<usize> {
    let all = std::env::var_os("LEXICAN_VERIFY_ALL").is_some();
    let seed = std::env::var("LEXICAN_VERIFY_SEED").map_or(0, |seed| seed.parse::<u64>().expect("a number"));
    let mut files: BTreeMap<&str, Vec<(u64, usize)>> = BTreeMap::new();
    for (number, name) in MUTANTS.iter().enumerate().filter(|(_, name)| unfound::why(name).is_none()) {
        let mut hasher = DefaultHasher::new();
        (seed, name).hash(&mut hasher);
        files.entry(name.split(' ').next().unwrap()).or_default().push((hasher.finish(), number));
    }
    let mut chosen = Vec::new();
    for mut of_file in files.into_values() {
        of_file.sort_unstable();
        let count = if all { of_file.len() } else { SAMPLES.min(of_file.len()) };
        chosen.extend(of_file[..count].iter().map(|(_, number)| *number));
    }
    chosen.sort_unstable();
    chosen
}

fn passes(number: usize, tests: &[&str]) -> bool {
    let mut run = Command::new(std::env::current_exe().unwrap());
    run.args(tests).arg("--test-threads=1").env(VARIABLE, number.to_string()).env("RUST_BACKTRACE", "0");
    run.stdout(Stdio::null()).stderr(Stdio::null()).status().unwrap().success()
}
