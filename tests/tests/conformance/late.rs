//! Lateness of the tester's computer makes no device fail.

use std::collections::VecDeque;

use lexican_conform::{Case, HostLateness, Outcome, Settings, Verdict, run as test};
use lexican_runtime::host::{Incoming, Link, LinkError, Node, VirtualLink};
use lexican_runtime::{Duration, Frame, Instant};

use crate::device::DeviceUnderTest;
use crate::faulty::{Fault, Faulty};
use crate::{DATA_SHEET, NONE, SUBJECTS, link_to, lss, name, run, settings, sheet};

/// A link whose reader is sometimes woken late, as on a busy machine.
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

fn run_late(case: &Case, seed: u64, by_ms: u64, fault: &Fault) -> Outcome {
    let (inner, by) = (link_to(Faulty::new(DeviceUnderTest::new(), fault)), Duration::from_millis(by_ms));
    let mut link = Late { inner, waiting: VecDeque::new(), state: seed, by };
    run(case, &sheet(DATA_SHEET), &settings(), &mut link).0
}

#[test]
fn what_the_testers_own_lateness_explains_is_not_decided() {
    let (mut passed, mut undecided, mut wrong) = (0, 0, Vec::new());
    for case in SUBJECTS[0].cases().filter(|case| !lss::tests(case)) {
        for seed in 0..3 {
            match run_late(case, seed, 30, &NONE) {
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

/// Lateness explains no fault that does not depend on time: neither lateness of the tester nor that of a device's
/// computer.
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
        for outcome in [run_late(case, 1, 3, fault), run_sleepy(case, 1, 2, true, fault)] {
            assert!(matches!(outcome, Err(Verdict::Failed(_))), "{title}: {outcome:?}");
        }
    }
}

/// The lateness of a device is no excuse if this computer was not late.
#[test]
fn on_a_quiet_computer_a_late_device_fails() {
    let case = SUBJECTS[0].cases().find(|case| case.plan == "7.102").unwrap();
    let failed = |seed| matches!(run_sleepy(case, seed, 30, false, &NONE), Err(Verdict::Failed(_)));
    assert!((0..20).any(failed));
    let decided = |seed| !matches!(run_sleepy(case, seed, 30, false, &NONE), Err(Verdict::NotDecidable(_)));
    assert!((0..20).all(decided));
}

/// A device whose program is sometimes woken late.
struct Sleepy<N> {
    inner: N,
    waiting: VecDeque<Frame>,
    until: Instant,
    state: u64,
    by: Duration,
    /// What it tells of its lateness to the computer that the tester runs on, too, and how much it tells.
    host: HostLateness,
    says: Duration,
}

impl<N> Sleepy<N> {
    fn sleeps(&mut self, now: Instant) -> bool {
        self.state = self.state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        // Two naps without a pause between them would be one nap of twice the length.
        if now >= self.until + self.by && (self.state >> 33).is_multiple_of(40) {
            self.until = now + self.by;
            self.host.saw(self.says);
        }
        now < self.until
    }
}

impl<N: Node> Node for Sleepy<N> {
    fn handle_frame(&mut self, now: Instant, frame: &Frame) {
        if self.sleeps(now) || !self.waiting.is_empty() {
            self.waiting.push_back(*frame);
        } else {
            self.inner.handle_frame(now, frame);
        }
    }
    fn handle_timeout(&mut self, now: Instant) {
        if !self.sleeps(now) && self.inner.poll_timeout().is_some_and(|due| due <= now) {
            self.inner.handle_timeout(now);
        }
    }
    fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        while now >= self.until {
            let sent = self.inner.poll_transmit(now);
            if sent.is_some() {
                return sent;
            }
            self.inner.handle_frame(now, &self.waiting.pop_front()?);
        }
        None
    }
    fn poll_timeout(&self) -> Option<Instant> {
        let own = Some(self.until).filter(|_| !self.waiting.is_empty());
        let next = own.into_iter().chain(self.inner.poll_timeout()).min();
        next.map(|due| due.max(self.until))
    }
}

/// A device that sleeps for `by_ms`, and tells `host` of `says_ms`.
fn sleepy(fault: &Fault, seed: u64, [by_ms, says_ms]: [u64; 2], host: HostLateness) -> VirtualLink {
    let (inner, waiting, until) = (Faulty::new(DeviceUnderTest::new(), fault), VecDeque::new(), Instant::ZERO);
    let [by, says] = [by_ms, says_ms].map(Duration::from_millis);
    link_to(Sleepy { inner, waiting, until, state: seed, by, host, says })
}

/// `knows` says whether the tester knows how late its computer is.
fn run_sleepy(case: &Case, seed: u64, by_ms: u64, knows: bool, fault: &Fault) -> Outcome {
    let settings: Settings = settings();
    let host = if knows { settings.host.clone() } else { HostLateness::default() };
    run(case, &sheet(DATA_SHEET), &settings, &mut sleepy(fault, seed, [by_ms; 2], host)).0
}

/// A device on the tester's own computer is late when that is.
#[test]
fn what_the_lateness_of_a_devices_computer_explains_is_not_decided() {
    let (mut passed, mut undecided, mut wrong) = (0, 0, Vec::new());
    for case in SUBJECTS[0].cases().filter(|case| !lss::tests(case)) {
        for seed in 0..3 {
            match run_sleepy(case, seed, 15, true, &NONE) {
                Ok(()) => passed += 1,
                Err(Verdict::NotDecidable(_)) => undecided += 1,
                Err(other) => wrong.push(format!("{} ({seed}): {other}", name(case))),
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(undecided > 0 && passed > 5 * undecided, "{passed} passed, {undecided} not decided");
}

/// If the computer was later than it knows, a timing failure counts only when it happens twice.
#[test]
fn on_a_late_computer_a_failure_by_time_is_tried_again() {
    let case = SUBJECTS[0].cases().find(|case| case.plan == "7.102").unwrap();
    let has_passed_then = |seed| {
        let settings = settings();
        let mut link = sleepy(&NONE, seed, [40, 6], settings.host.clone());
        let report = test(&mut link, &sheet(DATA_SHEET), &settings, &[case], &false.into(), &mut ());
        let again = "this computer was late by up to 12.00 ms, and the case was run again";
        report.cases[0].outcome.is_ok() && report.cases[0].notes == [again]
    };
    assert!((0..20).any(has_passed_then));
}
