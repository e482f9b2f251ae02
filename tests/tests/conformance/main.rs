//! The 127 cases of CiA's conformance test plan against the runtime's device, with the dictionary generated from
//! `tests/conformance/device.eds`; and the cases of LSS against the device of `tests/conformance/lss.eds`.
//!
//! Faults show that each case notices what it is about: each is a device with one mistake.
//!
//! `cargo test -p lexican-tests --test conformance -- --nocapture` prints the table of verdicts.

#![allow(unreachable_pub, reason = "none of the modules of a test is reachable")]

mod device;
mod drawn;
mod faulty;
mod late;
mod lss;
mod noise;
mod od;
mod page;
mod right;
mod suite;

use std::collections::BTreeSet;
use std::sync::LazyLock;
use std::sync::atomic::AtomicBool;

use device::DeviceUnderTest;
use faulty::{Fault, Faulty, table};
use lexican_conform::{Case, Hazard, Outcome, Settings, Sheet, Stimuli, Tester, Verdict, cases};
use lexican_eds::{Input, Source};
use lexican_runtime::Duration;
use lexican_runtime::host::{Link, Node, VirtualBus, VirtualLink};

/// A device under test, with its cases and faults.
struct Subject {
    data_sheet: &'static str,
    node: fn() -> Box<dyn Node + Send>,
    stimuli: Stimuli,
    tests: fn(&&Case) -> bool,
    faults: LazyLock<Vec<Fault>>,
}

static SUBJECTS: [Subject; 3] = [
    Subject {
        data_sheet: DATA_SHEET,
        node: || Box::new(DeviceUnderTest::new()),
        stimuli: device::STIMULI,
        tests: |case| !lss::tests(case),
        faults: LazyLock::new(|| table(include_str!("../../conformance/faults/device.txt"))),
    },
    // This works for any device: an RPDO that is too short causes an emergency.
    Subject {
        data_sheet: DATA_SHEET,
        node: || Box::new(DeviceUnderTest::new()),
        stimuli: Stimuli { emergency: None, ..device::STIMULI },
        tests: |case| {
            let names = ["5", "301/7.5.2.4", "301/7.5.2.17", "301/7.5.2.18", "301/7.2.2.1"];
            names.iter().any(|name| case.is_meant_by(name))
        },
        faults: LazyLock::new(|| table(include_str!("../../conformance/faults/without-stimulus.txt"))),
    },
    Subject {
        data_sheet: lss::DATA_SHEET,
        node: || Box::new(lss::DeviceWithLss::new()),
        stimuli: device::STIMULI,
        tests: lss::tests,
        faults: LazyLock::new(|| table(include_str!("../../conformance/faults/lss.txt"))),
    },
];

const DATA_SHEET: &str = include_str!("../../conformance/device.eds");

fn sheet(text: &str) -> Sheet {
    Sheet::of(&Input::new(Source::new("device.eds", text)))
}

/// The number in the plan; the id if the plan does not have the case.
fn name(case: &Case) -> &'static str {
    if case.plan.is_empty() { case.id } else { case.plan }
}

fn settings() -> Settings {
    Settings {
        allow: Hazard::ALL.into(),
        answer: Duration::from_millis(100),
        boot: Duration::from_millis(500),
        bit_rate_kbit: Some(500),
        stimuli: device::STIMULI,
        ..Settings::new(device::NODE)
    }
}

impl Subject {
    fn cases(&self) -> impl Iterator<Item = &'static Case> {
        cases().filter(self.tests)
    }

    /// Runs a case on a new device, with a fault or without.
    fn run(&self, case: &Case, sheet: &Sheet, fault: &Fault) -> (Outcome, Vec<String>) {
        let settings = Settings { stimuli: self.stimuli, ..settings() };
        run(case, sheet, &settings, &mut link_to(Faulty::new((self.node)(), fault)))
    }
}

/// A bus with a device on it.
fn link_to(node: impl Node + Send + 'static) -> VirtualLink {
    let bus = VirtualBus::new();
    bus.attach(node);
    bus.link()
}

/// Runs a case on a device. Returns the outcome and the frames.
fn run(case: &Case, sheet: &Sheet, settings: &Settings, link: &mut dyn Link) -> (Outcome, Vec<String>) {
    let cancelled = AtomicBool::new(false);
    let mut tester = Tester::new(link, sheet, settings, &cancelled);
    let outcome = tester.run(case);
    (outcome, tester.frames().iter().map(|record| record.frame.to_string()).collect())
}

/// A device without a fault.
static NONE: LazyLock<Fault> = LazyLock::new(Fault::default);

#[test]
fn the_devices_pass_every_case() {
    let mut failed = Vec::new();
    for subject in &SUBJECTS {
        let sheet = sheet(subject.data_sheet);
        for case in subject.cases() {
            let (outcome, _) = subject.run(case, &sheet, &NONE);
            let verdict = outcome.as_ref().err().map_or_else(|| "passed".to_owned(), Verdict::to_string);
            println!("{:>6} {:<20} {:<85} {verdict}", case.plan, case.id, case.title);
            failed.extend(outcome.is_err().then_some(name(case)));
        }
    }
    assert_eq!(failed, [""; 0]);
}

#[test]
fn the_plan_has_127_cases_and_no_name_stands_twice() {
    let ids: BTreeSet<&str> = cases().map(|case| case.id).collect();
    assert_eq!(ids.len(), cases().count());
    let plan: BTreeSet<&str> = cases().map(|case| case.plan).filter(|plan| !plan.is_empty()).collect();
    assert_eq!((plan.len(), cases().filter(|case| !case.plan.is_empty()).count()), (127, 127));
}

/// Each fault makes only the cases about it fail, and each case notices a fault.
#[test]
fn every_fault_is_noticed_and_every_case_notices_one() {
    let (mut noticed, mut wrong) = (BTreeSet::new(), Vec::new());
    for subject in &SUBJECTS {
        let right = sheet(subject.data_sheet);
        let plan: Vec<_> = subject.cases().map(|case| (case, subject.run(case, &right, &NONE).1)).collect();
        for fault in &*subject.faults {
            let sheet = sheet(&fault.data_sheet(subject.data_sheet));
            let concerned = plan.iter().filter(|(_, frames)| fault.concerns(frames)).map(|(case, _)| case);
            let fails = |case: &&&Case| matches!(subject.run(case, &sheet, fault).0, Err(Verdict::Failed(_)));
            let failed: Vec<&str> = concerned.filter(fails).map(|case| name(case)).collect();
            if failed.is_empty() || failed.join(" ") != fault.fails {
                wrong.push(format!("{}: {}", fault.title, failed.join(" ")));
            }
            noticed.extend(failed);
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    let blind: Vec<&str> = cases().map(name).filter(|id| !noticed.contains(id)).collect();
    assert_eq!(blind, [""; 0], "these cases notice nothing");
}

/// The result of that test as a page.
#[test]
fn the_golden_page_of_faults_is_current() {
    let rows = cases().map(|case| {
        let notices = |fault: &&Fault| fault.fails.split(' ').any(|id| id == name(case));
        let faults = SUBJECTS.iter().flat_map(|subject| &*subject.faults).filter(notices);
        (case, faults.map(|fault| fault.title).collect())
    });
    page::is_current("FAULTS.md", "Faults of devices, and the cases that notice them", rows);
}
