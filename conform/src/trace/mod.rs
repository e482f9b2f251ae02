//! Traces: frames of a manual with conditions, to try with a device.
//!
//! A CSV file with a row for each frame. The columns `cob_id` and `data` are hexadecimal; `chapter`, `direction`,
//! `meaning` and `condition` are optional; other columns are ignored.

mod ask;
mod step;

use std::sync::atomic::AtomicBool;

use lexican_runtime::Duration;
use lexican_runtime::host::Link;
use lexican_runtime::wire::nmt::NmtCommand;
use serde::Serialize;
use serde_json::{Value, json};

use crate::axis::make_safe;
use crate::case::Case;
use crate::hazard::Hazard;
use crate::sheet::Sheet;
use crate::suite::{CaseReport, Report, STEP};
use crate::tester::{Record, Settings, Tester, uncancelled};
use crate::verdict::{Ended, Level, Outcome, Verdict, not_applicable};

pub use ask::{Asked, StepReport, ask};
use step::Condition;
pub use step::Step;

/// The steps of a file, in its order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Trace(Vec<Step>);

/// The result of a trace.
#[derive(Clone, Debug, Default)]
pub struct TraceReport {
    /// The chapters of the file, in its order.
    pub chapters: Vec<ChapterReport>,
    /// Why the test ended before its last chapter.
    pub ended_early: Option<Ended>,
    /// How long the test took.
    pub took: Duration,
}

/// The result of a chapter, which ends at the first step that fails.
#[derive(Clone, Debug)]
pub struct ChapterReport {
    /// Its name, empty in a file without chapters.
    pub chapter: String,
    /// The steps that were carried out.
    pub steps: Vec<StepReport>,
    /// All frames during the chapter.
    pub frames: Vec<Record>,
    /// How long it took.
    pub took: Duration,
    /// What came of it.
    pub outcome: Outcome,
}

/// The requirement of a chapter.
const REQUIREMENT: &str = "The device answers the frames of the trace by those that it has, in their time.";

/// A row for writing a trace.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Row {
    /// In hexadecimal.
    pub cob_id: String,
    /// `send` or `expect`.
    pub direction: &'static str,
    /// Bytes in hexadecimal, with `x` for digits that are not compared, or `R8` for a remote frame.
    pub data: String,
    /// Conditions, separated by semicolons.
    pub condition: String,
    /// Its meaning, in words.
    pub meaning: String,
    /// Its source, such as the line of a log.
    pub source: String,
}

impl Trace {
    /// Reads a file; `name` is used in messages.
    pub fn parse(name: &str, text: &str) -> Result<Self, String> {
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        let wrong = |error: csv::Error| format!("{name}: {error}");
        let columns = reader.headers().map_err(wrong)?.clone();
        if let Some(missing) = ["cob_id", "data"].iter().find(|column| columns.iter().all(|other| other != **column)) {
            return Err(format!("{name}:1: there is no column {missing}; a trace has cob_id and data at least"));
        }
        let mut steps = Vec::new();
        for record in reader.records() {
            let record = record.map_err(wrong)?;
            let line = record.position().map_or(0, csv::Position::line);
            let cell = |column: &str| {
                let at = columns.iter().position(|other| other == column);
                at.and_then(|at| record.get(at)).unwrap_or_default().trim()
            };
            let step = Step::parse(line, cell)
                .map_err(|(column, why)| format!("{name}:{line}: column {column}: {:?} {why}", cell(column)))?;
            steps.push(step);
        }
        if steps.is_empty() { Err(format!("{name}: it has no frames")) } else { Ok(Trace(steps)) }
    }

    /// The text of a file with these rows.
    pub fn csv(rows: &[Row]) -> Result<String, String> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        rows.iter().try_for_each(|row| writer.serialize(row)).map_err(|error| error.to_string())?;
        let text = writer.into_inner().map_err(|error| error.to_string())?;
        String::from_utf8(text).map_err(|error| error.to_string())
    }

    fn chapters(&self) -> impl Iterator<Item = &[Step]> {
        self.0.chunk_by(|a, b| a.chapter == b.chapter)
    }
}

/// Tries the frames of a trace with a device, each chapter after a reset. A chapter is carried out only if all that it
/// does is allowed, and all its frames belong to this device.
///
/// A drive is disabled after each chapter, even after Ctrl-C, and the device is reset at the end, which undoes what the
/// trace has written without storing.
pub fn run_trace(
    link: &mut dyn Link,
    sheet: &Sheet,
    settings: &Settings,
    trace: &Trace,
    cancelled: &AtomicBool,
) -> TraceReport {
    let mut report = TraceReport::default();
    if sheet.is_unfit {
        report.ended_early = Some(Ended::Unfit(sheet.findings.clone()));
        return report;
    }
    let mut tester = Tester::new(link, sheet, settings, cancelled);
    let test_begun = tester.now();
    let mut has_sent = false;
    for steps in trace.chapters() {
        let (begun, mut done) = (tester.now(), Vec::new());
        tester.begin();
        let outcome = is_for(steps, sheet, settings).and_then(|()| {
            has_sent = true;
            let outcome = chapter(&mut tester, steps, &mut done);
            tester.decided(outcome)
        });
        if let (Err(verdict), Some(step)) = (&outcome, done.last_mut())
            && step.outcome.is_err()
        {
            step.outcome = Err(verdict.clone());
        }
        let moves = steps.iter().any(|step| step.hazard(sheet) == Some(Hazard::Motion));
        if moves && !done.is_empty() {
            report.ended_early = uncancelled(cancelled, || {
                tester.limit(STEP);
                make_safe(&mut tester).err().map(Ended::Moving)
            });
        }
        if let (Err(Verdict::Unfinished(ended)), None) = (&outcome, &report.ended_early) {
            report.ended_early = Some(ended.clone());
        }
        let name = steps.first().map(|step| step.chapter.clone()).unwrap_or_default();
        let (frames, took) = (tester.frames().to_vec(), tester.now().since(begun));
        report.chapters.push(ChapterReport { chapter: name, steps: done, frames, took, outcome });
        if report.ended_early.is_some() {
            break;
        }
    }
    if has_sent && !matches!(report.ended_early, Some(Ended::BusLost(_))) {
        // A device that does not boot again is noticed by the next test.
        let _ = uncancelled(cancelled, || {
            tester.limit(STEP);
            tester.reset(NmtCommand::ResetNode)
        });
    }
    report.took = tester.now().since(test_begun);
    report
}

/// Checks that a chapter can be carried out and is allowed.
fn is_for(steps: &[Step], sheet: &Sheet, settings: &Settings) -> Outcome {
    for step in steps {
        let place = step.place();
        if let Some(node) = step.other_node(settings.node) {
            let (of, tested) = (if node == 0 { "all nodes".into() } else { format!("node {node}") }, settings.node);
            return Err(not_applicable(format!("{place}: {} is of {of}, and node {tested} is tested", step.printed())));
        }
        for condition in &step.conditions {
            if let Condition::World(word) = condition {
                return Err(not_applicable(format!("{place}: no frame brings about {word:?}")));
            }
        }
    }
    let missing = steps.iter().find_map(|step| step.hazard(sheet).filter(|hazard| !settings.allow.contains(hazard)));
    missing.map_or(Ok(()), |hazard| Err(Verdict::NotAllowed(hazard)))
}

fn chapter(t: &mut Tester<'_>, steps: &[Step], done: &mut Vec<StepReport>) -> Outcome {
    let answer = t.settings.answer;
    let spans = steps.iter().fold(STEP, |sum, step| sum + step.span(answer));
    t.limit(spans);
    t.reset(NmtCommand::ResetNode)?;
    *done = ask(t, steps, answer, false);
    done.iter().find_map(|step| step.outcome.clone().err()).map_or(Ok(()), Err)
}

impl TraceReport {
    /// As a report of cases, one for each chapter.
    #[must_use]
    pub fn report(&self) -> Report {
        let case = |(number, chapter): (usize, &ChapterReport)| CaseReport {
            case: Case::judged_elsewhere(format!("trace/{number}"), chapter.chapter.clone(), REQUIREMENT, Level::Must),
            outcome: chapter.outcome.clone(),
            took: chapter.took,
            frames: chapter.frames.clone(),
            known: None,
            expected: Vec::new(),
            measured: Vec::new(),
            notes: Vec::new(),
        };
        let cases = (1..).zip(&self.chapters).map(case).collect();
        Report { cases, ended_early: self.ended_early.clone(), took: self.took, ..Report::default() }
    }

    /// How many chapters have passed; failed or not finished; and were not carried out.
    #[must_use]
    pub fn tally(&self) -> (usize, usize, usize) {
        let (mut passed, mut failed, mut left_out) = (0, 0, 0);
        for chapter in &self.chapters {
            *match &chapter.outcome {
                Ok(()) => &mut passed,
                Err(Verdict::NotApplicable(_) | Verdict::NotAllowed(_)) => &mut left_out,
                Err(_) => &mut failed,
            } += 1;
        }
        (passed, failed, left_out)
    }
}

impl ChapterReport {
    /// `passed`, or the verdict with its reason.
    #[must_use]
    pub fn verdict(&self) -> String {
        verdict(&self.outcome)
    }

    /// As one JSON object: `"event": "chapter"`, the verdict, and the steps.
    #[must_use]
    pub fn json(&self) -> Value {
        let steps = self.steps.iter().map(|step| {
            json!({ "line": step.line, "source": step.source, "sent": step.is_sent, "printed": step.printed, "meaning": step.meaning,
                "seen": step.seen.map(|frame| frame.to_string()), "seconds": step.at.as_secs_f64(),
                "verdict": verdict(&step.outcome) })
        });
        let steps: Vec<Value> = steps.collect();
        json!({ "event": "chapter", "chapter": self.chapter, "verdict": self.verdict(), "steps": steps })
    }
}

fn verdict(outcome: &Outcome) -> String {
    outcome.as_ref().err().map_or("passed".to_owned(), Verdict::to_string)
}
