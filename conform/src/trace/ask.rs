//! Carrying out the steps of a trace.

use std::collections::{BTreeMap, BTreeSet};

use lexican_runtime::cia301::connection;
use lexican_runtime::{CobId, Duration, Frame, Instant};

use super::step::{Condition, Step};
use crate::tester::{Heard, Tester};
use crate::verdict::{Outcome, failed, not_applicable};

/// How often a question is repeated.
const AGAIN: Duration = Duration::from_millis(50);

/// A device on a bus, for the steps of a trace.
pub trait Asked {
    /// The time of the bus.
    fn now(&self) -> Instant;

    /// Sends a frame.
    fn send(&mut self, frame: &Frame) -> Outcome;

    /// The next frame that comes, no later than `until`; also what has come before.
    fn hear(&mut self, until: Instant) -> Outcome<Option<Heard>>;

    /// Brings about the outside condition described by `words`, or ends it when the step with this data is over
    /// (`holds` is false). Returns whether it can.
    fn world(&mut self, _words: &str, _holds: bool, _data: &[u8]) -> bool {
        false
    }

    /// As [`Tester`]'s method: the present judgement would be different if this computer were late by `margin`.
    fn depends_on(&mut self, _margin: Duration) {}
}

impl Asked for Tester<'_> {
    fn now(&self) -> Instant {
        Tester::now(self)
    }

    fn send(&mut self, frame: &Frame) -> Outcome {
        self.put(frame)
    }

    fn hear(&mut self, until: Instant) -> Outcome<Option<Heard>> {
        let frame = self.receive(until)?;
        Ok(frame.map(|frame| (Tester::now(self), frame)))
    }

    fn depends_on(&mut self, margin: Duration) {
        Tester::depends_on(self, margin);
    }
}

/// The result of a step.
#[derive(Clone, Debug)]
pub struct StepReport {
    /// The line in the file.
    pub line: u64,
    /// Its meaning, from the file.
    pub meaning: String,
    /// Its source, from the file, such as the line of a log.
    pub source: String,
    /// Whether the tester sent it.
    pub is_sent: bool,
    /// The frame in the file, with `x` for digits that are not compared.
    pub printed: String,
    /// The frame that was sent, or received with this COB-ID; otherwise one of the same service from another node.
    pub seen: Option<Frame>,
    /// The time since the chapter began.
    pub at: Duration,
    /// What came of it.
    pub outcome: Outcome,
}

/// Carries the steps out, up to the first failure or `to_the_end`; an answer may take as long as `answer`.
pub fn ask(asked: &mut dyn Asked, steps: &[Step], answer: Duration, to_the_end: bool) -> Vec<StepReport> {
    let begun = asked.now();
    let free = steps.iter().filter(|step| step.has(&Condition::AnyTime)).filter_map(|step| step.id).collect();
    let (heard, kept) = (Vec::new(), Vec::new());
    let mut asking = Asking { asked, answer, free, heard, kept, question: None, sent_at: begun, asked_at: begun };
    let mut results = Vec::new();
    for step in steps {
        let result = if step.has(&Condition::AnyTime) { None } else { Some(asking.step(step)) };
        let is_over = !to_the_end && result.as_ref().is_some_and(|(_, outcome)| outcome.is_err());
        results.push(result);
        if is_over {
            break;
        }
    }
    let waits =
        to_the_end || results.len() == steps.len() && results.iter().flatten().all(|(_, outcome)| outcome.is_ok());
    asking.settle(steps, &mut results, waits);
    let now = asking.asked.now();
    let results = steps.iter().zip(results).filter_map(|(step, result)| Some((step, result?)));
    let reports = results.map(|(step, (seen, outcome))| StepReport {
        line: step.line,
        meaning: step.meaning.clone(),
        source: step.source.clone(),
        is_sent: step.is_sent,
        printed: step.printed(),
        seen: seen.map(|(_, frame)| frame),
        at: seen.map_or(now, |(at, _)| at).since(begun),
        outcome,
    });
    reports.collect()
}

/// The frame that was sent or received in a step, and the outcome.
type Done = (Option<Heard>, Outcome);

struct Asking<'a> {
    asked: &'a mut dyn Asked,
    answer: Duration,
    /// The COB-IDs of steps that may come at any time.
    free: BTreeSet<CobId>,
    /// The frames since the last one was sent.
    heard: Vec<Heard>,
    /// The frames with COB-IDs in `free`.
    kept: Vec<Heard>,
    /// The last frame sent, if it can be repeated.
    question: Option<Frame>,
    sent_at: Instant,
    /// When the question was last asked.
    asked_at: Instant,
}

impl Asking<'_> {
    /// Receives a frame, or waits until `until`.
    fn hear(&mut self, until: Instant) -> Outcome<bool> {
        let heard = self.asked.hear(until)?;
        self.heard.extend(heard);
        self.kept.extend(heard.filter(|(_, frame)| self.free.contains(&frame.id())));
        Ok(heard.is_some())
    }

    fn hear_all(&mut self, span: Duration) -> Outcome {
        let end = self.asked.now() + span;
        while self.hear(end)? {}
        Ok(())
    }

    fn step(&mut self, step: &Step) -> Done {
        let data = step.frame().map(|frame| frame.data().to_vec()).unwrap_or_default();
        let words = step.conditions.iter().filter_map(|condition| match condition {
            Condition::World(words) => Some(words),
            _ => None,
        });
        let words: Vec<&String> = words.collect();
        if let Some(unknown) = words.iter().find(|words| !self.asked.world(words, true, &data)) {
            return (None, Err(not_applicable(format!("{}: no frame brings about {unknown:?}", step.place()))));
        }
        let mut seen = None;
        let outcome = if step.is_sent { self.send(step, &mut seen) } else { self.expect(step, &mut seen) };
        if step.is_sent && !words.is_empty() && outcome.is_ok() {
            // The outside condition has to hold while the step is answered.
            if let Err(verdict) = self.hear_all(self.answer) {
                return (seen, Err(verdict));
            }
        }
        for words in words {
            self.asked.world(words, false, &data);
        }
        (seen, outcome)
    }

    fn send(&mut self, step: &Step, seen: &mut Option<Heard>) -> Outcome {
        for condition in &step.conditions {
            if let Condition::After(span) = condition {
                self.hear_all(*span)?;
            }
        }
        let Some(frame) = step.frame() else { return Ok(()) };
        // Frames that have come before are no answer.
        self.hear_all(Duration::ZERO)?;
        self.heard.clear();
        self.asked.send(&frame)?;
        (self.sent_at, self.asked_at) = (self.asked.now(), self.asked.now());
        self.question = step.is_question().then_some(frame);
        *seen = Some((self.sent_at, frame));
        Ok(())
    }

    fn expect(&mut self, step: &Step, seen: &mut Option<Heard>) -> Outcome {
        if step.id.is_none() {
            return Ok(());
        }
        let (mut until, mut least) = (None, Duration::ZERO);
        for condition in &step.conditions {
            match condition {
                Condition::Until(span) => until = Some(*span),
                Condition::NotBefore(span) => least = *span,
                _ => {}
            }
        }
        let span = until.unwrap_or(self.answer) + least;
        let end = self.asked.now() + span;
        // A server answers once, so any other response is its answer.
        let answers_once = until.is_none() && step.is_at(connection::SDO_RESPONSE);
        loop {
            if let Some(at) = self.heard.iter().position(|(_, frame)| step.is_like(frame)) {
                let (at, frame) = self.heard.remove(at);
                *seen = Some((at, frame));
                let came = at.since(self.sent_at);
                let [early, least_ms] = [came, least].map(|span| span.as_micros() / 1000);
                let short = least.as_micros().saturating_sub(came.as_micros());
                self.asked.depends_on(Duration::from_micros(short));
                return if came >= least {
                    Ok(())
                } else {
                    Err(failed(format!("{}: {frame} comes after {early} ms, not before {least_ms} ms", step.place())))
                };
            }
            let found = self.heard.iter().rev().find(|(_, frame)| Some(frame.id()) == step.id).copied();
            *seen = found.or(*seen);
            let now = self.asked.now();
            if seen.is_some() && answers_once || now > end || now == end && !self.hear(end)? {
                break;
            }
            let mut look = end;
            if let (Some(question), Some(_)) = (self.question, until) {
                // A question is repeated after an answer, or if none comes.
                let again = self.asked_at + if found.is_some() { AGAIN } else { self.answer.max(AGAIN) };
                if now >= again {
                    self.heard.clear();
                    self.asked.send(&question)?;
                    self.asked_at = now;
                } else {
                    look = look.min(again);
                }
            }
            self.hear(look)?;
        }
        if seen.is_none() {
            // It may be from another node.
            let kind = |id: CobId| id.raw() & !0x7F;
            let is_near = |(_, frame): &&Heard| step.id.map(kind) == Some(kind(frame.id()));
            *seen = self.heard.iter().rev().find(is_near).copied();
        }
        if until.is_none() {
            self.heard.retain(|heard| Some(*heard) != *seen);
        }
        self.asked.depends_on(Duration::from_micros(span.as_micros() / 2));
        Err(missed(step, *seen))
    }

    /// Finds the frames that may come at any time, those of each COB-ID in the order of the steps. If `waits`, waits
    /// for them.
    fn settle(&mut self, steps: &[Step], results: &mut [Option<Done>], waits: bool) {
        let begun = self.asked.now();
        let mut places: BTreeMap<Option<CobId>, usize> = BTreeMap::new();
        for (step, result) in steps.iter().zip(results).filter(|(_, result)| result.is_none()) {
            let place = places.entry(step.id).or_default();
            let end = begun + step.span(self.answer);
            let found = loop {
                let at = self.kept.iter().skip(*place).position(|(_, frame)| step.is_like(frame));
                match at.map(|at| *place + at) {
                    Some(at) => break Ok(Some(at)),
                    None if !waits => break Ok(None),
                    None => {}
                }
                match self.hear(end) {
                    Ok(false) if self.asked.now() >= end => break Ok(None),
                    Ok(_) => {}
                    Err(verdict) => break Err(verdict),
                }
            };
            *result = match found {
                Ok(Some(at)) => {
                    *place = at + 1;
                    Some((Some(self.kept[at]), Ok(())))
                }
                Ok(None) if waits => {
                    let seen =
                        self.kept.iter().skip(*place).rev().find(|(_, frame)| Some(frame.id()) == step.id).copied();
                    self.asked.depends_on(Duration::from_micros(self.answer.as_micros() / 2));
                    Some((seen, Err(missed(step, seen))))
                }
                Ok(None) => None,
                Err(verdict) => Some((None, Err(verdict))),
            };
        }
    }
}

fn missed(step: &Step, seen: Option<Heard>) -> crate::verdict::Verdict {
    let found =
        seen.map_or_else(|| "nothing with this identifier came".to_owned(), |(_, frame)| format!("{frame} came"));
    failed(format!("{}: {} was expected, {found}", step.place(), step.printed()))
}
