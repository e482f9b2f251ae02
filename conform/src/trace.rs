//! Traces: frames of a manual with conditions, asked of a device.
//!
//! A CSV file with a row for each frame. The columns `cob_id` and `data` are hexadecimal, `chapter`, `direction`, `meaning`
//! and `condition` may be left out, others are not looked at.

use std::sync::atomic::AtomicBool;

use lexican_runtime::cia301::connection;
use lexican_runtime::host::Link;
use lexican_runtime::wire::nmt::NmtCommand;
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};
use serde_json::{Value, json};

use crate::axis::make_safe;
use crate::hazard::Hazard;
use crate::sheet::Sheet;
use crate::suite::STEP;
use crate::tester::{Heard, PATIENCE, Settings, Tester, uncancelled};
use crate::verdict::{Ended, Outcome, Verdict, failed, not_applicable};

/// How long `until` waits where it names no time: the slowest travel of a manual's example.
const LONGEST: Duration = Duration::from_secs(120);

/// How often a question is asked again.
const AGAIN: Duration = Duration::from_millis(50);

/// The frames of a file, in its order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Trace(Vec<Step>);

/// A row of the file.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Step {
    line: u64,
    chapter: String,
    meaning: String,
    is_sent: bool,
    id: Option<CobId>,
    data: Vec<u8>,
    /// The bits that count, for each byte.
    mask: Vec<u8>,
    conditions: Vec<Condition>,
}

#[derive(Clone, Debug, PartialEq, Eq)]
enum Condition {
    /// It is waited for so long, and a question before it is asked again.
    Until(Duration),
    /// The number that the data is may be 5 % from what is printed.
    About,
    /// It does not come earlier after what was sent last.
    NotBefore(Duration),
    /// It is sent so long after what was before it.
    After(Duration),
    /// About the world around the device, which no frame brings about.
    World(String),
}

/// What a trace has led to.
#[derive(Clone, Debug, Default)]
pub struct TraceReport {
    /// The chapters of the file, in its order.
    pub chapters: Vec<ChapterReport>,
    /// Why the test ended before its last chapter.
    pub ended_early: Option<Ended>,
}

/// What a chapter has led to. It ends at the first step that fails.
#[derive(Clone, Debug)]
pub struct ChapterReport {
    /// Its name, empty in a file without chapters.
    pub chapter: String,
    /// The steps that were carried out.
    pub steps: Vec<StepReport>,
    /// What came of it.
    pub outcome: Outcome,
}

/// What a step has led to.
#[derive(Clone, Debug)]
pub struct StepReport {
    /// The line of the file.
    pub line: u64,
    /// What the file says of it.
    pub meaning: String,
    /// Whether the tester sent it.
    pub is_sent: bool,
    /// The frame as the file has it, with `x` for digits that do not count.
    pub printed: String,
    /// What was sent, or what was heard with this identifier.
    pub seen: Option<Frame>,
    /// When, since the chapter began.
    pub at: Duration,
    /// What came of it.
    pub outcome: Outcome,
}

impl Trace {
    /// Reads a file; `name` is for messages.
    ///
    /// # Errors
    ///
    /// What is wrong, with file, line and column.
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

    fn chapters(&self) -> impl Iterator<Item = &[Step]> {
        self.0.chunk_by(|a, b| a.chapter == b.chapter)
    }
}

impl Step {
    /// A row; or the column that is wrong, and why.
    fn parse<'a>(line: u64, cell: impl Fn(&str) -> &'a str) -> Result<Self, (&'static str, &'static str)> {
        let id = match cell("cob_id") {
            "" => None,
            text => {
                let id = u32::from_str_radix(text, 16).ok();
                let id = id.and_then(|id| match text.len() {
                    8.. => CobId::extended(id),
                    _ => CobId::standard(u16::try_from(id).ok()?),
                });
                Some(id.ok_or(("cob_id", "is no identifier such as 605, or of eight digits such as 00000605"))?)
            }
        };
        let (mut data, mut mask) = (Vec::new(), Vec::new());
        for byte in cell("data").split_whitespace() {
            let digits: Vec<char> = byte.chars().collect();
            let digit = |digit: char| match digit {
                'x' | 'X' => Some((0, 0)),
                _ => digit.to_digit(16).map(|digit| (digit as u8, 0xF)),
            };
            let [Some(high), Some(low)] = [digits.first(), digits.get(1)].map(|found| digit(*found?)) else {
                return Err(("data", "is not made of bytes such as 4B, or xx for any"));
            };
            if digits.len() > 2 || data.len() == 8 {
                return Err(("data", "is not up to eight bytes of two digits each"));
            }
            data.push(high.0 << 4 | low.0);
            mask.push(high.1 << 4 | low.1);
        }
        let is_sent = match cell("direction") {
            "to drive" | "to device" | "send" => true,
            "from drive" | "from device" | "expect" => false,
            "" => !id.is_some_and(is_of_device),
            _ => return Err(("direction", "is none of send, expect, to device, from device")),
        };
        if is_sent && mask.iter().any(|mask| *mask != 0xFF) {
            return Err(("data", "is sent, and what is sent has no x"));
        }
        if is_sent && id.is_some_and(|id| is_at(id, connection::SDO_REQUEST)) {
            // An SDO has eight bytes.
            data.resize(8, 0);
            mask.resize(8, 0xFF);
        }
        let words = cell("condition").split(';').map(str::trim).filter(|word| !word.is_empty());
        let mut conditions: Vec<_> = words.map(Condition::parse).collect::<Result<_, _>>()?;
        if id.is_none() && !conditions.iter().any(|condition| matches!(condition, Condition::After(_))) {
            let meaning = if cell("meaning").is_empty() { "wait" } else { cell("meaning") };
            conditions.push(Condition::World(meaning.to_owned()));
        }
        let [chapter, meaning] = ["chapter", "meaning"].map(|column| cell(column).to_owned());
        Ok(Step { line, chapter, meaning, is_sent, id, data, mask, conditions })
    }

    fn printed(&self) -> String {
        let Some(id) = self.id else { return "wait".to_owned() };
        let digit = |value: u8, mask: u8| if mask == 0 { "x".to_owned() } else { format!("{value:X}") };
        let bytes = self.data.iter().zip(&self.mask);
        let bytes = bytes.map(|(byte, mask)| digit(byte >> 4, mask >> 4) + &digit(byte & 0xF, mask & 0xF));
        format!("{id}#{}", bytes.collect::<String>())
    }

    fn is_like(&self, frame: &Frame) -> bool {
        let masked = |data: &[u8]| data.iter().zip(&self.mask).map(|(byte, mask)| byte & mask).collect::<Vec<_>>();
        let (printed, found) = (masked(&self.data), masked(frame.data()));
        let number = |data: &[u8]| data.iter().rev().fold(0_i128, |number, byte| number << 8 | i128::from(*byte));
        let (a, b) = (number(&printed), number(&found));
        let near = self.conditions.contains(&Condition::About) && (a - b).abs() * 20 <= a;
        frame.data().len() == self.data.len() && !frame.is_remote() && (printed == found || near)
    }

    /// How long it may take.
    fn span(&self, settings: &Settings) -> Duration {
        let spans = self.conditions.iter().map(|condition| match condition {
            Condition::Until(span) | Condition::NotBefore(span) | Condition::After(span) => *span,
            Condition::About | Condition::World(_) => Duration::ZERO,
        });
        spans.fold(settings.answer, |sum, span| sum + span)
    }

    /// A read or SYNC, which can be repeated until the answer is as it is to be.
    fn is_question(&self) -> bool {
        let is_read =
            |id: CobId| is_at(id, connection::SDO_REQUEST) && self.data.first().is_some_and(|code| code >> 5 == 2);
        self.is_sent && self.id.is_some_and(|id| id == CobId::SYNC || is_read(id))
    }

    /// What sending it does that has to be allowed.
    fn hazard(&self, sheet: &Sheet) -> Option<Hazard> {
        let id = self.id.filter(|_| self.is_sent)?.raw();
        let orders = if sheet.device.profile == Some(402) { Hazard::Motion } else { Hazard::Outputs };
        let index = || Some(u16::from_le_bytes([*self.data.get(1)?, *self.data.get(2)?]));
        match id {
            // A start lets PDOs in.
            0x000 => (self.data.first() == Some(&NmtCommand::Start.code())).then_some(orders),
            0x080 | 0x100 => None,
            0x600..=0x67F => match self.data.first().map(|code| code >> 5) {
                // A download, or one of blocks.
                Some(1 | 6) => match index()? {
                    // A program stays.
                    0x1F50..=0x1F5F => Some(Hazard::Store),
                    index => Hazard::of_write(&sheet.device, index),
                },
                _ => None,
            },
            0x7E4 | 0x7E5 => Some(Hazard::NodeId),
            // An RPDO, wherever the device has it.
            _ => Some(orders),
        }
    }

    /// Another node that it is of, or for; 0 is all.
    fn other_node(&self, node: NodeId) -> Option<u8> {
        let id = self.id?.raw();
        let of = match id {
            0x000 => *self.data.get(1)?,
            0x081..=0x0FF | 0x181..=0x67F | 0x701..=0x77F => (id & 0x7F) as u8,
            _ => return None,
        };
        (of != node.get()).then_some(of)
    }
}

impl Condition {
    fn parse(word: &str) -> Result<Self, (&'static str, &'static str)> {
        let after = |name: &str| word.strip_prefix(name).map(|rest| time(rest.trim()));
        let wrong = ("condition", "has no time such as 500ms, 2s or 1min, up to an hour");
        if let Some(span) = after("not before ") {
            return Ok(Condition::NotBefore(span.ok_or(wrong)?));
        }
        if let Some(span) = after("until ") {
            return Ok(Condition::Until(span.ok_or(wrong)?));
        }
        if let Some(span) = after("after ") {
            return Ok(Condition::After(span.ok_or(wrong)?));
        }
        Ok(match word {
            "until" => Condition::Until(LONGEST),
            "about" => Condition::About,
            other => Condition::World(other.to_owned()),
        })
    }
}

/// `500ms`, `2s`, `1min`, of whole numbers.
fn time(text: &str) -> Option<Duration> {
    let units = [("ms", 1), ("s", 1000), ("min", 60_000)];
    let ms = units
        .iter()
        .find_map(|(unit, factor)| text.strip_suffix(unit)?.trim().parse::<u64>().ok()?.checked_mul(*factor));
    ms.filter(|ms| *ms <= 3_600_000).map(Duration::from_millis)
}

/// Whether it is of this kind in the predefined connection set, whatever node it is of.
fn is_at(id: CobId, base: u16) -> bool {
    id.raw() & !0x7F == u32::from(base)
}

/// Whether devices send frames with this identifier, by the predefined connection set.
fn is_of_device(id: CobId) -> bool {
    let id = id.raw();
    (0x81..0x780).contains(&id) && (id >> 7 & 1 == 1 || id >= 0x700) || id == 0x7E4
}

/// Asks a device by the frames of a trace: each chapter after a reset. A chapter is carried out only if all that it does is
/// allowed, and every frame is of this device.
///
/// A drive is disabled after each chapter, also after Ctrl-C, and the device is reset at the end: what the trace has written
/// and not stored is gone then.
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
    let mut has_sent = false;
    for steps in trace.chapters() {
        let mut done = Vec::new();
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
        report.chapters.push(ChapterReport { chapter: name, steps: done, outcome });
        if report.ended_early.is_some() {
            break;
        }
    }
    if has_sent && !matches!(report.ended_early, Some(Ended::BusLost(_))) {
        // What does not boot again is what the next test will say.
        let _ = uncancelled(cancelled, || {
            tester.limit(STEP);
            tester.reset(NmtCommand::ResetNode)
        });
    }
    report
}

/// Whether a chapter can be carried out and is allowed.
fn is_for(steps: &[Step], sheet: &Sheet, settings: &Settings) -> Outcome {
    for step in steps {
        let line = step.line;
        if let Some(node) = step.other_node(settings.node) {
            let (of, tested) = (if node == 0 { "all nodes".into() } else { format!("node {node}") }, settings.node);
            return Err(not_applicable(format!(
                "line {line}: {} is of {of}, and node {tested} is tested",
                step.printed()
            )));
        }
        for condition in &step.conditions {
            if let Condition::World(word) = condition {
                return Err(not_applicable(format!("line {line}: no frame brings about {word:?}")));
            }
        }
    }
    let missing = steps.iter().find_map(|step| step.hazard(sheet).filter(|hazard| !settings.allow.contains(hazard)));
    missing.map_or(Ok(()), |hazard| Err(Verdict::NotAllowed(hazard)))
}

fn chapter(t: &mut Tester<'_>, steps: &[Step], done: &mut Vec<StepReport>) -> Outcome {
    t.begin();
    let spans = steps.iter().fold(STEP, |sum, step| sum + step.span(t.settings));
    t.limit(spans);
    t.reset(NmtCommand::ResetNode)?;
    let begun = t.now();
    let (mut heard, mut question, mut sent_at) = (Vec::new(), None, begun);
    for step in steps {
        let mut seen = None;
        let outcome = if step.is_sent {
            (sent_at, question) = (t.now(), step.is_question().then_some(step));
            send(t, step, &mut heard, &mut sent_at, &mut seen)
        } else {
            expect(t, step, question, sent_at, &mut heard, &mut seen)
        };
        let at = seen.map_or(t.now(), |(at, _)| at).since(begun);
        let (line, meaning, is_sent) = (step.line, step.meaning.clone(), step.is_sent);
        let seen = seen.map(|(_, frame)| frame);
        done.push(StepReport { line, meaning, is_sent, printed: step.printed(), seen, at, outcome: outcome.clone() });
        outcome?;
    }
    Ok(())
}

fn send(
    t: &mut Tester<'_>,
    step: &Step,
    heard: &mut Vec<Heard>,
    sent_at: &mut Instant,
    seen: &mut Option<Heard>,
) -> Outcome {
    for condition in &step.conditions {
        if let Condition::After(span) = condition {
            heard.extend(t.hear(*span)?);
        }
    }
    let Some(id) = step.id else { return Ok(()) };
    heard.clear();
    t.send(id, &step.data)?;
    *sent_at = t.now();
    *seen = Frame::new(id, &step.data).map(|frame| (*sent_at, frame));
    Ok(())
}

fn expect(
    t: &mut Tester<'_>,
    step: &Step,
    question: Option<&Step>,
    sent_at: Instant,
    heard: &mut Vec<Heard>,
    seen: &mut Option<Heard>,
) -> Outcome {
    let Some(id) = step.id else { return Ok(()) };
    let (mut until, mut least) = (None, Duration::ZERO);
    for condition in step.conditions.iter().rev() {
        match condition {
            Condition::Until(span) => until = Some(*span),
            Condition::NotBefore(span) => least = *span,
            Condition::About | Condition::After(_) | Condition::World(_) => {}
        }
    }
    let span = until.unwrap_or(t.settings.answer) + least;
    let end = t.now() + span;
    // A server answers once: what else it says is its answer.
    let answers_once = until.is_none() && is_at(id, connection::SDO_RESPONSE);
    loop {
        if let Some(at) = heard.iter().position(|(_, frame)| frame.id() == id && step.is_like(frame)) {
            let (at, frame) = heard.remove(at);
            *seen = Some((at, frame));
            let came = at.since(sent_at);
            let [early, least_ms] = [came, least].map(|span| span.as_micros() / 1000);
            return if came >= least {
                Ok(())
            } else {
                Err(failed(format!("line {}: {frame} comes after {early} ms, not before {least_ms} ms", step.line)))
            };
        }
        *seen = heard.iter().rev().find(|(_, frame)| frame.id() == id).copied();
        if seen.is_some() && answers_once || t.now() >= end {
            break;
        }
        if let (Some(question), Some(id), Some(_)) = (question, question.and_then(|step| step.id), until) {
            // The answer to the last time is none any more.
            heard.clear();
            t.send(id, &question.data)?;
        }
        let now = t.now();
        let look = if until.is_some() { AGAIN } else { PATIENCE };
        heard.extend(t.hear(look.min(end.since(now)))?);
    }
    t.depends_on(Duration::from_micros(span.as_micros() / 2));
    let found =
        seen.map_or_else(|| "nothing with this identifier came".to_owned(), |(_, frame)| format!("{frame} came"));
    Err(failed(format!("line {}: {} was expected, {found}", step.line, step.printed())))
}

impl TraceReport {
    /// How many chapters have passed, failed or were not finished, and were not carried out.
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
    /// In words: `passed`, or the verdict with its reason.
    #[must_use]
    pub fn verdict(&self) -> String {
        verdict(&self.outcome)
    }

    /// As one JSON object: `"event": "chapter"`, its verdict, and its steps.
    #[must_use]
    pub fn json(&self) -> Value {
        let steps = self.steps.iter().map(|step| {
            json!({ "line": step.line, "sent": step.is_sent, "printed": step.printed, "meaning": step.meaning,
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
