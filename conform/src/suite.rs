//! A whole test: which cases, in which order, and what is left of them in the device.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::{AtomicBool, Ordering};

use lexican_eds::model::Entry;
use lexican_runtime::host::Link;
use lexican_runtime::wire::nmt::NmtCommand;
use lexican_runtime::{AbortCode, CobId, Duration};

use crate::case::{Case, Outcome, Verdict};
use crate::tester::{Record, Settings, Sheet, Tester};

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
    /// What has happened beside it: the device was away and the case was run again, or something could not be put back.
    pub notes: Vec<String>,
}

/// What a test has led to.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// The cases that were run, in their order.
    pub cases: Vec<CaseReport>,
    /// Why the test ended before its last case.
    pub ended_early: Option<String>,
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
/// A data sheet of which [nothing correct can be made](Sheet::is_unfit) ends the test before it begins.
pub fn run(
    link: &mut dyn Link,
    sheet: &Sheet,
    settings: &Settings,
    cases: &[&'static Case],
    cancelled: &AtomicBool,
    observer: &mut dyn Observer,
) -> Report {
    let mut report = Report::default();
    if sheet.is_unfit {
        report.ended_early = Some(format!("by this data sheet no device can be tested:\n{}", sheet.findings));
        return report;
    }
    let mut suite = Suite { tester: Tester::new(link, sheet, settings, cancelled), cancelled, before: BTreeMap::new() };
    if let Err(verdict) = suite.prepare() {
        report.ended_early = Some(verdict.to_string());
        return report;
    }
    for (number, case) in (1..).zip(cases) {
        observer.begins(number, cases.len(), case);
        let ended = suite.run(case);
        observer.ended(&ended);
        let unfinished = match &ended.outcome {
            Err(unfinished @ Verdict::Unfinished(_)) => Some(unfinished.to_string()),
            _ => None,
        };
        report.cases.push(ended);
        if unfinished.is_some() {
            report.ended_early = unfinished;
            break;
        }
    }
    report
}

/// From the communication parameter of a PDO to its mapping.
const MAPPING: u16 = 0x200;

/// In the COB-ID of a PDO: it does not exist.
const NOT_VALID: u32 = 1 << 31;

/// Written by the cases, and what was there before.
type Before = BTreeMap<(u16, u8), Vec<u8>>;

struct Suite<'a> {
    tester: Tester<'a>,
    cancelled: &'a AtomicBool,
    before: Before,
}

impl Suite<'_> {
    /// Looks at what the cases might change, while nothing has been changed.
    fn prepare(&mut self) -> Outcome {
        let heard = self.tester.hear(OTHERS)?;
        if self.tester.upload(0x1000, 0).is_err() {
            let node = self.tester.node;
            return Err(Verdict::Unfinished(format!(
                "node {node} does not answer: is it switched on, and is the bit rate right?"
            )));
        }
        // The error history is what happened, and nothing to be put back.
        let kept = |entry: &Entry| entry.access.readable() && entry.access.writable() && entry.index != 0x1003;
        let writable = self.tester.entries(kept);
        for entry in writable {
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

    fn run(&mut self, case: &'static Case) -> CaseReport {
        let begun = self.tester.now();
        let mut notes = Vec::new();
        let mut outcome = self.tester.run(case);
        let mut frames = self.tester.frames().to_vec();
        let mut written = self.tester.written();
        if matches!(outcome, Err(Verdict::Failed(_))) && self.was_away() {
            notes.push("the device was away, and the case was run again".to_owned());
            outcome = self.tester.run(case);
            frames = self.tester.frames().to_vec();
            written.extend(self.tester.written());
        }
        let took = self.tester.now().since(begun);
        // Also after Ctrl-C.
        let cancelled = self.cancelled.swap(false, Ordering::Relaxed);
        notes.extend(self.put_back(&written));
        self.cancelled.fetch_or(cancelled, Ordering::Relaxed);
        CaseReport { case, outcome, took, frames, notes }
    }

    /// Whether the device did not answer any more, and does so again in the time that it may take to boot.
    fn was_away(&mut self) -> bool {
        let until = self.tester.now() + self.tester.settings.boot;
        let mut silent = false;
        while self.tester.now() < until {
            if self.tester.upload(0x1000, 0).is_ok() {
                return silent;
            }
            silent = true;
        }
        false
    }

    /// Brings back what was there before the test, if a reset does not: a sentence for each entry that stays different.
    fn put_back(&mut self, written: &[(u16, u8)]) -> Vec<String> {
        let stores = written.iter().any(|&(index, _)| index == 0x1010);
        if written.is_empty() || self.tester.reset(NmtCommand::ResetNode).is_err() {
            return Vec::new();
        }
        let mut changed: Vec<_> = written.iter().copied().filter(|&at| self.differs(at)).collect();
        // A PDO is changed while it does not exist, and its mapping while it has no entries.
        let pdos: BTreeSet<u16> = changed.iter().filter_map(|&(index, _)| pdo_parameter(index)).collect();
        let frames: Vec<_> = pdos.iter().flat_map(|&index| [(index + MAPPING, 0), (index, 1)]).collect();
        for &index in &pdos {
            let _ = self.tester.try_write(index, 1, self.number(index, 1) | NOT_VALID);
            let _ = self.tester.try_write(index + MAPPING, 0, 0);
        }
        changed.retain(|at| !frames.contains(at));
        changed.extend(frames);
        for &at in &changed {
            self.write_back(at);
        }
        if stores && !changed.is_empty() {
            // What has been stored comes back with each reset.
            let _ = self.tester.try_write(0x1010, 1, u32::from_le_bytes(*b"save"));
        }
        changed.retain(|&at| self.differs(at));
        let was = |&(index, sub): &(u16, u8)| {
            format!("{index:04X}:{sub:02X} could not be put back to {:02X?}", self.before[&(index, sub)])
        };
        changed.iter().map(was).collect()
    }

    fn number(&self, index: u16, sub: u8) -> u32 {
        let bytes = self.before.get(&(index, sub)).map_or(&[][..], |bytes| bytes);
        bytes.iter().rev().fold(0, |number, byte| number << 8 | u32::from(*byte))
    }

    fn differs(&mut self, at: (u16, u8)) -> bool {
        let Some(before) = self.before.get(&at) else { return false };
        matches!(self.tester.upload(at.0, at.1), Ok(Ok(now)) if now != *before)
    }

    fn write_back(&mut self, at: (u16, u8)) {
        if let (Some(bytes), Ok(entry)) = (self.before.get(&at), self.tester.entry(at.0, at.1)) {
            // Whether it was taken is read.
            let _: Outcome<Result<(), AbortCode>> = self.tester.write_back(&entry, bytes);
        }
    }
}

/// The communication parameter of the PDO that an object belongs to.
fn pdo_parameter(index: u16) -> Option<u16> {
    matches!(index, 0x1400..=0x1BFF).then_some(index & !MAPPING)
}
