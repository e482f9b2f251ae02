//! The cases of CiA 402 against the simulated servo of `tests/conformance/servo.eds`. `cli/tests/all/conform.rs` runs
//! them against the drives of the library.
//!
//! Faults show that each case notices what it is about: each is a servo with one mistake.
//!
//! `cargo test -p lexican-tests --test conformance_402 -- --nocapture` prints the table of verdicts.

#![allow(unreachable_pub, reason = "none of the modules of a test is reachable")]

mod faults;
#[path = "../conformance/faulty.rs"]
#[allow(dead_code, reason = "not every fault of a device is one of a drive")]
mod faulty;
mod od;
#[path = "../conformance/page.rs"]
mod page;
mod safety;

use std::collections::BTreeSet;
use std::num::NonZero;
use std::sync::atomic::AtomicBool;
use std::thread;

use faults::{DriveFault, FAULTS, MODEL, SLOW};
use faulty::Faulty;
use lexican_conform::{Case, Hazard, Outcome, Settings, Sheet, Tester, Verdict, profile_cases};
use lexican_eds::{Input, Source};
use lexican_runtime::host::{Node, VirtualBus};
use lexican_runtime::{Duration, NodeId};
use simulator::SimulatedServo;

const NODE: NodeId = NodeId::literal(5);
const DATA_SHEET: &str = include_str!("../../conformance/servo.eds");

fn sheet() -> Sheet {
    Sheet::of(&Input::new(Source::new("servo.eds", DATA_SHEET)))
}

fn settings() -> Settings {
    Settings { allow: [Hazard::Motion].into(), boot: Duration::from_secs(1), ..Settings::new(NODE) }
}

fn run(case: &Case, sheet: &Sheet, node: impl Node + Send + 'static) -> (Outcome, Vec<String>) {
    let bus = VirtualBus::with_bit_rate(500);
    bus.attach(node);
    let (mut link, settings, cancelled) = (bus.link(), settings(), AtomicBool::new(false));
    let mut tester = Tester::new(&mut link, sheet, &settings, &cancelled);
    let outcome = tester.run(case);
    let frames = tester.frames().iter().map(|record| record.frame.to_string()).collect();
    (outcome, frames)
}

fn faulty(fault: &'static DriveFault) -> impl Node {
    Faulty::new(servo(&fault.model), &fault.frames)
}

fn servo(model: &'static simulator::servo::ServoModel) -> SimulatedServo {
    SimulatedServo::new(lexican_runtime::Instant::ZERO, model, NODE)
}

#[test]
fn the_servo_passes_every_case() {
    let (sheet, mut failed) = (sheet(), Vec::new());
    for case in profile_cases() {
        let (outcome, _) = run(case, &sheet, servo(&MODEL));
        let verdict = outcome.as_ref().err().map_or_else(|| "passed".to_owned(), Verdict::to_string);
        println!("{:<16} {:<90} {verdict}", case.id, case.title);
        failed.extend(outcome.is_err().then_some(case.id));
    }
    assert_eq!(failed, [""; 0]);
}

/// The orders are beyond the drive's limits; `--velocity` would adapt them.
#[test]
fn no_drive_fails_for_being_slow() {
    let (sheet, mut slow) = (sheet(), 0);
    for case in profile_cases() {
        match run(case, &sheet, servo(&SLOW)).0 {
            Err(Verdict::Failed(why)) => panic!("{}: {why}", case.id),
            Err(Verdict::NotApplicable(why)) => slow += usize::from(why.contains("the drive is too slow")),
            _ => {}
        }
    }
    assert!(slow > 5, "{slow}");
}

fn name(case: &Case) -> &'static str {
    case.id.trim_start_matches("402/")
}

/// Each fault makes only the cases about it fail, and each case notices a fault.
#[test]
fn every_fault_is_noticed_and_every_case_notices_one() {
    let sheet = sheet();
    let plan: Vec<_> = profile_cases().map(|case| (case, run(case, &sheet, servo(&MODEL)).1)).collect();
    let all: Vec<&str> = profile_cases().map(name).collect();
    let look = |fault: &'static DriveFault| {
        let concerned = plan.iter().filter(|(_, frames)| fault.concerns(frames)).map(|(case, _)| *case);
        let fails = |case: &&Case| matches!(run(case, &sheet, faulty(fault)).0, Err(Verdict::Failed(_)));
        (fault, concerned.filter(fails).map(name).collect::<Vec<&str>>())
    };
    let threads = thread::available_parallelism().map_or(1, NonZero::get);
    let found: Vec<_> = thread::scope(|scope| {
        let some = |faults: &'static [DriveFault]| scope.spawn(move || faults.iter().map(look).collect::<Vec<_>>());
        let running: Vec<_> = FAULTS.chunks(FAULTS.len().div_ceil(threads)).map(some).collect();
        running.into_iter().flat_map(|faults| faults.join().unwrap()).collect()
    });
    let wrong = found.iter().filter(|(fault, failed)| !fault.is_noticed_by(failed, &all));
    let wrong: Vec<_> = wrong.map(|(fault, failed)| format!("{}: {}", fault.frames.title, failed.join(" "))).collect();
    let noticed: BTreeSet<&str> = found.iter().flat_map(|(_, failed)| failed.iter().copied()).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    let blind: Vec<&str> = all.into_iter().filter(|id| !noticed.contains(id)).collect();
    assert_eq!(blind, [""; 0], "these cases notice nothing");
}

/// The result of that test as a page.
#[test]
fn the_golden_page_of_faults_is_current() {
    let rows = profile_cases().map(|case| {
        let notices = |fault: &&DriveFault| match fault.frames.fails.strip_prefix("all but ") {
            Some(passed) => passed.split(' ').all(|id| id != name(case)),
            None => fault.frames.fails.split(' ').any(|id| id == name(case)),
        };
        (case, FAULTS.iter().filter(notices).map(|fault| fault.frames.title).collect())
    });
    page::is_current("FAULTS-402.md", "Faults of drives, and the cases of CiA 402 that notice them", rows);
}
