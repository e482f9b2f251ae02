//! The state in which a whole test leaves a device, and what it does not touch.

use std::collections::{BTreeMap, VecDeque};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use lexican_conform::{
    Case, CaseReport, Ended, Hazard, Known, Level, Observer, Report, Settings, Sheet, Verdict, cases, run as test,
};
use lexican_eds::model::Entry;
use lexican_runtime::host::blocking::Network;
use lexican_runtime::host::{BusState, Incoming, Link, LinkError, Node, VirtualBus, VirtualLink};
use lexican_runtime::object::Address;
use lexican_runtime::wire::nmt::NmtCommand;
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};

use crate::device::{DeviceUnderTest, NODE};
use crate::faulty::{Faulty, fault};
use crate::{DATA_SHEET, lss, settings, sheet};

/// A device that keeps its values over a reset.
const KEEPS: &str = "heard 000#8105 answered 705#00; heard 000#8205 answered 705#00";

/// The same, and once its event timer is set, it never stops sending.
const SENDS_FOR_EVER: &str = "heard 000#8105 answered 705#00; every 1 brings 185#3412 after 605#2B00180564*";

/// The same, and 1015h can be written only once.
const IS_WRITTEN_ONCE: &str =
    "heard 000#8105 answered 705#00; heard 605#2B151000* answered 585#8015100022000008 after 605#2B151000*";

/// A device with another value of 1000h.
const WRONG: &str = "heard 605#40001000* answered 585#4300100000000000";

const RIGHT: &str = "";

/// What happens to a device once, when 1015h is written.
enum Event {
    /// It receives nothing for this many seconds.
    Dozes(u64),
    /// It resets itself.
    Resets,
}

struct Disturbed {
    inner: DeviceUnderTest,
    event: Option<Event>,
    deaf_until: Instant,
}

impl Node for Disturbed {
    fn handle_frame(&mut self, now: Instant, frame: &Frame) {
        let is_written = frame.to_string().starts_with("605#2B151000");
        match self.event.take_if(|_| is_written) {
            Some(Event::Dozes(seconds)) => self.deaf_until = now + Duration::from_secs(seconds),
            Some(Event::Resets) => {
                let reset = Frame::new(CobId::NMT, &[0x81, NODE.get()]).unwrap();
                self.inner.handle_frame(now, &reset);
            }
            None => {}
        }
        if self.deaf_until <= now {
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

/// A link whose adapter is unplugged for a while.
struct Unplugged {
    inner: VirtualLink,
    bus: VirtualBus,
    from: Instant,
    until: Instant,
}

impl Link for Unplugged {
    fn now(&self) -> Instant {
        self.inner.now()
    }
    fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        self.inner.send(frame)
    }
    fn receive(&mut self, until: Instant) -> Result<Option<Incoming>, LinkError> {
        let is_out = (self.from..self.until).contains(&self.now());
        self.bus.set_state(if is_out { BusState::Removed } else { BusState::Active });
        self.inner.receive(until)
    }
}

struct Rig {
    bus: VirtualBus,
    frames: Arc<Mutex<Vec<String>>>,
    sheet: Sheet,
}

impl Rig {
    /// A test of a device that is faulty by these rules.
    fn of(rules: &'static str) -> Self {
        Self::with(Faulty::new(DeviceUnderTest::new(), &fault(rules)))
    }

    fn with(node: impl Node + Send + 'static) -> Self {
        let (bus, frames) = (VirtualBus::new(), Arc::new(Mutex::new(Vec::new())));
        bus.attach(node);
        let log = Arc::clone(&frames);
        bus.observe(move |_, frame| log.lock().unwrap().push(frame.to_string()));
        Rig { bus, frames, sheet: sheet(DATA_SHEET) }
    }

    fn values(&self) -> BTreeMap<Address, Vec<u8>> {
        let mut network = Network::new(self.bus.link());
        // Without the error history, which records what has happened.
        let kept = |entry: &&Entry| entry.access.writable() && entry.access.readable() && entry.index != 0x1003;
        let entries = self.sheet.device.entries().filter(kept);
        let addresses: Vec<_> = entries.map(|entry| Address::new(entry.index, entry.sub)).collect();
        addresses.into_iter().filter_map(|at| Some((at, network.read_bytes(NODE, at).ok()?))).collect()
    }

    fn test(&self, settings: &Settings, names: &[&str]) -> Report {
        self.observed(&mut self.bus.link(), settings, names, &mut (), &AtomicBool::new(false))
    }

    fn observed(
        &self,
        link: &mut dyn Link,
        settings: &Settings,
        names: &[&str],
        observer: &mut dyn Observer,
        stop: &AtomicBool,
    ) -> Report {
        let meant = |case: &&Case| names.is_empty() || names.iter().any(|name| case.is_meant_by(name));
        let cases: Vec<_> = cases().filter(meant).collect();
        test(link, &self.sheet, settings, &cases, stop, observer)
    }
}

/// The device has objects of a drive, but no drive whose standstill can be observed.
fn without_motion() -> Settings {
    Settings { allow: [Hazard::Manufacturer, Hazard::Outputs].into(), ..settings() }
}

#[test]
fn what_is_not_allowed_is_not_written() {
    let rig = Rig::of(RIGHT);
    let allow = [].into();
    let settings = Settings { allow, ..settings() };
    let report = rig.test(&settings, &[]);
    let tally = report.tally();
    assert_eq!((report.cases.len(), tally.failed, tally.unfinished), (cases().count(), 0, 0));
    assert!(tally.not_allowed >= 10, "{tally:?}");
    // Every request that begins a write: expedited, in segments, or as a block.
    let begins = ["23", "27", "2B", "2F", "20", "21", "22", "C2", "C6", "C0", "C4"];
    for frame in rig.frames.lock().unwrap().iter() {
        let Some(request) =
            frame.strip_prefix("605#").filter(|data| begins.iter().any(|begin| data.starts_with(begin)))
        else {
            continue;
        };
        let index = u16::from_str_radix(&format!("{}{}", &request[4..6], &request[2..4]), 16).unwrap();
        assert_eq!(Hazard::of_write(&rig.sheet.device, index), None, "{frame}");
    }
}

#[test]
fn what_was_written_is_put_back_even_if_no_reset_does_so() {
    for rules in [RIGHT, KEEPS] {
        let rig = Rig::of(rules);
        let before = rig.values();
        let report = rig.test(&without_motion(), &["2", "3", "4", "6", "7"]);
        assert_eq!(report.ended_early, None);
        let notes: Vec<_> = report.cases.iter().flat_map(|case| &case.notes).collect();
        assert_eq!((notes, report.not_put_back), (Vec::new(), Vec::new()));
        assert_eq!(rig.values(), before);
    }
}

/// Cancels the test as soon as a case begins that writes.
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
    let rig = Rig::of(KEEPS);
    let (before, stop) = (rig.values(), AtomicBool::new(false));
    let report = rig.observed(&mut rig.bus.link(), &settings(), &["3.5", "3.6"], &mut Impatient(&stop, 2), &stop);
    assert_eq!(report.cases[1].outcome, Err(Verdict::Unfinished(Ended::Cancelled)));
    assert_eq!(report.ended_early, Some(Ended::Cancelled));
    assert_eq!(rig.values(), before);
}

#[test]
fn what_a_case_has_written_that_took_too_long_is_put_back() {
    let rig = Rig::of(SENDS_FOR_EVER);
    let before = rig.values();
    let settings = Settings { case: Duration::from_secs(1), ..settings() };
    let report = rig.test(&settings, &["3.5"]);
    assert_eq!(report.cases[0].outcome, Err(Verdict::Failed("the case took longer than 1 s".to_owned())));
    assert_eq!((report.cases[0].notes.len(), report.not_put_back.len()), (0, 0));
    assert_eq!(rig.values(), before);
}

#[test]
fn what_could_not_be_put_back_is_in_the_report() {
    let rig = Rig::of(IS_WRITTEN_ONCE);
    let report = rig.test(&settings(), &["2.2", "2.3"]);
    let sentence = "1015:00 could not be put back to 0";
    assert_eq!((report.not_put_back, report.cases.len()), (vec![sentence.to_owned()], 2));
    assert_eq!(report.cases[0].notes, [sentence]);
}

/// LSS changes the node-ID, which is no entry and is not reset.
#[test]
fn a_device_has_its_node_id_again_wherever_a_test_of_lss_ends() {
    for last in ["", "7E5#117F", "7E5#11FF", "000#8205", "7E5#4C", "7E5#51580000000501", "7E5#130003"] {
        let rig = Rig { sheet: sheet(lss::DATA_SHEET), ..Rig::with(lss::DeviceWithLss::new()) };
        let stop = Arc::new(AtomicBool::new(false));
        let ends = Arc::clone(&stop);
        rig.bus.observe(move |_, frame| {
            if !last.is_empty() && frame.to_string().starts_with(last) {
                ends.store(true, Ordering::Relaxed);
            }
        });
        let report = rig.observed(&mut rig.bus.link(), &settings(), &["305"], &mut (), &stop);
        assert_eq!(report.not_put_back, [""; 0], "{last}");
        assert_eq!((report.tally().failed, report.tally().advised), (0, 0), "{last}");
        let frames = rig.frames.lock().unwrap().clone();
        for (configures, own) in [("7E5#11", "7E5#1105"), ("7E5#13000", "7E5#130002")] {
            let given = frames.iter().rfind(|frame| frame.starts_with(configures));
            assert!(given.is_none_or(|given| given.starts_with(own)), "{last}: {given:?}");
        }
        let mut network = Network::new(rig.bus.link());
        network.command(NmtCommand::ResetNode, Some(NODE)).unwrap();
        assert_eq!(network.read_bytes(NODE, Address::new(0x1000, 0)).unwrap(), [0; 4], "{last}");
    }
}

#[test]
fn a_device_that_does_not_take_its_node_id_back_is_in_the_report() {
    let is_not_selected_again = fault("heard 7E5#40* after 7E5#4C* 7E5#11FF*");
    let node = Faulty::new(lss::DeviceWithLss::new(), &is_not_selected_again);
    let rig = Rig { sheet: sheet(lss::DATA_SHEET), ..Rig::with(node) };
    let report = rig.test(&settings(), &["305/6.6.4/2"]);
    assert!(report.not_put_back[0].starts_with("node-ID 5 could not be put back: "), "{:?}", report.not_put_back);
}

const NO_BLOCK_DOWNLOADS: &str =
    "heard 605#C2* answered 585#80......01000405; heard 605#C6* answered 585#80......01000405";
const NO_BLOCK_UPLOADS: &str =
    "heard 605#A0* answered 585#80......01000405; heard 605#A4* answered 585#80......01000405";
const NO_CHECKSUMS: &str = "heard 605#C6* answered 585#80......01000405";

/// Blocks are optional in both directions.
#[test]
fn a_server_without_blocks_is_not_tested_by_them() {
    for (rules, excused, failed) in [
        (NO_BLOCK_DOWNLOADS, "2.20 2.21 2.24 2.25 301/7.2.4.3.10/1 301/7.2.4.3.9/3", ""),
        (NO_BLOCK_UPLOADS, "2.19 2.22 2.23 2.26 2.27 301/7.2.4.3.14/3 301/7.2.4.3.14/4", ""),
        (NO_CHECKSUMS, "", "2.24 2.25 301/7.2.4.3.10/1"),
    ] {
        let report = Rig::of(rules).test(&without_motion(), &["2", "301/7.2.4.3"]);
        assert_eq!(report.ended_early, None);
        let names = |wanted: fn(&Verdict) -> bool| {
            let cases = report.cases.iter().filter(|case| case.outcome.as_ref().is_err_and(wanted));
            cases.map(|report| crate::name(report.case)).collect::<Vec<_>>().join(" ")
        };
        assert_eq!(names(|verdict| matches!(verdict, Verdict::Failed(_))), failed, "{rules}");
        assert_eq!(names(|verdict| matches!(verdict, Verdict::NotApplicable(_))), excused, "{rules}");
        for case in report.cases {
            if let Err(Verdict::NotApplicable(why)) = case.outcome {
                assert!(why.starts_with("the SDO server refuses every block "), "{why}");
            }
        }
    }
}

/// A device that delays each answer.
struct Slow {
    inner: DeviceUnderTest,
    answers: VecDeque<(Instant, Frame)>,
}

impl Node for Slow {
    fn handle_frame(&mut self, now: Instant, frame: &Frame) {
        self.inner.handle_frame(now, frame);
    }
    fn handle_timeout(&mut self, now: Instant) {
        self.inner.handle_timeout(now);
    }
    fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        while let Some(frame) = self.inner.poll_transmit(now) {
            self.answers.push_back((now + Duration::from_millis(15), frame));
        }
        let is_due = self.answers.front().is_some_and(|(due, _)| *due <= now);
        if is_due { self.answers.pop_front().map(|(_, frame)| frame) } else { None }
    }
    fn poll_timeout(&self) -> Option<Instant> {
        self.answers.front().map(|(due, _)| *due).into_iter().chain(self.inner.poll_timeout()).min()
    }
}

#[test]
fn a_slow_device_passes_all_cases_of_sdo() {
    let slow = Slow { inner: DeviceUnderTest::new(), answers: VecDeque::new() };
    let report = Rig::with(slow).test(&without_motion(), &["2", "301/7.2.4.3"]);
    assert_eq!(report.ended_early, None);
    for case in report.cases {
        let needs = case.case.needs.iter().any(|hazard| !without_motion().allow.contains(hazard));
        assert!(needs || case.outcome == Ok(()), "{} {:?}", case.case.id, case.outcome);
    }
}

#[test]
fn what_is_timed_has_figures() {
    let report = Rig::of(RIGHT).test(&settings(), &["7.102"]);
    let figures = "705 every 100 ms: 100.00 to 100.00 ms over 10, allowed 90.00 to 110.00";
    assert_eq!(report.cases[0].measured, [figures]);
}

#[test]
fn the_first_failure_ends_a_test_that_is_to_end_then() {
    let rig = Rig::of(WRONG);
    let report = rig.test(&Settings { fail_fast: Some(Level::Must), ..settings() }, &["2.1", "2.2"]);
    assert_eq!((report.cases.len(), report.ended_early), (1, Some(Ended::AtFailure)));
}

#[test]
fn a_case_that_fails_otherwise_than_known_fails() {
    let seen = |text: &str| {
        let known = Known { seen: text.to_owned(), why: "chapter 1".to_owned() };
        let settings = Settings { known: [("306-1/6.5.2/2".to_owned(), known)].into(), ..settings() };
        let report = Rig::of(WRONG).test(&settings, &["4.2"]);
        (report.cases[0].verdict(), report.cases[0].known.clone(), report.cases[0].notes.clone())
    };
    assert_eq!(seen("1000:00 is 0, by default *"), ("known", Some("chapter 1".to_owned()), Vec::new()));
    let otherwise = "it is known to fail otherwise: 1000:00 is 1, by default *".to_owned();
    assert_eq!(seen("1000:00 is 1, by default *"), ("failed", None, vec![otherwise]));
}

#[test]
fn a_case_in_which_the_device_was_away_is_run_again() {
    for (event, note) in [
        (Event::Dozes(2), "the device was away, and the case was run again"),
        (Event::Resets, "the device has booted without being reset, and the case was run again"),
    ] {
        let inner = DeviceUnderTest::new();
        let rig = Rig::with(Disturbed { inner, event: Some(event), deaf_until: Instant::ZERO });
        let settings = Settings { boot: Duration::from_secs(3), ..settings() };
        let report = rig.test(&settings, &["2.2", "2.3"]);
        assert_eq!(report.cases[0].notes, [note]);
        assert_eq!(report.tally().passed, 2);
    }
}

#[test]
fn a_bus_that_was_lost_is_waited_for() {
    for (seconds, cases) in [(10, 3), (60, 1)] {
        let rig = Rig::of(RIGHT);
        // The first case begins after two seconds of listening.
        let from = Instant::ZERO + Duration::from_millis(2_200);
        let until = from + Duration::from_secs(seconds);
        let mut link = Unplugged { inner: rig.bus.link(), bus: rig.bus.clone(), from, until };
        let report = rig.observed(&mut link, &settings(), &["3.5", "3.6", "3.7"], &mut (), &AtomicBool::new(false));
        assert_eq!(report.cases.len(), cases);
        if cases == 3 {
            let notes = &report.cases[0].notes;
            assert!(notes[0].starts_with("the bus was lost (") && notes[0].ends_with("run again"), "{notes:?}");
            assert_eq!((report.tally().passed, report.ended_early), (3, None));
        } else {
            assert!(matches!(report.ended_early, Some(Ended::BusLost(_))), "{:?}", report.ended_early);
            assert!(!report.not_put_back.is_empty());
        }
    }
}

/// A device that is silent after a request, as after a crash: for ever, or until something restores it.
#[test]
fn a_device_that_does_not_come_back_ends_no_other_chapter() {
    const CRASHES: &str = "heard * after 605#2B151000*";
    const ALIVE_BY_RESET: &str = "heard * after 605#2B15100064* until 000#8205";
    let names = ["2.2", "2.3", "2.4", "7.101", "10.1"];
    let verdicts = |report: &Report| report.cases.iter().map(CaseReport::verdict).collect::<Vec<_>>();
    let report = Rig::of(CRASHES).test(&settings(), &names);
    assert_eq!(verdicts(&report), ["failed", "blocked", "blocked", "blocked", "blocked"]);
    assert_eq!((report.ended_early.as_ref(), report.root_causes().len()), (None, 1));
    assert!(report.findings[0].starts_with("after 301/7.5.2/1 the device did not come back"), "{:?}", report.findings);
    assert!(!report.not_put_back.is_empty());

    let report = Rig::of(ALIVE_BY_RESET).test(&settings(), &names);
    assert_eq!(verdicts(&report), ["failed", "passed", "passed", "passed", "passed"]);
    assert_eq!(report.findings, ["after 301/7.5.2/1 the device answered only when its communication was reset"]);
    assert_eq!(report.not_put_back, [""; 0]);

    let rig =
        Rig::with(Disturbed { inner: DeviceUnderTest::new(), event: Some(Event::Dozes(4)), deaf_until: Instant::ZERO });
    let report = rig.test(&settings(), &names);
    assert_eq!(verdicts(&report), ["failed", "blocked", "blocked", "blocked", "passed"]);
    assert_eq!(report.findings, ["after 301/7.5.2/1 the device did not answer; with 301/7.2.8.2.1/1 it did again"]);
    assert_eq!(report.not_put_back, [""; 0]);
}

/// If a reset does not restore the values, they are restored by storing them again.
#[test]
fn storage_that_has_grown_is_named() {
    // 1011h does nothing.
    let rig = Rig::of("heard 605#2311100* answered 585#60....0000000000");
    let before = rig.values();
    let report = rig.test(&settings(), &["8.2"]);
    assert_eq!(report.not_put_back, [""; 0]);
    assert!(report.findings[0].starts_with("the storage has grown: "), "{:?}", report.findings);
    assert_eq!(rig.values(), before);
    assert_eq!(Rig::of(RIGHT).test(&settings(), &["8.2"]).findings, [""; 0]);
}

#[test]
fn nothing_is_tested_by_an_unfit_data_sheet_or_without_a_device() {
    let rig = Rig::of(RIGHT);
    let (stop, all) = (AtomicBool::new(false), cases().collect::<Vec<_>>());
    let unfit = sheet(&DATA_SHEET.replace("[1000]", "[1F99]"));
    assert!(unfit.is_unfit, "{}", unfit.findings);
    let report = test(&mut rig.bus.link(), &unfit, &settings(), &all, &stop, &mut ());
    let verdicts: Vec<_> = report.cases.iter().map(|case| (crate::name(case.case), case.verdict())).collect();
    assert_eq!(verdicts, [("1.0", "failed"), ("306-1/6/2", "not applicable")]);
    assert!(matches!(report.ended_early, Some(Ended::Unfit(findings)) if findings.to_string().contains("device.eds:")));
    assert_eq!(*rig.frames.lock().unwrap(), [""; 0], "not a frame is sent");

    let settings = Settings { node: NodeId::literal(9), ..settings() };
    let report = test(&mut rig.bus.link(), &rig.sheet, &settings, &all, &stop, &mut ());
    assert_eq!((report.cases.len(), report.ended_early), (0, Some(Ended::Silent(settings.node))));
}

/// A case that depends on the subject of another case does not fail because of it, whether or not the other one is
/// selected.
#[test]
fn what_a_failed_case_is_about_blocks_the_cases_that_need_it() {
    const SENDS_NO_EMERGENCY: &str = "heard 605#23042000* answered 585#6004200000000000";
    let verdicts = |names: &[&str]| {
        let report = Rig::of(SENDS_NO_EMERGENCY).test(&settings(), names);
        let verdicts = report.cases.iter().map(|case| (case.case.plan, case.verdict())).collect::<Vec<_>>();
        (verdicts, report.root_causes(), report.cases.last().unwrap().outcome.clone())
    };
    let (all, roots, _) = verdicts(&["5.4", "5.5", "5.6"]);
    assert_eq!(all, [("5.4", "failed"), ("5.5", "blocked"), ("5.6", "blocked")]);
    assert_eq!(roots, ["301/7.2.7/1 an emergency is sent, once: blocks 301/7.5.2.2/2, 301/7.5.2.4/2"]);
    let (one, _, outcome) = verdicts(&["5.5"]);
    let why = "one emergency of eight bytes was expected, nothing came".to_owned();
    assert_eq!((one, outcome), (vec![("5.5", "blocked")], Err(Verdict::Blocked("301/7.2.7/1", why))));
    // The same step fails, but the case about it passes.
    let report = Rig::of("sent 705#04 in STOPPED").test(&settings(), &["10.4"]);
    assert_eq!((report.cases[0].verdict(), report.root_causes().len()), ("failed", 0));
}

/// CiA's tool causes emergencies by an RPDO without bytes, so mistakes in them are found without a stimulus.
#[test]
fn emergencies_are_tested_by_a_short_rpdo() {
    let cases = ["5.4", "5.6", "301/7.5.2.4/3", "301/7.5.2.18/1", "301/7.2.2.1/2"];
    for (rules, verdicts) in [
        ("", ["passed"; 5]),
        // 1003h lacks the error.
        ("heard 605#40031000* answered 585#4F03100000000000", ["passed", "failed", "failed", "passed", "passed"]),
        // 1003h is not cleared.
        ("heard 605#2F031000* answered 585#6003100000000000", ["passed", "passed", "failed", "passed", "passed"]),
        // 1015h is ignored.
        ("heard 605#2B151000B80B* becomes 605#2B1510000000*", ["passed", "passed", "passed", "failed", "passed"]),
        // No short RPDO is reported.
        ("sent 085#1082*", ["not applicable", "not applicable", "not applicable", "not applicable", "advised"]),
    ] {
        let settings = Settings { stimuli: Default::default(), ..settings() };
        let seen = cases.map(|name| Rig::of(rules).test(&settings, &[name]).cases[0].verdict());
        assert_eq!(seen, verdicts, "{rules}");
    }
}
