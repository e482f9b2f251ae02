//! A device with one fault: the device under test behind a wrapper that alters received and sent frames.
//!
//! Rules, separated by semicolons, describe the fault. A rule begins with its subject:
//!
//! - `heard FRAME`, `sent FRAME`: a frame that the device receives or sends; it is lost unless the rule says otherwise;
//! - `every MS brings FRAME`: a frame that the device sends periodically;
//! - `sheet TEXT becomes TEXT`, `sheet SECTION has KEY=VALUE ...`: a fault in the data sheet.
//!
//! Then the rule says what happens to the frame: it `becomes FRAME`; it is `answered FRAME`, and the device does not
//! receive it; it `brings FRAME` in addition; it is `cut` by its last byte, or `flipped BYTE:BITS`; every second one is
//! lost (`halved`), or comes later (`late MS`). At the end, it says when: `in STATE`, the state that a manager has
//! commanded; `after FRAME ...`, once these have come in order; `until FRAME`, as long as this one has not come since.
//!
//! Frames are patterns in the notation of candump, where `.` is any character and `*` any rest. In a frame that
//! replaces another, these keep the characters of the original.

use std::collections::VecDeque;

use lexican_runtime::host::Node;
use lexican_runtime::wire::nmt::{NmtCommand, NmtState};
use lexican_runtime::{CobId, Duration, Frame, Instant};

/// A fault of a device.
#[derive(Default)]
pub struct Fault {
    /// The fault in words.
    pub title: &'static str,
    rules: Vec<Rule>,
    /// The rules about the data sheet.
    sheet: Vec<&'static str>,
    /// The cases that must notice it.
    pub fails: &'static str,
}

/// Parses a table of faults, one on each line: title, rules, and the cases that notice. Lines with `#` are headings.
pub fn table(text: &'static str) -> Vec<Fault> {
    let rows = text.lines().filter(|line| !line.is_empty() && !line.starts_with("# "));
    rows.map(|row| {
        let mut cells = row.split(" | ");
        let [title, rules, fails] = [(); 3].map(|()| cells.next().unwrap_or_default());
        named(title, rules, fails)
    })
    .collect()
}

pub fn named(title: &'static str, rules: &'static str, fails: &'static str) -> Fault {
    Fault { title, fails, ..fault(rules) }
}

pub fn fault(rules: &'static str) -> Fault {
    let parts = rules.split(';').map(str::trim).filter(|rule| !rule.is_empty());
    let (sheet, rules): (Vec<_>, Vec<_>) = parts.partition(|rule| rule.starts_with("sheet "));
    Fault { rules: rules.into_iter().map(Rule::parse).collect(), sheet, ..Fault::default() }
}

impl Fault {
    /// Whether the fault can show in a case in which a device without it exchanges these frames.
    pub fn concerns(&self, frames: &[String]) -> bool {
        let come = |pattern: &str| frames.iter().any(|text| matches(pattern, text));
        let begins = |rule: &Rule| match rule.on {
            On::Heard(pattern) | On::Sent(pattern) => come(pattern),
            On::EveryMs(_) => rule.after.iter().all(|pattern| come(pattern)),
        };
        !self.sheet.is_empty() || self.rules.iter().any(begins)
    }

    pub fn data_sheet(&self, text: &str) -> String {
        self.sheet.iter().fold(text.to_owned(), |text, rule| {
            let rule = rule.trim_start_matches("sheet ");
            if let Some((said, says)) = rule.split_once(" becomes ") {
                return text.replace(said, says);
            }
            let (section, keys) = rule.split_once(" has ").expect("a rule about the data sheet");
            let (before, after) = text.split_once(&format!("[{section}]")).expect("a section");
            let (keys_before, after) = after.split_once("\n[").expect("it is not the last one");
            let changed = |line: &str| {
                let key = line.split('=').next();
                keys.split(' ').find(|setting| setting.split('=').next() == key).unwrap_or(line).to_owned()
            };
            let keys = keys_before.lines().map(changed).collect::<Vec<_>>().join("\n");
            format!("{before}[{section}]{keys}\n[{after}")
        })
    }
}

/// When the rule applies, and what it does.
#[derive(Clone)]
struct Rule {
    on: On,
    act: Act,
    state: Option<NmtState>,
    /// Applies only once these frames, received or sent, have come in order,
    after: Vec<&'static str>,
    /// and as long as this one has not come since.
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
    Lose,
    LoseEverySecond,
    DelayEverySecond(Duration),
    /// Flips bits in a byte of the frame.
    Flip(usize, u8),
    Cut,
    Become(&'static str),
    /// The device does not receive the frame; this is its answer.
    Answer(&'static str),
    /// The device sends this frame in addition.
    Add(&'static str),
}

/// The words of a rule that have arguments.
const VERBS: [&str; 11] =
    ["heard", "sent", "every", "becomes", "answered", "brings", "flipped", "late", "in", "after", "until"];

impl Rule {
    fn parse(text: &'static str) -> Self {
        let mut rule = Rule { on: On::Heard(""), act: Act::Lose, state: None, after: Vec::new(), until: None };
        let mut verb = "";
        for word in text.split(' ') {
            let number = || word.parse().unwrap_or_else(|_| panic!("{text}: {word} is no number"));
            match (verb, word) {
                (_, "halved") => rule.act = Act::LoseEverySecond,
                (_, "cut") => rule.act = Act::Cut,
                _ if VERBS.contains(&word) => verb = word,
                ("heard", _) => rule.on = On::Heard(word),
                ("sent", _) => rule.on = On::Sent(word),
                ("every", _) => rule.on = On::EveryMs(number()),
                ("becomes", _) => rule.act = Act::Become(word),
                ("answered", _) => rule.act = Act::Answer(word),
                ("brings", _) => rule.act = Act::Add(word),
                ("flipped", _) => {
                    let flip = word.split_once(':');
                    let flip = flip.and_then(|(byte, bits)| byte.parse().ok().zip(u8::from_str_radix(bits, 16).ok()));
                    let (byte, bits) = flip.unwrap_or_else(|| panic!("{text}: {word} is no BYTE:BITS"));
                    rule.act = Act::Flip(byte, bits);
                }
                ("late", _) => rule.act = Act::DelayEverySecond(Duration::from_millis(number())),
                ("in", "STOPPED") => rule.state = Some(NmtState::Stopped),
                ("in", "OPERATIONAL") => rule.state = Some(NmtState::Operational),
                ("in", "PRE-OPERATIONAL") => rule.state = Some(NmtState::PreOperational),
                ("after", times) if times.starts_with('x') => {
                    let times = times[1..].parse().unwrap_or_else(|_| panic!("{text}: {word} is no number"));
                    rule.after = rule.after.repeat(times);
                }
                ("after", _) => rule.after.push(word),
                ("until", _) => rule.until = Some(word),
                _ => panic!("{text}: {word} is no word of a rule"),
            }
        }
        rule
    }
}

/// The progress of a rule.
#[derive(Clone, Copy)]
struct Progress {
    /// How many of the frames in `after` have come.
    seen: usize,
    /// How often the rule has applied.
    applied: u64,
    over: bool,
    next: Option<Instant>,
}

/// The state after a command, when the device has booted again.
pub fn commanded(command: u8) -> NmtState {
    match NmtCommand::from_code(command).map(NmtCommand::target) {
        Some(state @ (NmtState::Operational | NmtState::Stopped)) => state,
        _ => NmtState::PreOperational,
    }
}

/// A device with or without a fault.
pub struct Faulty<N> {
    inner: N,
    rules: Vec<Rule>,
    progress: Vec<Progress>,
    state: NmtState,
    extra: VecDeque<Frame>,
    delayed: VecDeque<(Instant, Frame)>,
}

impl<N> Faulty<N> {
    pub fn new(inner: N, fault: &Fault) -> Self {
        let rules = fault.rules.clone();
        let progress = vec![Progress { seen: 0, applied: 0, over: false, next: None }; rules.len()];
        let (extra, delayed) = (VecDeque::new(), VecDeque::new());
        Faulty { inner, rules, progress, state: NmtState::PreOperational, extra, delayed }
    }

    fn holds(&self, at: usize) -> bool {
        let (rule, progress) = (&self.rules[at], &self.progress[at]);
        let in_state = rule.state.is_none_or(|state| state == self.state);
        in_state && !progress.over && progress.seen == rule.after.len()
    }

    /// Checks the frame against the `after` and `until` of the rules.
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

    /// Applies the rules to a frame. Returns the frame that passes on, if any.
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
                Act::DelayEverySecond(by) if is_second => {
                    self.delayed.push_back((now + by, frame));
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
            self.state = commanded(command);
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

/// The frame that a pattern describes, with the characters of another frame in the open places.
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
