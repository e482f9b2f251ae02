//! The 127 cases of CiA's conformance test plan, against the device of `tests/conformance/device.eds`: the runtime's
//! own, with the dictionary that is generated from that data sheet.
//!
//! A case judges frames: it reaches the device through a [`Tester`], which sends, hears and waits, and knows the data
//! sheet. What a data sheet lacks makes a case not applicable. That each case notices what it is about is shown by
//! faults: devices that are wrong in one thing.
//!
//! The table of verdicts is shown by `cargo test -p lexican-tests --test conformance -- --nocapture`.

#![allow(unreachable_pub, reason = "none of the modules of a test is reachable")]

mod cases;
mod device;
mod faults;
mod faulty;
mod od;
mod sdo;
mod tester;

use std::collections::BTreeSet;
use std::sync::{Arc, Mutex};

use device::{DeviceUnderTest, NODE, STIMULI};
use faults::FAULTS;
use faulty::{Fault, Faulty};
use lexican_eds::{Input, Source, load};
use lexican_runtime::host::VirtualBus;
use tester::{Case, Outcome, Sheet, Tester, Verdict};

const DATA_SHEET: &str = include_str!("../../conformance/device.eds");

fn sheet(text: &str) -> Sheet {
    let input = Input::new(Source::new("device.eds", text));
    let (device, findings) = load(&input);
    Sheet { device, findings: findings.render(&input) }
}

/// Runs a case on a device of its own, with a fault or without: the outcome, and the frames that it took.
fn run(case: &Case, sheet: &Sheet, fault: Option<&'static Fault>) -> (Outcome, Vec<String>) {
    let bus = VirtualBus::new();
    bus.attach(Faulty::new(DeviceUnderTest::new(), fault));
    let frames = Arc::new(Mutex::new(Vec::new()));
    let log = Arc::clone(&frames);
    bus.observe(move |_, frame| log.lock().unwrap().push(frame.to_string()));
    let outcome = Tester::new(&mut bus.link(), NODE, sheet, &STIMULI).run(case);
    let frames = std::mem::take(&mut *frames.lock().unwrap());
    (outcome, frames)
}

#[test]
fn the_device_passes_every_case() {
    let sheet = sheet(DATA_SHEET);
    let mut failed = Vec::new();
    for case in cases::all() {
        let (outcome, _) = run(case, &sheet, None);
        let verdict = match &outcome {
            Ok(()) => "passed".to_owned(),
            Err(Verdict::NotApplicable(why)) => format!("not applicable: {why}"),
            Err(Verdict::Failed(why)) => format!("FAILED: {why}"),
        };
        println!("{:>6} {:<85} {verdict}", case.id, case.title);
        failed.extend(outcome.is_err().then_some(case.id));
    }
    assert_eq!(failed, [""; 0]);
}

#[test]
fn the_plan_has_127_cases() {
    let ids: BTreeSet<&str> = cases::all().map(|case| case.id).collect();
    assert_eq!((ids.len(), cases::all().count()), (127, 127));
}

/// Each fault makes just those cases fail that are about it, and each case is about one.
#[test]
fn every_fault_is_noticed_and_every_case_notices_one() {
    let right = sheet(DATA_SHEET);
    let cases: Vec<_> = cases::all().map(|case| (case, run(case, &right, None).1)).collect();
    let (mut noticed, mut wrong) = (BTreeSet::new(), Vec::new());
    for fault in FAULTS {
        let sheet = sheet(&fault.data_sheet(DATA_SHEET));
        let concerned = cases.iter().filter(|(_, frames)| fault.concerns(frames)).map(|(case, _)| case);
        let fails = |case: &&&Case| matches!(run(case, &sheet, Some(fault)).0, Err(Verdict::Failed(_)));
        let failed: Vec<&str> = concerned.filter(fails).map(|case| case.id).collect();
        if failed.is_empty() || failed.join(" ") != fault.fails {
            wrong.push(format!("{}: {}", fault.title, failed.join(" ")));
        }
        noticed.extend(failed);
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    let blind: Vec<&str> = cases::all().map(|case| case.id).filter(|id| !noticed.contains(id)).collect();
    assert_eq!(blind, [""; 0], "these cases notice nothing");
}
