//! Random faults: a seed decides which reaction of a correct device is altered, and a case must notice it.
//!
//! The reaction is drawn from everything that the device receives and sends in the cases, service by service, so that
//! every part of its state machine is covered. No verdict is written by hand: if the frames of the cases stay the same,
//! the fault shows nothing; some faults CiA 301 allows; every other one has to make a case fail.
//!
//! `LEXICAN_SEEDS=1000..2000 cargo test -p lexican-tests --test conformance drawn -- --nocapture` tries other seeds.

use std::collections::{BTreeMap, BTreeSet};
use std::env;
use std::ops::Range;

use lexican_conform::{Case, Sheet, Verdict};

use lexican_runtime::wire::nmt::NmtState;

use crate::faulty::{Fault, commanded, fault, matches};
use crate::{NONE, SUBJECTS, Subject, lss, name, sheet};

const SEEDS: Range<u64> = 0..200;

/// The case that sends what no client sends, and needs no answer.
const NONSENSE: &str = "301/7.2.4.3/4";

/// SplitMix64.
struct Random(u64);

impl Random {
    fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mixed = (self.0 ^ self.0 >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((mixed ^ mixed >> 31) % end as u64) as usize
    }

    fn one<'a, T>(&mut self, of: &'a [T]) -> &'a T {
        &of[self.below(of.len())]
    }
}

/// A pattern for all frames of the same reaction or request.
fn kind(text: &str) -> String {
    let Some((id, data)) = text.split_once('#') else { return text.to_owned() };
    let command = data.get(..2).and_then(|command| u8::from_str_radix(command, 16).ok());
    let known = match (id, command) {
        _ if data.starts_with('R') => 1,
        // With the multiplexer, if there is one.
        ("585" | "605", Some(0x21..=0x2F | 0x40..=0x4F | 0x80 | 0xA0 | 0xA4 | 0xC0 | 0xC2 | 0xC4 | 0xC6)) => 8,
        ("585", Some(0x60)) => 8,
        ("085", _) => 4,
        ("585" | "605" | "7E4" | "7E5", _) => 2,
        ("000" | "080" | "705", _) => data.len(),
        _ => 0,
    };
    format!("{id}#{}*", &data[..known.min(data.len())])
}

/// What faults are drawn from: the kinds of frames of each service in the cases.
struct Reactions {
    plan: Vec<(&'static Case, Vec<String>)>,
    services: Vec<Vec<String>>,
}

/// A fault that was drawn.
struct Drawn {
    rules: &'static str,
    fault: Fault,
    pattern: String,
    how: How,
}

/// What is wrong with a frame.
#[derive(Clone, Copy, Debug)]
enum How {
    Lost,
    LostEverySecondTime,
    Twice,
    WithoutLastByte,
    EverySecondTimeLate,
    /// Confirmed, but not stored.
    Pretended,
    Refused,
    /// The number of the byte, and of the bit in it.
    WithOtherBit(usize, usize),
}

impl Reactions {
    fn of(subject: &Subject, sheet: &Sheet) -> Self {
        let plan: Vec<_> = subject.cases().map(|case| (case, subject.run(case, sheet, &NONE).1)).collect();
        let cases = plan.iter().filter(|(case, _)| case.id != NONSENSE);
        let kinds: BTreeSet<String> = cases.flat_map(|(_, frames)| frames).map(|text| kind(text)).collect();
        let mut services: BTreeMap<String, Vec<String>> = BTreeMap::new();
        // The cases of LSS judge nothing else of the device with LSS.
        let has_to_do = |kind: &String| subject.cases().any(|case| !lss::tests(&case)) || kind.starts_with("7E");
        for kind in kinds.into_iter().filter(has_to_do) {
            services.entry(kind.chars().take(6).collect()).or_default().push(kind);
        }
        Reactions { plan, services: services.into_values().collect() }
    }

    fn draw(&self, seed: u64) -> Drawn {
        let random = &mut Random(seed);
        let service = random.one(&self.services);
        let pattern = random.one(service).clone();
        let places = self.plan.iter().flat_map(|(_, frames)| (0..frames.len()).map(move |at| (frames, at)));
        let places: Vec<_> = places.filter(|(frames, at)| matches(&pattern, &frames[*at])).collect();
        let &(frames, at) = random.one(&places);
        let is_sent = ["585#", "705#", "085#", "185#", "285#", "080#", "7E4#"].iter().any(|id| pattern.starts_with(id))
            && !pattern.contains("#R");
        let how = how(&frames[at], is_sent, random);
        let when = match random.below(4) {
            0 => format!(" in {}", state(&frames[..at])),
            1 if at > 0 => format!(" after {}", kind(&frames[random.below(at)])),
            _ => String::new(),
        };
        let on = if is_sent { "sent" } else { "heard" };
        let rules = format!("{on} {pattern}{}{when}", altered(how, &pattern)).leak();
        Drawn { fault: fault(rules), rules, pattern, how }
    }
}

/// The NMT state after these frames.
fn state(frames: &[String]) -> NmtState {
    let last = frames.iter().rev().find_map(|text| match text.strip_prefix("000#")?.split_at_checked(2)? {
        (command, "05" | "00") => u8::from_str_radix(command, 16).ok(),
        _ => None,
    });
    last.map_or(NmtState::PreOperational, commanded)
}

fn how(text: &str, is_sent: bool, random: &mut Random) -> How {
    let bytes = if text.contains("#R") { 0 } else { text.split_once('#').map_or(0, |(_, data)| data.len() / 2) };
    let begins = |heads: &[&str]| heads.iter().any(|head| text.starts_with(head));
    let mut ways = vec![How::Lost];
    if is_sent {
        ways.extend([How::LostEverySecondTime, How::Twice]);
    }
    if begins(&["080#", "185#", "7057F"]) && is_sent {
        ways.push(How::EverySecondTimeLate);
    }
    if begins(&["605#2"]) {
        ways.extend([How::Pretended, How::Refused]);
    } else if begins(&["605#4"]) {
        ways.push(How::Refused);
    }
    if bytes > 0 {
        ways.push(How::WithoutLastByte);
        ways.extend([How::WithOtherBit(random.below(bytes), random.below(8)); 4]);
    }
    *random.one(&ways)
}

/// The words of a rule.
fn altered(how: How, pattern: &str) -> String {
    match how {
        How::Lost => String::new(),
        How::LostEverySecondTime => " halved".to_owned(),
        How::Twice => format!(" brings {pattern}"),
        How::WithoutLastByte => " cut".to_owned(),
        How::EverySecondTimeLate => " late 40".to_owned(),
        How::Pretended => " answered 585#60......00000000".to_owned(),
        How::Refused => " answered 585#80......22000008".to_owned(),
        How::WithOtherBit(byte, bit) => format!(" flipped {byte}:{:02X}", 1 << bit),
    }
}

/// Why the standards allow a device to do so.
fn allowed(drawn: &Drawn, sheet: &Sheet) -> Option<&'static str> {
    let byte_of =
        |at: usize| drawn.pattern.get(4 + 2 * at..6 + 2 * at).and_then(|byte| u8::from_str_radix(byte, 16).ok());
    let How::WithOtherBit(byte, bit) = drawn.how else { return None };
    if drawn.pattern.starts_with("085#") && byte >= 3 {
        return Some("five bytes of an emergency are the manufacturer's (CiA 301, 7.2.7.3)");
    }
    if drawn.pattern.starts_with("7E4#17") && (byte, bit) == (1, 0) {
        return Some("LSS need not store (CiA 305, 6.4.5)");
    }
    if drawn.pattern.starts_with("605#E0") && byte > 0 {
        return Some("an unknown command has no multiplexer: of its abort the code counts (CCT 2.7)");
    }
    let command = byte_of(0).filter(|_| drawn.pattern.starts_with("585#"))?;
    let used = match command {
        0x00..=0x1F => 8 - usize::from(command >> 1 & 7),
        0x42..=0x4F => 8 - usize::from(command >> 2 & 3),
        // The values that are read by block have 4 and 11 bytes; both end at byte 4 of their last segment.
        0x81.. if command & 0x60 == 0 => 5,
        _ => 8,
    };
    if byte >= used {
        return Some("bytes that hold no data may have any value (CiA 301, 7.2.4.3.6 and 7.2.4.3.7)");
    }
    if matches!(command, 0xA0 | 0xA4) && byte == 4 && bit < 7 {
        return Some("the server decides how many segments a block has (CiA 301, 7.2.4.3.9)");
    }
    if matches!(command, 0x41 | 0x43) && (byte, bit) == (0, 0) {
        return Some("the size of an upload need not be indicated (CiA 301, 7.2.4.3.6)");
    }
    let at = (u16::from_le_bytes([byte_of(1)?, byte_of(2)?]), byte_of(3)?);
    let entry = sheet.device.entry(at.0, at.1)?;
    let is_value = command & 0xF0 == 0x40 && (4..8 - usize::from(command >> 2 & 3)).contains(&byte);
    let is_open = entry.default.is_none() || entry.pdo_mapping && !entry.access.writable();
    (is_value && is_open).then_some("the value is the device's")
}

#[test]
fn what_is_altered_by_chance_is_noticed() {
    let seeds = env::var("LEXICAN_SEEDS").ok().and_then(|seeds| {
        let (first, end) = seeds.split_once("..")?;
        Some(first.parse().ok()?..end.parse().ok()?)
    });
    let (mut noticed, mut unchanged, mut may, mut unnoticed) = (0, 0, 0, Vec::new());
    for subject in SUBJECTS.iter().step_by(2) {
        let sheet = sheet(subject.data_sheet);
        let reactions = Reactions::of(subject, &sheet);
        for seed in seeds.clone().unwrap_or(SEEDS) {
            let drawn = reactions.draw(seed);
            let (mut failed, mut changed) = (None, Vec::new());
            for (case, right) in reactions.plan.iter().filter(|(_, frames)| drawn.fault.concerns(frames)) {
                let (outcome, frames) = subject.run(case, &sheet, &drawn.fault);
                if matches!(outcome, Err(Verdict::Failed(_))) {
                    failed = Some(case);
                    break;
                }
                if frames != *right && case.id != NONSENSE {
                    changed.push(name(case));
                }
            }
            match (failed, allowed(&drawn, &sheet)) {
                (Some(_), _) => noticed += 1,
                (None, _) if changed.is_empty() => unchanged += 1,
                (None, Some(_)) => may += 1,
                (None, None) => unnoticed.push(format!("{seed}: {} ({})", drawn.rules, changed.join(" "))),
            }
        }
    }
    for fault in &unnoticed {
        println!("{fault}");
    }
    println!("{noticed} are noticed, {unchanged} change nothing, {may} are allowed, {} are unnoticed", unnoticed.len());
    // Every new case changes what is drawn, so some faults become unnoticed; each is a reason for a further case.
    assert!(noticed > 100 && unnoticed.len() * 50 <= noticed, "{} of {noticed}", unnoticed.len());
}
