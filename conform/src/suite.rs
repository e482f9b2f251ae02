//! A whole test: the order of its cases, and putting back what they change.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::{AtomicBool, Ordering};

use lexican_eds::model::Entry;
use lexican_eds::types::DataType;
use lexican_runtime::host::Link;
use lexican_runtime::wire::nmt::{NmtCommand, NmtState};
use lexican_runtime::{AbortCode, CobId, Duration};

use crate::axis::make_safe;
use crate::case::{Case, Scope};
use crate::cases::pdo_mapping::writing_order;
use crate::cases::{cases, lss};
use crate::hazard::Hazard;
use crate::sdo;
use crate::sheet::Sheet;
use crate::tester::{Record, Settings, Tester, uncancelled};
use crate::verdict::{Ended, Level, Outcome, Verdict};

/// The entries by which a device identifies itself.
const IDENTITY: [((u16, u8), &str); 7] = [
    ((0x1018, 1), "vendor-ID"),
    ((0x1018, 2), "product code"),
    ((0x1018, 3), "revision number"),
    ((0x1018, 4), "serial number"),
    ((0x1008, 0), "device name"),
    ((0x1009, 0), "hardware version"),
    ((0x100A, 0), "software version"),
];

/// How long other nodes on the bus are listened to before the test.
const OTHERS: Duration = Duration::from_secs(2);

/// The result of a case.
#[derive(Clone, Debug)]
pub struct CaseReport {
    /// The case.
    pub case: &'static Case,
    /// What came of it.
    pub outcome: Outcome,
    /// How long it took.
    pub took: Duration,
    /// Its frames.
    pub frames: Vec<Record>,
    /// Why the failure is accepted, if it is [known](Settings::known).
    pub known: Option<String>,
    /// The accepted answers, if there are several.
    pub expected: Vec<String>,
    /// Measurements and observations, with the allowed values.
    pub measured: Vec<String>,
    /// Other events: why the case was run again, or what could not be put back yet.
    pub notes: Vec<String>,
}

/// The result of a test.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// The cases that were run, in this order.
    pub cases: Vec<CaseReport>,
    /// Why the test ended before its last case.
    pub ended_early: Option<Ended>,
    /// A sentence for each entry that is not, or may not be, as it was before the test.
    pub not_put_back: Vec<String>,
    /// A sentence for each other effect on the device: it did not come back, or its storage has grown.
    pub findings: Vec<String>,
    /// The identity of the device before the first case: the name and the value of each entry.
    pub identity: Vec<(String, String)>,
    /// How long the test took.
    pub took: Duration,
}

/// Follows a test while it runs.
pub trait Observer {
    /// Case `number` of `total` begins; the first is 1.
    fn begins(&mut self, number: usize, total: usize, case: &Case);
    /// A case is over.
    fn ended(&mut self, report: &CaseReport);
}

impl Observer for () {
    fn begins(&mut self, _: usize, _: usize, _: &Case) {}
    fn ended(&mut self, _: &CaseReport) {}
}

/// Runs cases one after another. The entries that a case has written are put back after it, even if the test is
/// cancelled.
///
/// A drive is disabled after each case that may have given it orders, even after Ctrl-C; the test goes on only if it
/// stands.
///
/// If the data sheet is [unfit](Sheet::is_unfit), only the cases about data sheets are run.
pub fn run(
    link: &mut dyn Link,
    sheet: &Sheet,
    settings: &Settings,
    cases: &[&'static Case],
    cancelled: &AtomicBool,
    observer: &mut dyn Observer,
) -> Report {
    let mut report = Report::default();
    let begun = link.now();
    let tester = Tester::new(link, sheet, settings, cancelled);
    let mut suite = Suite {
        tester,
        cancelled,
        before: BTreeMap::new(),
        changed: BTreeSet::new(),
        stores: false,
        has_grown: false,
        failed: BTreeMap::new(),
        moving: None,
        gone: None,
        findings: Vec::new(),
        identity: Vec::new(),
    };
    let mut cases = cases.to_vec();
    if sheet.is_unfit {
        cases.retain(|case| case.scope == Scope::DataSheet);
    } else {
        report.ended_early = suite.prepare().err();
        report.identity = suite.identity.clone();
    }
    for (number, case) in (1..).zip(&cases) {
        if report.ended_early.is_none() && cancelled.load(Ordering::Relaxed) {
            report.ended_early = Some(Ended::Cancelled);
        }
        if report.ended_early.is_some() {
            break;
        }
        observer.begins(number, cases.len(), case);
        let (ended, end) = suite.run(case);
        observer.ended(&ended);
        report.ended_early = end;
        report.cases.push(ended);
    }
    if sheet.is_unfit {
        report.ended_early = Some(Ended::Unfit(sheet.findings.clone()));
    }
    report.not_put_back = suite.put_back();
    report.findings = suite.what_has_become();
    report.took = suite.tester.now().since(begun);
    report
}

/// How long a step outside the cases may take.
pub(crate) const STEP: Duration = Duration::from_secs(120);

/// Entries that cases may write, with the values before the test.
type Before = BTreeMap<(u16, u8), Vec<u8>>;

/// How often a lost bus is tried again.
const RETRY: Duration = Duration::from_millis(50);

/// Whether the device answers, and how it came back.
enum Presence {
    Here,
    /// Only after a while.
    Back,
    /// Only after this reset.
    Reset(NmtCommand),
    Gone(Ended),
}

/// A device that has not come back.
struct Gone {
    /// The case after which it was gone.
    by: &'static str,
    /// The chapters in which it has been searched for in vain.
    chapters: BTreeSet<&'static str>,
}

struct Suite<'a> {
    tester: Tester<'a>,
    cancelled: &'a AtomicBool,
    before: Before,
    /// The entries that cases have written, and that may not have their former values yet.
    changed: BTreeSet<(u16, u8)>,
    /// Whether a case has stored parameters.
    stores: bool,
    /// Whether the former values were stored again, so that the storage holds entries that it did not hold before.
    has_grown: bool,
    /// The cases that were run, and whether they have failed.
    failed: BTreeMap<&'static str, bool>,
    /// Why the drive may still move and could not be stopped, as far as that is known.
    moving: Option<String>,
    gone: Option<Gone>,
    /// Effects on the device that remain, for the report.
    findings: Vec<String>,
    /// The identity of the device before the first case.
    identity: Vec<(String, String)>,
}

impl Suite<'_> {
    /// Records what the cases might change, before the first one.
    fn prepare(&mut self) -> Result<(), Ended> {
        self.tester.limit(OTHERS + STEP);
        let heard = match self.tester.hear(OTHERS) {
            Ok(heard) => heard,
            Err(Verdict::Unfinished(ended)) => return Err(ended),
            Err(_) => Vec::new(),
        };
        match self.tester.upload(0x1000, 0) {
            Ok(_) => {}
            Err(Verdict::Unfinished(ended)) => return Err(ended),
            Err(_) => return Err(Ended::Silent(self.tester.node)),
        }
        for (at @ (index, sub), name) in IDENTITY {
            if let Ok(entry) = self.tester.entry(index, sub)
                && let Ok(Ok(bytes)) = self.tester.upload(index, sub)
            {
                let is_text = entry.data_type == DataType::VisibleString;
                let text = || String::from_utf8_lossy(&bytes).trim_end_matches('\0').to_owned();
                let value = if is_text { text() } else { self.tester.shown(at, &bytes) };
                self.identity.push((format!("{name} ({index:04X}h:{sub:02X})"), value));
            }
        }
        // The error history is a record, and is not put back.
        let kept = |entry: &Entry| entry.access.readable() && entry.access.writable() && entry.index != 0x1003;
        let writable = self.tester.entries(kept);
        for entry in writable {
            self.tester.limit(STEP);
            // A case reports entries that cannot be read.
            if let Ok(Ok(bytes)) = self.tester.upload(entry.index, entry.sub) {
                self.before.insert((entry.index, entry.sub), bytes);
            }
        }
        let own = self.own_identifiers();
        self.tester.ignore(heard.iter().map(|(_, frame)| frame.id()).filter(|id| !own.contains(id)).collect());
        Ok(())
    }

    /// The COB-IDs that the device may send: the predefined ones of its node-ID, and those configured in it.
    fn own_identifiers(&self) -> BTreeSet<CobId> {
        let predefined = (0x080..0x800).step_by(0x80).map(|base| CobId::of_node(base, self.tester.node));
        let sends = |&&(index, sub): &&(u16, u8)| match index {
            // Bit 30 makes the device a producer of SYNC or TIME.
            0x1005 | 0x1012 => self.number(index, sub) >> 30 & 1 != 0,
            0x1014 => true,
            _ => (0x1800..0x1A00).contains(&index) && sub == 1,
        };
        let given = self.before.keys().filter(sends).map(|&(index, sub)| self.number(index, sub));
        predefined.chain(given.map(CobId::from_parameter)).collect()
    }

    /// Runs a case, again if it may have failed without fault of the device; returns why the test ends with it, if it
    /// does.
    fn run(&mut self, case: &'static Case) -> (CaseReport, Option<Ended>) {
        let begun = self.tester.now();
        if case.scope != Scope::DataSheet
            && let Some((verdict, end)) = self.is_without_device(case)
        {
            let took = self.tester.now().since(begun);
            let (outcome, frames) = (Err(verdict), self.tester.frames().to_vec());
            let (known, expected, measured, notes) = (None, Vec::new(), Vec::new(), Vec::new());
            return (CaseReport { case, outcome, took, frames, known, expected, measured, notes }, end);
        }
        let mut notes = Vec::new();
        let (mut outcome, mut frames) = self.once(case);
        let mut end = None;
        let repeats = match &outcome {
            Err(Verdict::Failed(_)) if case.scope != Scope::DataSheet => {
                match (self.tester.disturbance(), self.looks_for_device(self.tester.settings.boot)) {
                    (_, Presence::Gone(Ended::Silent(_))) => {
                        notes.push("the device does not answer any more".to_owned());
                        self.gone = Some(Gone { by: case.id, chapters: [case.chapter()].into() });
                        None
                    }
                    (_, Presence::Gone(gone)) => {
                        end = Some(gone);
                        None
                    }
                    (_, Presence::Reset(command)) => {
                        let what = if command == NmtCommand::ResetNode { "node" } else { "communication" };
                        self.findings
                            .push(format!("after {} the device answered only when its {what} was reset", case.id));
                        None
                    }
                    (Some(disturbance), _) => Some(disturbance),
                    (None, Presence::Back) => Some("the device was away".to_owned()),
                    (None, Presence::Here) => None,
                }
            }
            Err(Verdict::Unfinished(Ended::BusLost(why))) => {
                let lost = format!("the bus was lost ({why})");
                match self.looks_for_device(self.tester.settings.bus) {
                    Presence::Gone(_) => None,
                    Presence::Here | Presence::Back | Presence::Reset(_) => Some(lost),
                }
            }
            Err(Verdict::NotDecidable(why)) => Some(why.clone()),
            _ => {
                notes.extend(self.tester.disturbance());
                None
            }
        };
        if let Some(why) = repeats {
            notes.push(format!("{why}, and the case was run again"));
            (outcome, frames) = self.once(case);
        }
        let expected = self.tester.expected().to_vec();
        let (measured, missing) = (self.tester.measured().to_vec(), self.tester.missing);
        self.failed.insert(case.id, matches!(outcome, Err(Verdict::Failed(_))));
        let took = self.tester.now().since(begun);
        let settings = self.tester.settings;
        let mut known = None;
        if let Some(deviation) = settings.known.get(case.id) {
            match &outcome {
                Ok(()) => notes.push("it is known to fail, and has passed".to_owned()),
                Err(Verdict::Failed(why)) if deviation.is_seen_in(why) => known = Some(deviation.why.clone()),
                Err(Verdict::Failed(_)) => notes.push(format!("it is known to fail otherwise: {}", deviation.seen)),
                Err(_) => {}
            }
        }
        let why = if let Err(Verdict::Failed(why)) = &outcome { Some(why.clone()) } else { None };
        let why = why.filter(|_| known.is_none() && end.is_none());
        if let (Some(why), Some(by)) = (why, missing.filter(|&by| by != case.id))
            && self.has_failed(by)
        {
            outcome = Err(Verdict::Blocked(by, why));
        }
        match &outcome {
            Err(Verdict::Unfinished(ended)) => end = Some(ended.clone()),
            Err(Verdict::Failed(_)) if end.is_none() && known.is_none() => {
                let counts =
                    settings.fail_fast.is_some_and(|level| level == Level::Should || case.level == Level::Must);
                end = counts.then_some(Ended::AtFailure);
            }
            _ => {}
        }
        end = self.moving.take().map(Ended::Moving).or(end);
        // The report of the whole test says what stays changed.
        notes.extend(if self.gone.is_some() { self.left() } else { self.put_back() });
        (CaseReport { case, outcome, took, frames, known, expected, measured, notes }, end)
    }

    /// Whether a case fails; runs it if it has not been run yet.
    fn has_failed(&mut self, id: &'static str) -> bool {
        if let Some(failed) = self.failed.get(id) {
            return *failed;
        }
        let failed =
            cases().find(|case| case.id == id).is_some_and(|case| matches!(self.once(case).0, Err(Verdict::Failed(_))));
        self.failed.insert(id, failed);
        failed
    }

    /// Runs a case, and makes the device reachable at its node-ID again; returns the outcome, and the frames of the
    /// case.
    fn once(&mut self, case: &'static Case) -> (Outcome, Vec<Record>) {
        let outcome = self.tester.run(case);
        let frames = self.tester.frames().to_vec();
        if self.has_ordered(case) {
            self.moving = self.undo(|suite| make_safe(&mut suite.tester).err());
        }
        self.undo(|suite| lss::put_back(&mut suite.tester));
        let written = self.tester.written();
        self.stores |= written.iter().any(|&(index, _)| index == 0x1010);
        // Entries whose former value is unknown cannot be put back.
        self.changed.extend(written.into_iter().filter(|at| self.before.contains_key(at)));
        (outcome, frames)
    }

    /// Whether a case may have given orders to a drive.
    fn has_ordered(&self, case: &Case) -> bool {
        let device = &self.tester.sheet.device;
        let is_order = |(index, _)| Hazard::of_write(device, index) == Some(Hazard::Motion);
        let asks = device.profile == Some(402) && case.needs.contains(&Hazard::Motion);
        let allowed = self.tester.settings.allow.contains(&Hazard::Motion);
        allowed && (asks || self.tester.written().into_iter().any(is_order))
    }

    /// Whether the device answers, or comes back within some time.
    fn looks_for_device(&mut self, within: Duration) -> Presence {
        let (until, mut presence) = (self.tester.now() + within, Presence::Here);
        // In STOPPED a device does not answer SDO requests, though it is there.
        let mut wakes = Some(NmtCommand::EnterPreOperational);
        loop {
            self.tester.limit(STEP);
            let asked = wakes.take().map_or(Ok(()), |command| self.tester.nmt(command));
            match asked.and_then(|()| self.tester.upload(0x1000, 0)) {
                Ok(_) => return presence,
                Err(Verdict::Unfinished(Ended::BusLost(_))) if self.tester.wait(RETRY) => {}
                Err(Verdict::Unfinished(ended)) => return Presence::Gone(ended),
                Err(_) => {}
            }
            if self.tester.now() >= until {
                break;
            }
            presence = Presence::Back;
        }
        match self.is_back_by_reset() {
            Ok(command) => Presence::Reset(command),
            Err(ended) => Presence::Gone(ended),
        }
    }

    /// Tries to bring a device back that no longer answers SDO, by a reset of the node, or of its communication.
    fn is_back_by_reset(&mut self) -> Result<NmtCommand, Ended> {
        for command in [NmtCommand::ResetNode, NmtCommand::ResetCommunication] {
            self.tester.limit(STEP);
            // A device that does not obey the reset may be in STOPPED, in which there is no SDO. The upload shows
            // whether it is back, so its boot-up message is not needed.
            let _: Outcome = self.tester.reset(command);
            let entered = self.tester.enter(NmtState::PreOperational);
            match entered.and_then(|()| self.tester.upload(0x1000, 0)) {
                Ok(_) => return Ok(command),
                Err(Verdict::Unfinished(ended)) => return Err(ended),
                Err(_) => {}
            }
        }
        Err(Ended::Silent(self.tester.node))
    }

    /// The verdict on a case while the device is gone; `None` if it is back. It is searched for once in each chapter.
    fn is_without_device(&mut self, case: &Case) -> Option<(Verdict, Option<Ended>)> {
        let mut gone = self.gone.take()?;
        let verdict = Verdict::Blocked(gone.by, "the device has not come back since".to_owned());
        self.tester.begin();
        if gone.chapters.insert(case.chapter()) {
            match self.looks_for_device(Duration::ZERO) {
                Presence::Gone(Ended::Silent(_)) => {}
                Presence::Gone(ended) => return Some((Verdict::Unfinished(ended.clone()), Some(ended))),
                _ => {
                    self.findings
                        .push(format!("after {} the device did not answer; with {} it did again", gone.by, case.id));
                    return None;
                }
            }
        }
        self.gone = Some(gone);
        Some((verdict, None))
    }

    /// Undoes effects of cases, even after Ctrl-C.
    fn undo<T>(&mut self, work: impl FnOnce(&mut Self) -> T) -> T {
        uncancelled(self.cancelled, || {
            self.tester.limit(STEP);
            work(self)
        })
    }

    /// Restores the state before the test, by a reset or else by writing: a sentence for each entry that may not be as
    /// it was.
    fn put_back(&mut self) -> Vec<String> {
        let by_lss = self.undo(|suite| lss::put_back(&mut suite.tester));
        if self.changed.is_empty() {
            return Vec::from_iter(by_lss);
        }
        self.undo(|suite| {
            if suite.is_back_by_reset().is_ok() {
                suite.restore();
            }
        });
        by_lss.into_iter().chain(self.left()).collect()
    }

    /// A sentence for each entry that may not have its former value.
    fn left(&self) -> Vec<String> {
        let was = |&(index, sub): &(u16, u8)| {
            let before = self.tester.shown((index, sub), &self.before[&(index, sub)]);
            format!("{index:04X}:{sub:02X} could not be put back to {before}")
        };
        self.changed.iter().map(was).collect()
    }

    /// Effects of the test on the device, other than entries that are not as they were.
    fn what_has_become(&mut self) -> Vec<String> {
        let gone = self.gone.take().map(|Gone { by, .. }| {
            format!("after {by} the device did not come back: switch it off and on, and run the cases that are blocked by it")
        });
        let grown = self.has_grown.then(|| {
            "the storage has grown: its parameters are what they were, and all of them are stored now; \
             writing \"load\" (64616F6Ch) to 1011h:01 makes them the defaults"
                .to_owned()
        });
        std::mem::take(&mut self.findings).into_iter().chain(gone).chain(grown).collect()
    }

    fn restore(&mut self) {
        self.keep_what_differs();
        let changed: Vec<_> = self.changed.iter().copied().collect();
        let order = writing_order(&mut self.tester, changed.iter().copied()).unwrap_or(changed);
        for &at in &order {
            self.write_back(at);
        }
        if self.stores && !order.is_empty() {
            // Stored values come back with each reset, so the former ones are stored.
            let stored = self.tester.try_write(0x1010, 1, u32::from_le_bytes(*b"save"));
            self.has_grown |= matches!(stored, Ok(Ok(_)));
        }
        self.changed.extend(order);
        self.keep_what_differs();
    }

    fn keep_what_differs(&mut self) {
        let written = std::mem::take(&mut self.changed);
        self.changed = written.into_iter().filter(|&at| self.differs(at)).collect();
    }

    fn number(&self, index: u16, sub: u8) -> u32 {
        self.before.get(&(index, sub)).map_or(0, |bytes| sdo::number(bytes) as u32)
    }

    fn differs(&mut self, at: (u16, u8)) -> bool {
        let Some(before) = self.before.get(&at) else { return false };
        !matches!(self.tester.upload(at.0, at.1), Ok(Ok(now)) if now == *before)
    }

    fn write_back(&mut self, at: (u16, u8)) {
        if let (Some(bytes), Ok(entry)) = (self.before.get(&at), self.tester.entry(at.0, at.1)) {
            // Whether it was accepted is read afterwards.
            let _: Outcome<Result<(), AbortCode>> = self.tester.write_back(&entry, bytes);
        }
    }
}
