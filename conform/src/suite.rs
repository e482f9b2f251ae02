//! A whole test: which cases, in which order, and what is left of them in the device.

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

/// What a device says that it is.
const IDENTITY: [((u16, u8), &str); 7] = [
    ((0x1018, 1), "vendor-ID"),
    ((0x1018, 2), "product code"),
    ((0x1018, 3), "revision number"),
    ((0x1018, 4), "serial number"),
    ((0x1008, 0), "device name"),
    ((0x1009, 0), "hardware version"),
    ((0x100A, 0), "software version"),
];

/// For how long others on the bus are listened to before the test.
const OTHERS: Duration = Duration::from_secs(2);

/// What one case has led to.
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
    /// Why it may fail as it does, where that is [known](Settings::known).
    pub known: Option<String>,
    /// The sets of answers that are right, where there are several.
    pub expected: Vec<String>,
    /// What was measured or observed, beside what is allowed.
    pub measured: Vec<String>,
    /// What has happened beside it: the case was run again and why, or something could not be put back yet.
    pub notes: Vec<String>,
}

/// What a test has led to.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// The cases that were run, in their order.
    pub cases: Vec<CaseReport>,
    /// Why the test ended before its last case.
    pub ended_early: Option<Ended>,
    /// What is not as it was before the test, or not known to be: a sentence for each entry.
    pub not_put_back: Vec<String>,
    /// What has become of the device beside that: it did not come back, or its storage has grown. A sentence for each.
    pub findings: Vec<String>,
    /// What the device says that it is, before the first case: the name of each entry, and its value.
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

/// Runs cases one after the other. What they have written is put back after each, also if the test is cancelled.
///
/// A drive is disabled after each case that may have given it orders, also after Ctrl-C; the test goes on only if it stands.
///
/// By a data sheet of which [nothing correct can be made](Sheet::is_unfit), only the cases about data sheets are run.
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

/// How long a step may take that is no case.
pub(crate) const STEP: Duration = Duration::from_secs(120);

/// Written by the cases, and what was there before.
type Before = BTreeMap<(u16, u8), Vec<u8>>;

/// How often a lost bus is tried.
const RETRY: Duration = Duration::from_millis(50);

/// Whether the device answers.
enum Presence {
    Here,
    /// Not at first.
    Back,
    /// Not before this reset.
    Reset(NmtCommand),
    Gone(Ended),
}

/// A device that does not come back.
struct Gone {
    /// The case that it was gone after.
    by: &'static str,
    /// The chapters in which it was looked for in vain.
    chapters: BTreeSet<&'static str>,
}

struct Suite<'a> {
    tester: Tester<'a>,
    cancelled: &'a AtomicBool,
    before: Before,
    /// What cases have written, and is not known to be as it was before.
    changed: BTreeSet<(u16, u8)>,
    /// A case has stored parameters.
    stores: bool,
    /// The old values were stored again: the storage holds entries that it did not hold before.
    has_grown: bool,
    /// Whether cases that were run have failed.
    failed: BTreeMap<&'static str, bool>,
    /// The drive may move, and could not be stopped: why that is not known better.
    moving: Option<String>,
    gone: Option<Gone>,
    /// What has become of the device.
    findings: Vec<String>,
    /// What the device says that it is.
    identity: Vec<(String, String)>,
}

impl Suite<'_> {
    /// Looks at what the cases might change, while nothing has been changed.
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
        // The error history is what happened, and nothing to be put back.
        let kept = |entry: &Entry| entry.access.readable() && entry.access.writable() && entry.index != 0x1003;
        let writable = self.tester.entries(kept);
        for entry in writable {
            self.tester.limit(STEP);
            // What a device does not let be read, a case will say.
            if let Ok(Ok(bytes)) = self.tester.upload(entry.index, entry.sub) {
                self.before.insert((entry.index, entry.sub), bytes);
            }
        }
        let own = self.own_identifiers();
        self.tester.ignore(heard.iter().map(|(_, frame)| frame.id()).filter(|id| !own.contains(id)).collect());
        Ok(())
    }

    /// The identifiers of what the device may send: the predefined ones of its node-ID, and those that it has been given.
    fn own_identifiers(&self) -> BTreeSet<CobId> {
        let predefined = (0x080..0x800).step_by(0x80).map(|base| CobId::of_node(base, self.tester.node));
        let sends = |&&(index, sub): &&(u16, u8)| match index {
            // Bit 30 makes a producer of SYNC and TIME.
            0x1005 | 0x1012 => self.number(index, sub) >> 30 & 1 != 0,
            0x1014 => true,
            _ => (0x1800..0x1A00).contains(&index) && sub == 1,
        };
        let given = self.before.keys().filter(sends).map(|&(index, sub)| self.number(index, sub));
        predefined.chain(given.map(CobId::from_parameter)).collect()
    }

    /// Runs a case, again if it may have failed without the device being wrong; and why the test ends with it.
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
        // The report of the whole test says what stays as it is.
        notes.extend(if self.gone.is_some() { self.left() } else { self.put_back() });
        (CaseReport { case, outcome, took, frames, known, expected, measured, notes }, end)
    }

    /// Whether a case fails. It is run now if it was not yet.
    fn has_failed(&mut self, id: &'static str) -> bool {
        if let Some(failed) = self.failed.get(id) {
            return *failed;
        }
        let failed =
            cases().find(|case| case.id == id).is_some_and(|case| matches!(self.once(case).0, Err(Verdict::Failed(_))));
        self.failed.insert(id, failed);
        failed
    }

    /// Runs a case, and has the device answer at its node-ID again: the outcome, and the frames of the case.
    fn once(&mut self, case: &'static Case) -> (Outcome, Vec<Record>) {
        let outcome = self.tester.run(case);
        let frames = self.tester.frames().to_vec();
        if self.has_ordered(case) {
            self.moving = self.undo(|suite| make_safe(&mut suite.tester).err());
        }
        self.undo(|suite| lss::put_back(&mut suite.tester));
        let written = self.tester.written();
        self.stores |= written.iter().any(|&(index, _)| index == 0x1010);
        // What was not known before is nothing to be put back.
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

    /// Whether the device answers, and if not, whether it does so again within some time.
    fn looks_for_device(&mut self, within: Duration) -> Presence {
        let (until, mut presence) = (self.tester.now() + within, Presence::Here);
        // In STOPPED a device does not answer SDO, though it is there.
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

    /// What no longer serves SDO may still obey a reset: of the node, or of its communication alone.
    fn is_back_by_reset(&mut self) -> Result<NmtCommand, Ended> {
        for command in [NmtCommand::ResetNode, NmtCommand::ResetCommunication] {
            self.tester.limit(STEP);
            // In STOPPED, what does not obey a reset serves no SDO. Whether it has booted is not asked: it answers.
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

    /// Of a device that is gone: the verdict on a case, unless it is there again. It is looked for once in each chapter.
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

    /// Undoes what cases have done, also after Ctrl-C.
    fn undo<T>(&mut self, work: impl FnOnce(&mut Self) -> T) -> T {
        uncancelled(self.cancelled, || {
            self.tester.limit(STEP);
            work(self)
        })
    }

    /// Brings back what was there before the test, if a reset does not: a sentence for each thing that is not known to be as
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

    /// What may not have its old value: a sentence for each entry.
    fn left(&self) -> Vec<String> {
        let was = |&(index, sub): &(u16, u8)| {
            let before = self.tester.shown((index, sub), &self.before[&(index, sub)]);
            format!("{index:04X}:{sub:02X} could not be put back to {before}")
        };
        self.changed.iter().map(was).collect()
    }

    /// What has become of the device by the test, beside entries that are not as they were.
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
            // What has been stored comes back with each reset.
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
            // Whether it was taken is read.
            let _: Outcome<Result<(), AbortCode>> = self.tester.write_back(&entry, bytes);
        }
    }
}
