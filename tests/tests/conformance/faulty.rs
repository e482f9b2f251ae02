//! A device that is wrong in one thing: the device under test behind a wrapper that alters the frames which come and go.

use std::collections::VecDeque;

use lexican_runtime::host::Node;
use lexican_runtime::{CobId, Duration, Frame, Instant};

/// What is wrong with a device.
pub struct Fault {
    /// In words.
    pub title: &'static str,
    pub rules: &'static [Rule],
    /// What the data sheet says instead, where it is the data sheet that is wrong.
    pub sheet: Option<(&'static str, &'static str)>,
    /// The cases that notice.
    pub fails: &'static str,
}

pub const fn fault(title: &'static str, rules: &'static [Rule], fails: &'static str) -> Fault {
    Fault { title, rules, sheet: None, fails }
}

impl Fault {
    /// Whether the fault shows in a case where a device without it takes part in these frames.
    pub fn concerns(&self, frames: &[String]) -> bool {
        let come = |pattern: &str| frames.iter().any(|text| matches(pattern, text));
        let begins = |rule: &Rule| match rule.on {
            On::Heard(pattern) | On::Sent(pattern) => come(pattern),
            On::EveryMs(_) => rule.after.iter().all(|pattern| come(pattern)),
        };
        self.sheet.is_some() || self.rules.iter().any(begins)
    }

    pub fn data_sheet(&self, text: &str) -> String {
        self.sheet.map_or_else(|| text.to_owned(), |(said, says)| text.replace(said, says))
    }
}

/// When something happens, and what is done about it. Frames are patterns as candump writes them, in which `.` is any
/// character and `*` any rest; where a frame becomes another, `.` and `*` stand for what was there.
#[derive(Clone, Copy)]
pub struct Rule {
    on: On,
    act: Act,
    state: Option<State>,
    /// Holds only when these frames, heard or sent, have come one after the other,
    after: &'static [&'static str],
    /// and this one has not come since.
    until: Option<&'static str>,
}

#[derive(Clone, Copy)]
enum On {
    Heard(&'static str),
    Sent(&'static str),
    EveryMs(u64),
}

#[derive(Clone, Copy)]
enum Act {
    /// The frame is lost.
    Lose,
    /// Every second frame is lost.
    LoseEverySecond,
    /// Every second frame comes later by so many milliseconds.
    DelayEverySecond(u64),
    /// A byte of the frame has other bits.
    Flip(usize, u8),
    /// The frame lacks its last byte.
    Cut,
    /// The frame becomes another.
    Become(&'static str),
    /// The device does not hear the frame; this is its answer.
    Answer(&'static str),
    /// The device sends this besides.
    Add(&'static str),
}

/// The NMT state that a manager has commanded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    PreOperational,
    Operational,
    Stopped,
}

const fn rule(on: On) -> Rule {
    Rule { on, act: Act::Lose, state: None, after: &[], until: None }
}

/// The device hears a frame, and does not take note of it unless the rule goes on.
pub const fn heard(pattern: &'static str) -> Rule {
    rule(On::Heard(pattern))
}

/// The device sends a frame, and it is lost unless the rule goes on.
pub const fn sent(pattern: &'static str) -> Rule {
    rule(On::Sent(pattern))
}

/// The device sends a frame again and again.
pub const fn every_ms(ms: u64, frame: &'static str) -> Rule {
    Rule { act: Act::Add(frame), ..rule(On::EveryMs(ms)) }
}

impl Rule {
    pub const fn becomes(self, frame: &'static str) -> Self {
        Rule { act: Act::Become(frame), ..self }
    }
    pub const fn is_answered(self, frame: &'static str) -> Self {
        Rule { act: Act::Answer(frame), ..self }
    }
    pub const fn brings(self, frame: &'static str) -> Self {
        Rule { act: Act::Add(frame), ..self }
    }
    pub const fn every_second_comes_late(self, ms: u64) -> Self {
        Rule { act: Act::DelayEverySecond(ms), ..self }
    }
    pub const fn with_other_bits(self, byte: usize, bits: u8) -> Self {
        Rule { act: Act::Flip(byte, bits), ..self }
    }
    pub const fn lacks_its_last_byte(self) -> Self {
        Rule { act: Act::Cut, ..self }
    }
    pub const fn comes_half_as_often(self) -> Self {
        Rule { act: Act::LoseEverySecond, ..self }
    }
    pub const fn when(self, state: State) -> Self {
        Rule { state: Some(state), ..self }
    }
    pub const fn after(self, frames: &'static [&'static str]) -> Self {
        Rule { after: frames, ..self }
    }
    pub const fn until(self, frame: &'static str) -> Self {
        Rule { until: Some(frame), ..self }
    }
}

/// Where a rule stands.
#[derive(Clone, Copy)]
struct Progress {
    /// How many of the frames it comes after have come.
    seen: usize,
    /// How often it has applied.
    applied: u64,
    over: bool,
    next: Option<Instant>,
}

/// A device with a fault, or without.
pub struct Faulty<N> {
    inner: N,
    rules: &'static [Rule],
    progress: Vec<Progress>,
    state: State,
    extra: VecDeque<Frame>,
    delayed: VecDeque<(Instant, Frame)>,
}

impl<N> Faulty<N> {
    pub fn new(inner: N, fault: Option<&'static Fault>) -> Self {
        let rules = fault.map_or(&[][..], |fault| fault.rules);
        let progress = vec![Progress { seen: 0, applied: 0, over: false, next: None }; rules.len()];
        let (extra, delayed) = (VecDeque::new(), VecDeque::new());
        Faulty { inner, rules, progress, state: State::PreOperational, extra, delayed }
    }

    fn holds(&self, at: usize) -> bool {
        let (rule, progress) = (&self.rules[at], &self.progress[at]);
        let in_state = rule.state.is_none_or(|state| state == self.state);
        in_state && !progress.over && progress.seen == rule.after.len()
    }

    /// What rules come after has come.
    fn take_note(&mut self, now: Instant, text: &str) {
        for (rule, progress) in self.rules.iter().zip(&mut self.progress) {
            if rule.until.is_some_and(|until| matches(until, text)) {
                progress.seen = 0;
                progress.over = rule.after.is_empty();
                progress.next = None;
            } else if rule.after.get(progress.seen).is_some_and(|next| matches(next, text)) {
                progress.seen += 1;
                progress.next = Some(now);
            }
        }
    }

    /// What becomes of a frame: it passes on, perhaps as another.
    fn alter(&mut self, now: Instant, frame: Frame, concerns: fn(&On) -> Option<&'static str>) -> Option<Frame> {
        let text = frame.to_string();
        for at in 0..self.rules.len() {
            let applies = concerns(&self.rules[at].on).is_some_and(|pattern| matches(pattern, &text));
            if !applies || !self.holds(at) {
                continue;
            }
            self.progress[at].applied += 1;
            let is_second = self.progress[at].applied.is_multiple_of(2);
            match self.rules[at].act {
                Act::Lose => return None,
                Act::LoseEverySecond if is_second => return None,
                Act::DelayEverySecond(ms) if is_second => {
                    self.delayed.push_back((now + Duration::from_millis(ms), frame));
                    return None;
                }
                Act::LoseEverySecond | Act::DelayEverySecond(_) => {}
                Act::Flip(byte, bits) => {
                    let mut data = frame.data().to_vec();
                    data.iter_mut().skip(byte).take(1).for_each(|byte| *byte ^= bits);
                    return Frame::new(frame.id(), &data);
                }
                Act::Cut => return Frame::new(frame.id(), frame.data().split_last().map_or(&[], |(_, rest)| rest)),
                Act::Become(other) => return Some(filled(other, &text)),
                Act::Answer(answer) => {
                    self.extra.push_back(filled(answer, &text));
                    return None;
                }
                Act::Add(other) => self.extra.push_back(filled(other, &text)),
            }
        }
        Some(frame)
    }
}

impl<N: Node> Node for Faulty<N> {
    fn handle_frame(&mut self, now: Instant, frame: &Frame) {
        let text = frame.to_string();
        let heard = |on: &On| if let On::Heard(pattern) = *on { Some(pattern) } else { None };
        let altered = self.alter(now, *frame, heard);
        self.take_note(now, &text);
        if let [command, node] = *frame.data()
            && frame.id() == CobId::NMT
            && matches!(node, 0 | 5)
        {
            self.state = match command {
                0x01 => State::Operational,
                0x02 => State::Stopped,
                _ => State::PreOperational,
            };
        }
        if let Some(frame) = altered {
            self.inner.handle_frame(now, &frame);
        }
    }

    fn handle_timeout(&mut self, now: Instant) {
        for at in 0..self.rules.len() {
            let (On::EveryMs(ms), Act::Add(frame)) = (self.rules[at].on, self.rules[at].act) else { continue };
            if let Some(due) = self.progress[at].next.filter(|&due| due <= now) {
                self.progress[at].next = Some(due + Duration::from_millis(ms));
                if self.holds(at) && self.progress[at].applied > 0 {
                    self.extra.push_back(filled(frame, ""));
                }
                self.progress[at].applied += 1;
            }
        }
        if self.inner.poll_timeout().is_some_and(|due| due <= now) {
            self.inner.handle_timeout(now);
        }
    }

    fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        if let Some(extra) = self.extra.pop_front() {
            return Some(extra);
        }
        if self.delayed.front().is_some_and(|(due, _)| *due <= now) {
            return self.delayed.pop_front().map(|(_, frame)| frame);
        }
        let sent = |on: &On| if let On::Sent(pattern) = *on { Some(pattern) } else { None };
        while let Some(frame) = self.inner.poll_transmit(now) {
            let altered = self.alter(now, frame, sent);
            self.take_note(now, &frame.to_string());
            if altered.is_some() {
                return altered;
            }
        }
        self.extra.pop_front()
    }

    fn poll_timeout(&self) -> Option<Instant> {
        let own = self.rules.iter().zip(&self.progress);
        let own = own.filter(|(rule, _)| matches!(rule.on, On::EveryMs(_))).filter_map(|(_, progress)| progress.next);
        let delayed = self.delayed.front().map(|(due, _)| *due);
        own.chain(delayed).chain(self.inner.poll_timeout()).min()
    }
}

pub fn matches(pattern: &str, text: &str) -> bool {
    let (head, any_rest) = pattern.strip_suffix('*').map_or((pattern, false), |head| (head, true));
    let same = head.len() == text.len() || any_rest && head.len() < text.len();
    same && head.bytes().zip(text.bytes()).all(|(wanted, is)| wanted == b'.' || wanted == is)
}

/// The frame that a pattern describes, with what another has in the places that are open.
fn filled(pattern: &str, other: &str) -> Frame {
    let (head, rest) = pattern.strip_suffix('*').map_or((pattern, ""), |head| (head, &other[head.len()..]));
    let mut text: Vec<u8> = head.bytes().chain(rest.bytes()).collect();
    for (to, from) in text.iter_mut().zip(other.bytes()).filter(|(to, _)| **to == b'.') {
        *to = from;
    }
    let text = String::from_utf8(text).expect("patterns are text");
    let (id, data) = text.split_once('#').expect("a frame is id#data");
    let id = CobId::standard(u16::from_str_radix(id, 16).expect("an identifier")).expect("of 11 bits");
    let bytes = data.as_bytes().chunks(2).map(|two| {
        let two = std::str::from_utf8(two).expect("hex digits");
        u8::from_str_radix(two, 16).expect("hex digits")
    });
    Frame::new(id, &bytes.collect::<Vec<u8>>()).expect("up to eight bytes")
}
