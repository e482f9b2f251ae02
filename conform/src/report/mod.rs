//! Reports as files: JSON, JUnit XML, and one HTML page.

mod against;
mod html;
mod junit;

pub use against::{Differences, Earlier};

use std::cmp::Reverse;
use std::collections::BTreeMap;

use lexican_runtime::{Frame, Instant};
use serde::Serialize;
use serde_json::Value;

use crate::cases::{cases, profile_cases};
use crate::suite::{CaseReport, Report};
use crate::tester::Record;
use crate::verdict::{Level, Verdict};

/// How many blocked cases are named for one that blocks them.
const BLOCKED: usize = 8;
/// How many frames before its end are shown of a failed case.
const EXCERPT: usize = 12;

/// The head of a report.
#[derive(Clone, Debug, Default, Serialize)]
pub struct About {
    /// The device.
    pub device: String,
    /// Its node-ID.
    pub node: u8,
    /// The file of its data sheet.
    pub data_sheet: String,
    /// Further facts, each a name and a text, such as the date, the versions and the bus. The report adds the identity
    /// of the device, and the duration of the test.
    pub facts: Vec<(String, String)>,
    /// The name of the tester; empty to be filled in on paper.
    pub tester: String,
    /// The tester's remarks.
    pub remarks: Vec<String>,
}

/// A report with all frames in words.
#[derive(Clone, Debug, Serialize)]
pub struct Document {
    #[serde(flatten)]
    about: About,
    #[serde(flatten)]
    sum: Sum,
    #[serde(skip_serializing_if = "Option::is_none")]
    against: Option<Differences>,
    cases: Vec<Row>,
}

#[derive(Clone, Debug, Serialize)]
struct Sum {
    /// The verdict of the whole test.
    overall: &'static str,
    #[serde(flatten)]
    tally: Tally,
    /// Why the test ended before its last case.
    ended_early: Option<String>,
    /// A sentence for each case that blocks others.
    root_causes: Vec<String>,
    /// A sentence for each entry that could not be put back.
    not_put_back: Vec<String>,
    /// Other effects on the device that remain.
    findings: Vec<String>,
}

/// The number of cases for each verdict.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Tally {
    /// Passed.
    pub passed: usize,
    /// Failed a requirement of a standard.
    pub failed: usize,
    /// Failed a recommendation of a standard.
    pub advised: usize,
    /// Failed as the device is [known](crate::Settings::known) to.
    pub known: usize,
    /// Not applicable, since the device lacks the feature.
    pub not_applicable: usize,
    /// Not run, since a hazard was not allowed.
    pub not_allowed: usize,
    /// Blocked: a step failed that is a case of its own, which fails too.
    pub blocked: usize,
    /// This computer was too late to judge.
    pub not_decidable: usize,
    /// Cancelled, or the bus was lost.
    pub unfinished: usize,
}

#[derive(Clone, Debug, Serialize)]
struct Row {
    id: &'static str,
    #[serde(skip_serializing_if = "str::is_empty")]
    plan: &'static str,
    title: &'static str,
    clause: String,
    requirement: &'static str,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    expected: Vec<String>,
    level: &'static str,
    verdict: &'static str,
    #[serde(skip_serializing_if = "String::is_empty")]
    reason: String,
    seconds: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    known: Option<String>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    measured: Vec<String>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    notes: Vec<String>,
    frames: Vec<Line>,
}

#[derive(Clone, Debug, Serialize)]
struct Line {
    /// Since the case began.
    seconds: f64,
    sent: bool,
    /// In the format of candump.
    frame: String,
    words: String,
}

impl CaseReport {
    /// The case as one JSON object: `"event": "case"`, and its data in a [`Document`] without the frames.
    #[must_use]
    pub fn json(&self) -> Value {
        let mut case = event("case", Row::new(self, Vec::new()));
        case.as_object_mut().map(|case| case.remove("frames"));
        case
    }

    /// The lines below verdict and reason in a text: why the failure is known, notes, and the last frames in the format
    /// of candump and in `words`. Known failures and blocked cases have no frames.
    pub fn lines(&self, mut words: impl FnMut(&Frame) -> String) -> Vec<String> {
        let known = self.known.iter().map(|why| format!("known: {why}"));
        let mut lines: Vec<_> = known.chain(self.notes.iter().map(|note| format!("note: {note}"))).collect();
        if self.known.is_none() && !matches!(self.outcome, Err(Verdict::Blocked(..))) {
            let line = |record: &Record| {
                let (at, way) = (record.at.as_micros(), if record.sent { ">" } else { "<" });
                let (frame, words) = (record.frame.to_string(), words(&record.frame));
                format!("({}.{:06}) {way} {frame:<21} {words}", at / 1_000_000, at % 1_000_000)
            };
            // `words` gets all frames, since later ones may depend on earlier ones.
            let frames: Vec<_> = self.frames.iter().map(line).collect();
            lines.extend(frames.into_iter().rev().take(EXCERPT).rev());
        }
        lines
    }

    /// `passed`, `failed`, `advised` (failed a recommendation), `known` (failed as known), `not applicable`,
    /// `not allowed`, `blocked`, `not decidable` or `unfinished`.
    #[must_use]
    pub const fn verdict(&self) -> &'static str {
        match (&self.outcome, self.case.level) {
            (Ok(()), _) => "passed",
            (Err(Verdict::Failed(_)), _) if self.known.is_some() => "known",
            (Err(Verdict::Failed(_)), Level::Must) => "failed",
            (Err(Verdict::Failed(_)), Level::Should) => "advised",
            (Err(Verdict::NotApplicable(_)), _) => "not applicable",
            (Err(Verdict::NotAllowed(_)), _) => "not allowed",
            (Err(Verdict::Blocked(..)), _) => "blocked",
            (Err(Verdict::NotDecidable(_)), _) => "not decidable",
            (Err(Verdict::Unfinished(_)), _) => "unfinished",
        }
    }
}

impl Report {
    /// The summary as one JSON object: `"event": "summary"`, and its data in a [`Document`].
    #[must_use]
    pub fn json(&self) -> Value {
        event("summary", Sum::new(self))
    }

    /// The verdict on the device: `failed` if a case failed a requirement or was blocked; else `incomplete` if the test
    /// did not reach its end, could not decide a case or left something changed; else `passed`.
    #[must_use]
    pub fn overall(&self) -> &'static str {
        let tally = self.tally();
        let is_whole = self.ended_early.is_none() && self.not_put_back.is_empty();
        match tally {
            _ if tally.failed + tally.blocked > 0 => "failed",
            _ if !is_whole || tally.unfinished + tally.not_decidable > 0 || tally.passed == 0 => "incomplete",
            _ => "passed",
        }
    }

    /// The number of cases for each verdict.
    #[must_use]
    pub fn tally(&self) -> Tally {
        let mut tally = Tally::default();
        for case in &self.cases {
            *match case.verdict() {
                "passed" => &mut tally.passed,
                "failed" => &mut tally.failed,
                "advised" => &mut tally.advised,
                "known" => &mut tally.known,
                "not applicable" => &mut tally.not_applicable,
                "not allowed" => &mut tally.not_allowed,
                "blocked" => &mut tally.blocked,
                "not decidable" => &mut tally.not_decidable,
                _ => &mut tally.unfinished,
            } += 1;
        }
        tally
    }

    /// A sentence for each case that blocks others, the one that blocks most first.
    #[must_use]
    pub fn root_causes(&self) -> Vec<String> {
        let mut blocks: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
        for report in &self.cases {
            if let Err(Verdict::Blocked(by, _)) = &report.outcome {
                blocks.entry(by).or_default().push(report.case.id);
            }
        }
        let mut blocks: Vec<_> = blocks.into_iter().collect();
        blocks.sort_by_key(|(_, blocked)| Reverse(blocked.len()));
        let title = |id| cases().chain(profile_cases()).find(|case| case.id == id).map_or("", |case| case.title);
        let named = |blocked: &[&str]| match blocked.len().saturating_sub(BLOCKED) {
            0 => blocked.join(", "),
            more => format!("{} and {more} more", blocked[..BLOCKED].join(", ")),
        };
        blocks.into_iter().map(|(id, blocked)| format!("{id} {}: blocks {}", title(id), named(&blocked))).collect()
    }

    /// The report with frames in words; `words` gets the frames of each case from the first one on.
    pub fn document(&self, mut about: About, mut words: impl FnMut(&Frame) -> String) -> Document {
        let row = |report: &CaseReport| {
            let begun = report.frames.first().map_or(Instant::ZERO, |record| record.at);
            let frames = report.frames.iter().map(|record| Line {
                seconds: seconds(record.at.since(begun)),
                sent: record.sent,
                frame: record.frame.to_string(),
                words: words(&record.frame),
            });
            Row::new(report, frames.collect())
        };
        let cases = self.cases.iter().map(row).collect();
        about.facts.push(("duration".to_owned(), format!("{:.1} s", seconds(self.took))));
        about.facts.extend(self.identity.iter().cloned());
        Document { about, sum: Sum::new(self), against: None, cases }
    }
}

impl Sum {
    fn new(report: &Report) -> Self {
        let ended_early = report.ended_early.as_ref().map(ToString::to_string);
        let (root_causes, not_put_back) = (report.root_causes(), report.not_put_back.clone());
        Sum {
            overall: report.overall(),
            tally: report.tally(),
            ended_early,
            root_causes,
            not_put_back,
            findings: report.findings.clone(),
        }
    }
}

impl Row {
    fn new(report: &CaseReport, frames: Vec<Line>) -> Self {
        Row {
            id: report.case.id,
            plan: report.case.plan,
            title: report.case.title,
            clause: report.case.clause(),
            requirement: report.case.requirement,
            expected: report.expected.clone(),
            level: if report.case.level == Level::Must { "must" } else { "should" },
            verdict: report.verdict(),
            reason: report.outcome.as_ref().err().map(Verdict::reason).unwrap_or_default(),
            seconds: seconds(report.took),
            known: report.known.clone(),
            measured: report.measured.clone(),
            notes: report.notes.clone(),
            frames,
        }
    }
}

/// A JSON object for one line.
fn event(event: &str, content: impl Serialize) -> Value {
    let mut object = serde_json::to_value(content).expect("texts and numbers are JSON");
    object["event"] = event.into();
    object
}

impl Document {
    /// Compares with an earlier test, whose report has the name `with`; the differences become part of the report.
    pub fn compare(&mut self, with: &str, earlier: &Earlier) -> &Differences {
        let differences = earlier.compare(with, self.cases.iter().map(|row| (row.id, row.title, row.verdict)));
        self.against.insert(differences)
    }

    /// As one JSON object.
    ///
    /// # Panics
    ///
    /// Never: texts and numbers can always be written.
    #[must_use]
    pub fn json(&self) -> String {
        serde_json::to_string_pretty(self).expect("texts and numbers are JSON")
    }
}

fn seconds(span: lexican_runtime::Duration) -> f64 {
    span.as_micros() as f64 / 1e6
}
