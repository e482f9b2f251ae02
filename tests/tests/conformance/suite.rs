//! What a whole test leaves in a device, and what it does not touch.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use lexican_conform::{Case, CaseReport, Hazard, Observer, Report, Settings, Sheet, Verdict, cases, run as test};
use lexican_eds::model::Entry;
use lexican_runtime::host::blocking::Network;
use lexican_runtime::host::{Node, VirtualBus};
use lexican_runtime::object::Address;
use lexican_runtime::{Duration, Frame, Instant, NodeId};

use crate::device::{DeviceUnderTest, NODE};
use crate::faulty::{Fault, Faulty, fault, heard};
use crate::{DATA_SHEET, settings, sheet};

/// A device that keeps its values over a reset.
const KEEPS: Fault = fault("a reset is answered only", &[heard("000#8.05").is_answered("705#00")], "");

/// A device that hears nothing for two seconds, once, after 1015h has been written.
struct Dozes {
    inner: DeviceUnderTest,
    until: Option<Instant>,
}

impl Node for Dozes {
    fn handle_frame(&mut self, now: Instant, frame: &Frame) {
        if self.until.is_none() && frame.to_string().starts_with("605#2B151000") {
            self.until = Some(now + Duration::from_secs(2));
        }
        if self.until.is_none_or(|until| until <= now) {
            self.inner.handle_frame(now, frame);
        }
    }
    fn handle_timeout(&mut self, now: Instant) {
        self.inner.handle_timeout(now);
    }
    fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        self.inner.poll_transmit(now)
    }
    fn poll_timeout(&self) -> Option<Instant> {
        self.inner.poll_timeout()
    }
}

struct Bench {
    bus: VirtualBus,
    frames: Arc<Mutex<Vec<String>>>,
    sheet: Sheet,
}

impl Bench {
    fn of(fault: Option<&'static Fault>) -> Self {
        Self::with(Faulty::new(DeviceUnderTest::new(), fault))
    }

    fn with(node: impl Node + Send + 'static) -> Self {
        let (bus, frames) = (VirtualBus::new(), Arc::new(Mutex::new(Vec::new())));
        bus.attach(node);
        let log = Arc::clone(&frames);
        bus.observe(move |_, frame| log.lock().unwrap().push(frame.to_string()));
        Bench { bus, frames, sheet: sheet(DATA_SHEET) }
    }

    fn values(&self) -> BTreeMap<Address, Vec<u8>> {
        let mut network = Network::new(self.bus.link());
        // But for the error history, which has what happened.
        let kept = |entry: &&Entry| entry.access.writable() && entry.access.readable() && entry.index != 0x1003;
        let entries = self.sheet.device.entries().filter(kept);
        let addresses: Vec<_> = entries.map(|entry| Address::new(entry.index, entry.sub)).collect();
        addresses.into_iter().filter_map(|at| Some((at, network.read_bytes(NODE, at).ok()?))).collect()
    }

    fn test(&self, settings: &Settings, names: &[&str], observer: &mut dyn Observer, stop: &AtomicBool) -> Report {
        let meant = |case: &&Case| names.is_empty() || names.iter().any(|name| case.is_meant_by(name));
        let cases: Vec<_> = cases().filter(meant).collect();
        test(&mut self.bus.link(), &self.sheet, settings, &cases, stop, observer)
    }
}

#[test]
fn what_is_not_allowed_is_not_written() {
    let bench = Bench::of(None);
    let allow = [].into();
    let settings = Settings { allow, ..settings() };
    let report = bench.test(&settings, &[], &mut (), &AtomicBool::new(false));
    let tally = report.tally();
    assert_eq!((report.cases.len(), tally.failed, tally.unfinished), (cases().count(), 0, 0));
    assert!(tally.not_allowed >= 10, "{tally:?}");
    // Whatever begins to write: at once, in segments, or as a block.
    let begins = ["23", "27", "2B", "2F", "20", "21", "22", "C2", "C6", "C0", "C4"];
    for frame in bench.frames.lock().unwrap().iter() {
        let Some(request) =
            frame.strip_prefix("605#").filter(|data| begins.iter().any(|begin| data.starts_with(begin)))
        else {
            continue;
        };
        let index = u16::from_str_radix(&format!("{}{}", &request[4..6], &request[2..4]), 16).unwrap();
        assert_eq!(Hazard::of_write(&bench.sheet.device, index), None, "{frame}");
    }
}

#[test]
fn what_was_written_is_put_back_even_if_no_reset_does_so() {
    for fault in [None, Some(&KEEPS)] {
        let bench = Bench::of(fault);
        let before = bench.values();
        let allow = [Hazard::Manufacturer, Hazard::Outputs, Hazard::Motion].into();
        let settings = Settings { allow, ..settings() };
        let report = bench.test(&settings, &["2", "3", "4", "6", "7"], &mut (), &AtomicBool::new(false));
        let notes: Vec<_> = report.cases.iter().flat_map(|case| &case.notes).collect();
        assert_eq!(notes, [""; 0]);
        assert_eq!(bench.values(), before);
    }
}

/// Ends the test as soon as a case has begun that writes.
struct Impatient<'a>(&'a AtomicBool, usize);

impl Observer for Impatient<'_> {
    fn begins(&mut self, number: usize, _: usize, _: &Case) {
        if number == self.1 {
            self.0.store(true, Ordering::Relaxed);
        }
    }
    fn ended(&mut self, _: &CaseReport) {}
}

#[test]
fn a_cancelled_test_ends_and_leaves_what_was_there() {
    let bench = Bench::of(Some(&KEEPS));
    let (before, stop) = (bench.values(), AtomicBool::new(false));
    let report = bench.test(&settings(), &["3.5", "3.6"], &mut Impatient(&stop, 2), &stop);
    assert!(matches!(report.cases[1].outcome, Err(Verdict::Unfinished(_))), "{:?}", report.cases[1].outcome);
    assert!(report.ended_early.is_some_and(|why| why.contains("cancelled")));
    assert_eq!(bench.values(), before);
}

#[test]
fn a_case_in_which_the_device_was_away_is_run_again() {
    let bench = Bench::with(Dozes { inner: DeviceUnderTest::new(), until: None });
    let settings = Settings { boot: Duration::from_secs(3), ..settings() };
    let report = bench.test(&settings, &["2.2"], &mut (), &AtomicBool::new(false));
    let notes = &report.cases[0].notes;
    assert!(notes.iter().any(|note| note.contains("away")), "{:?}: {notes:?}", report.cases[0].outcome);
}

#[test]
fn nothing_is_tested_by_an_unfit_data_sheet_or_without_a_device() {
    let bench = Bench::of(None);
    let (stop, all) = (AtomicBool::new(false), cases().collect::<Vec<_>>());
    let unfit = sheet(&DATA_SHEET.replace("[1000]", "[1F99]"));
    assert!(unfit.is_unfit, "{}", unfit.findings);
    let report = test(&mut bench.bus.link(), &unfit, &settings(), &all, &stop, &mut ());
    assert!(report.cases.is_empty() && report.ended_early.is_some_and(|why| why.contains("device.eds:")));
    assert_eq!(*bench.frames.lock().unwrap(), [""; 0], "not a frame is sent");

    let settings = Settings { node: NodeId::literal(9), ..settings() };
    let report = test(&mut bench.bus.link(), &bench.sheet, &settings, &all, &stop, &mut ());
    assert!(report.cases.is_empty() && report.ended_early.is_some_and(|why| why.contains("node 9 does not answer")));
}
