//! Reports in files: JSON, JUnit's XML, and one HTML page.

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

/// So many cases are named that one blocks.
const BLOCKED: usize = 8;
/// So many frames before its end are shown of a case that fails.
const EXCERPT: usize = 12;

/// What was tested, for the head of a report.
#[derive(Clone, Debug, Default, Serialize)]
pub struct About {
    /// The device.
    pub device: String,
    /// Its node-ID.
    pub node: u8,
    /// The file of its data sheet.
    pub data_sheet: String,
    /// What else a reader has to know: a name and a text each, such as the date, the versions and the bus. The report adds
    /// what the device says that it is, and how long the test took.
    pub facts: Vec<(String, String)>,
    /// Who has tested; empty to be filled in on paper.
    pub tester: String,
    /// The tester's remarks.
    pub remarks: Vec<String>,
}

/// A report, with every frame in words.
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
    /// Of the whole test.
    overall: &'static str,
    #[serde(flatten)]
    tally: Tally,
    /// Why the test ended before its last case.
    ended_early: Option<String>,
    /// Cases that others are blocked by, a sentence for each.
    root_causes: Vec<String>,
    /// What is not as it was before the test.
    not_put_back: Vec<String>,
    /// What has become of the device beside that.
    findings: Vec<String>,
}

/// How many cases have which verdict.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Tally {
    /// Passed.
    pub passed: usize,
    /// Failed, of what the standards require.
    pub failed: usize,
    /// Failed, of what the standards recommend.
    pub advised: usize,
    /// Failed, as the device is [known](crate::Settings::known) to.
    pub known: usize,
    /// The device lacks what they are about.
    pub not_applicable: usize,
    /// Not run: what they do was not allowed.
    pub not_allowed: usize,
    /// What they need is a case of its own, and fails.
    pub blocked: usize,
    /// This computer was too late to judge the device.
    pub not_decidable: usize,
    /// Cancelled, or the bus is gone.
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
    /// As candump writes it.
    frame: String,
    words: String,
}

impl CaseReport {
    /// The case as one JSON object without its frames: `"event": "case"`, and what a [`Document`] has of it.
    #[must_use]
    pub fn json(&self) -> Value {
        let mut case = event("case", Row::new(self, Vec::new()));
        case.as_object_mut().map(|case| case.remove("frames"));
        case
    }

    /// What a text says below the verdict and its reason, a line each: why it is known to fail, notes, and the last frames as candump
    /// writes them and in `words`; no frames of what is known, or blocked by another case.
    pub fn lines(&self, mut words: impl FnMut(&Frame) -> String) -> Vec<String> {
        let known = self.known.iter().map(|why| format!("known: {why}"));
        let mut lines: Vec<_> = known.chain(self.notes.iter().map(|note| format!("note: {note}"))).collect();
        if self.known.is_none() && !matches!(self.outcome, Err(Verdict::Blocked(..))) {
            let line = |record: &Record| {
                let (at, way) = (record.at.as_micros(), if record.sent { ">" } else { "<" });
                let (frame, words) = (record.frame.to_string(), words(&record.frame));
                format!("({}.{:06}) {way} {frame:<21} {words}", at / 1_000_000, at % 1_000_000)
            };
            // All are given words, since one may depend on those before.
            let frames: Vec<_> = self.frames.iter().map(line).collect();
            lines.extend(frames.into_iter().rev().take(EXCERPT).rev());
        }
        lines
    }

    /// One word or two: `passed`, `failed`, `advised` (failed, of what is recommended), `known` (failed, as it is known to),
    /// `not applicable`, `not allowed`, `blocked`, `not decidable`,
    /// `unfinished`.
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
    /// The sum as one JSON object: `"event": "summary"`, and what a [`Document`] has of it.
    #[must_use]
    pub fn json(&self) -> Value {
        event("summary", Sum::new(self))
    }

    /// The verdict on the device: `failed`, if a case did that a standard requires, or was blocked; else `incomplete`, if the
    /// test did not come to its end, could not decide a case or left something changed; else `passed`.
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

    /// How many cases have which verdict.
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

    /// The cases that others are blocked by, the one that blocks most first: a sentence for each.
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

    /// The report with its frames in words; `words` gets the frames of each case from its first one on.
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

/// An object for one line.
fn event(event: &str, content: impl Serialize) -> Value {
    let mut object = serde_json::to_value(content).expect("texts and numbers are JSON");
    object["event"] = event.into();
    object
}

impl Document {
    /// Compares with an earlier test, whose report has this name; the differences become part of the report.
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
