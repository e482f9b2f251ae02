//! A computer that is late accuses no device.

use std::collections::VecDeque;
use std::sync::atomic::AtomicBool;

use lexican_conform::{Case, Outcome, Tester, Verdict};
use lexican_runtime::host::{Incoming, Link, LinkError, VirtualBus, VirtualLink};
use lexican_runtime::{Duration, Frame, Instant};

use crate::device::DeviceUnderTest;
use crate::faulty::{Fault, Faulty};
use crate::{DATA_SHEET, SUBJECTS, lss, name, settings, sheet};

/// A link whose reader is not woken in time now and then, as on a machine that has other work.
struct Late {
    inner: VirtualLink,
    waiting: VecDeque<Incoming>,
    state: u64,
    by: Duration,
}

impl Link for Late {
    fn now(&self) -> Instant {
        self.inner.now()
    }
    fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        self.inner.send(frame)
    }
    fn receive(&mut self, until: Instant) -> Result<Option<Incoming>, LinkError> {
        self.state = self.state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        if self.waiting.is_empty() && (self.state >> 33).is_multiple_of(100) {
            let end = self.now() + self.by;
            while let Some(incoming) = self.inner.receive(end)? {
                self.waiting.push_back(incoming);
            }
        }
        match self.waiting.pop_front() {
            Some(incoming) => Ok(Some(incoming)),
            None => self.inner.receive(until),
        }
    }
}

fn run(case: &Case, seed: u64, by_ms: u64, fault: Option<&'static Fault>) -> Outcome {
    let bus = VirtualBus::new();
    bus.attach(Faulty::new(DeviceUnderTest::new(), fault));
    let by = Duration::from_millis(by_ms);
    let mut link = Late { inner: bus.link(), waiting: VecDeque::new(), state: seed, by };
    let (settings, cancelled, sheet) = (settings(), AtomicBool::new(false), sheet(DATA_SHEET));
    Tester::new(&mut link, &sheet, &settings, &cancelled).run(case)
}

#[test]
fn what_the_testers_own_lateness_explains_is_not_decided() {
    let (mut passed, mut undecided, mut wrong) = (0, 0, Vec::new());
    for case in SUBJECTS[0].cases().filter(|case| !lss::tests(case)) {
        for seed in 0..3 {
            match run(case, seed, 30, None) {
                Ok(()) => passed += 1,
                Err(Verdict::NotDecidable(why)) => {
                    assert!(why.contains("this computer was late by up to ") && why.contains(" ms decide"), "{why}");
                    undecided += 1;
                }
                Err(other) => wrong.push(format!("{} ({seed}): {other}", name(case))),
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(undecided > 0 && passed > 5 * undecided, "{passed} passed, {undecided} not decided");
}

/// Lateness excuses no fault that it does not explain.
#[test]
fn a_late_tester_notices_what_does_not_depend_on_time() {
    for (title, plan) in [
        ("1000h is written", "2.3"),
        ("a wrong toggle bit is not noticed", "2.17"),
        ("SYNC comes half as often", "6.3"),
        ("the heartbeat comes half as often", "7.102"),
        ("there is no boot-up message", "9.1"),
    ] {
        let fault = SUBJECTS[0].faults.iter().find(|fault| fault.title == title).unwrap();
        let case = SUBJECTS[0].cases().find(|case| case.plan == plan).unwrap();
        let outcome = run(case, 1, 3, Some(fault));
        assert!(matches!(outcome, Err(Verdict::Failed(_))), "{title}: {outcome:?}");
    }
}
