//! Scripts: statements of manuals in words, and what a simulated drive does to show that they hold.
//!
//! A paragraph begins with the key of a row. Its clauses follow, each after a dash, and below them, indented, the runs
//! that show that they hold; consecutive clauses share the runs below them. A run begins with a drive that has booted.
//! Its steps, separated by semicolons, must all hold. A clause or run after `[keys]` is only for drives with keys, one
//! after `[no keys]` only for those without. `let` names steps; `$1` is the first word after the name.
//!
//! ```text
//! let stepped = control 200F; wait 30000
//!
//! 2.2.1.2:inching 1
//! - once by Delta Inch
//!   ready; stepped; position 1600
//! - Delta Inch < 0: negative direction
//!   ready 2415:00=-700; stepped; position -700
//! ```
//!
//! Numbers of objects, identifiers, control words, NMT commands and bytes are hexadecimal. An expected value is a
//! number, `>0`, `<0` or `10..11`; an expected frame may be a pattern, where `.` is any digit and `*` any rest.

use std::collections::BTreeMap;

use crate::notation::{hex, number};
use crate::rig::{Rig, Simulator};
use crate::states::state_name;

/// Clauses, and whether each holds for the drive.
pub(crate) type Clauses = Vec<(&'static str, bool)>;

/// A drive that scripts can be about.
pub(crate) trait Scripted: Simulator {
    /// Whether the drive has a feature that a clause is about: keys, limit switches.
    fn has_feature(name: &str) -> bool;

    /// The size of an entry in bytes.
    fn size(rig: &Rig<Self>, index: u16, sub: u8) -> u8;

    /// A value by a name that only this kind of drive has.
    fn value(name: &str) -> Option<i64>;

    /// The position of the shaft, in the drive's counts.
    fn place(rig: &Rig<Self>) -> i64;

    /// Carries out a step that only this kind of drive has. Returns whether it holds, or `None` if the word is unknown.
    fn step(rig: &mut Rig<Self>, verb: &str, args: &[&str]) -> Option<bool>;
}

/// The paragraphs of a file.
pub(crate) struct Script {
    /// Steps by the names that `let` gave them.
    names: BTreeMap<&'static str, &'static str>,
    /// Clauses and the runs that show them, by key.
    paragraphs: BTreeMap<&'static str, Vec<Group>>,
}

/// Clauses that share their runs.
#[derive(Default)]
struct Group {
    clauses: Vec<&'static str>,
    runs: Vec<&'static str>,
}

/// A run in progress.
struct Run<S: Simulator> {
    rig: Rig<S>,
    /// The position of the shaft at the step `mark`.
    mark: i64,
    /// The step that did not hold, in the notation of the run.
    failed: String,
}

impl<S: Simulator> Default for Run<S> {
    fn default() -> Self {
        Run { rig: Rig::new(), mark: 0, failed: String::new() }
    }
}

impl Script {
    pub(crate) fn parse(text: &'static str) -> Self {
        let mut script = Script { names: BTreeMap::new(), paragraphs: BTreeMap::new() };
        let mut groups: &mut Vec<Group> = &mut Vec::new();
        for line in text.lines().filter(|line| !line.is_empty() && !line.starts_with('#')) {
            if let Some((name, steps)) = line.strip_prefix("let ").and_then(|line| line.split_once(" = ")) {
                script.names.insert(name, steps);
            } else if let Some(clause) = line.strip_prefix("- ") {
                if groups.last().is_none_or(|group| !group.runs.is_empty()) {
                    groups.push(Group::default());
                }
                groups.iter_mut().last().into_iter().for_each(|group| group.clauses.push(clause));
            } else if let Some(run) = line.strip_prefix("  ") {
                groups.iter_mut().last().into_iter().for_each(|group| group.runs.push(run));
            } else {
                groups = script.paragraphs.entry(line).or_default();
            }
        }
        script
    }

    /// The clauses of a paragraph, and whether each holds for the drive.
    pub(crate) fn clauses<S: Scripted>(&self, key: &str) -> Option<Clauses> {
        let groups = self.paragraphs.get(key)?;
        let of_group = |group: &Group| {
            let clauses: Vec<&str> = group.clauses.iter().filter_map(|clause| featured::<S>(clause)).collect();
            let runs = || group.runs.iter().filter_map(|run| featured::<S>(run));
            let holds = !clauses.is_empty() && !group.runs.is_empty() && runs().all(|run| self.holds::<S>(run));
            clauses.into_iter().map(|clause| (clause, holds)).collect::<Vec<_>>()
        };
        Some(groups.iter().flat_map(of_group).collect())
    }

    /// Whether all steps of a run hold.
    pub(crate) fn holds<S: Scripted>(&self, steps: &str) -> bool {
        self.steps(&mut Run::<S>::default(), steps)
    }

    /// The runs that do not hold, each with its clause and the step that failed.
    pub(crate) fn failures<S: Scripted>(&self) -> Vec<String> {
        let groups = self.paragraphs.values().flatten();
        let runs = groups.flat_map(|group| group.runs.iter().map(|run| (group.clauses.join(", "), *run)));
        let fails = |(clause, steps): (String, &'static str)| {
            let mut run = Run::<S>::default();
            let holds = self.steps(&mut run, featured::<S>(steps)?);
            (!holds).then(|| format!("{clause}: not so: {} (in: {steps})", run.failed))
        };
        runs.filter_map(fails).collect()
    }

    fn steps<S: Scripted>(&self, run: &mut Run<S>, steps: &str) -> bool {
        steps.split(';').map(str::trim).all(|step| {
            let holds = self.step(run, step);
            if !holds {
                step.clone_into(&mut run.failed);
            }
            holds
        })
    }

    fn step<S: Scripted>(&self, run: &mut Run<S>, step: &str) -> bool {
        let words: Vec<&str> = step.split_whitespace().collect();
        match words.split_first() {
            Some((&"not", _)) => !self.step(run, &step["not ".len()..]),
            Some((verb, args)) if self.names.contains_key(verb) => {
                let mut steps = self.names[verb].to_owned();
                for (place, word) in (1..).zip(args) {
                    steps = steps.replace(&format!("${place}"), word);
                }
                self.steps(run, &steps)
            }
            // Check every tenth of a second, for up to `ms`.
            Some((&"until", [ms, ..])) => {
                let question = step.splitn(3, ' ').nth(2).unwrap_or_default();
                let looks = ms.parse::<u64>().unwrap_or_default() / 100;
                (0..looks).any(|_| {
                    run.rig.hear(100);
                    self.step(run, question)
                })
            }
            Some((&"mark", _)) => {
                run.mark = S::place(&run.rig);
                true
            }
            Some((&"way", [range])) => is_in(S::place(&run.rig) - run.mark, range),
            Some((verb, args)) => {
                let found = S::step(&mut run.rig, verb, args).or_else(|| common(&mut run.rig, verb, args));
                found.unwrap_or_else(|| panic!("a script has the step {step:?}"))
            }
            None => panic!("a script has an empty step"),
        }
    }
}

/// The text after a mark such as `[keys]`, if the drive has that feature.
fn featured<S: Scripted>(text: &'static str) -> Option<&'static str> {
    let Some((name, rest)) = text.strip_prefix('[').and_then(|text| text.split_once("] ")) else { return Some(text) };
    let (name, wanted) = name.strip_prefix("no ").map_or((name, true), |name| (name, false));
    (S::has_feature(name) == wanted).then_some(rest)
}

/// Carries out a step that every kind of drive has.
fn common<S: Scripted>(rig: &mut Rig<S>, verb: &str, args: &[&str]) -> Option<bool> {
    let ms = |text: &str| text.parse::<u64>().ok();
    let id = |text: &str| u16::from_str_radix(text, 16).ok();
    let count = |frames: Vec<Vec<u8>>| frames.len() as i64;
    match (verb, args) {
        ("delivered", []) => *rig = Rig::as_delivered(),
        ("operational", []) => {
            rig.nmt(0x01);
            rig.hear(0);
        }
        ("enable", []) => rig.enable(),
        ("fail", []) => rig.see(S::fail),
        ("wait", [span]) => _ = rig.hear(ms(span)?),
        ("nmt", [command]) => rig.nmt(hex(command)? as u8),
        ("send", [to, data @ ..]) => {
            rig.send(id(to)?, &data.iter().map(|byte| Some(hex(byte)? as u8)).collect::<Option<Vec<_>>>()?);
        }
        ("request", [of]) => rig.request(id(of)?),
        ("control", words) => words.iter().try_for_each(|word| id(word).map(|word| rig.control(word)))?,
        ("command", [to, word, target]) => rig.command(id(to)?, id(word)?, target.parse().ok()?),
        // Accepted or refused: the effect shows in the steps that follow.
        ("try", writes) => writes.iter().try_for_each(|text| write(rig, text).map(|_| ()))?,
        ("set", writes) => {
            return writes
                .iter()
                .map(|text| Some(write(rig, text)? == Ok(())))
                .try_fold(true, |all, one| Some(all & one?));
        }
        ("refused", [code, writes @ ..]) => {
            let is_so = |found: Result<(), u32>| match hex(code) {
                Some(code) => found == Err(code),
                None => found.is_err(),
            };
            return writes.iter().map(|text| write(rig, text).map(is_so)).try_fold(true, |all, one| Some(all & one?));
        }
        ("read", [at, range]) => {
            let (index, sub) = address(at)?;
            return Some(rig.read(index, sub).is_ok_and(|found| is_value::<S>(found, range)));
        }
        ("reads", [index, values @ ..]) => {
            let index = id(index)?;
            let right = |(sub, value): (u8, &&str)| rig.read(index, sub).is_ok_and(|found| is_value::<S>(found, value));
            return Some((0..).zip(values).all(right));
        }
        ("bit", [at, bit, value]) => {
            let (index, sub) = address(at)?;
            let bit: u32 = bit.parse().ok()?;
            return Some(rig.read(index, sub).is_ok_and(|found| (found >> bit & 1).to_string() == *value));
        }
        ("readable", [at]) => return address(at).map(|(index, sub)| rig.read(index, sub).is_ok()),
        ("sdo", data) => {
            let at = data.iter().position(|word| *word == "=")?;
            let request: Vec<u8> = data[..at].iter().map(|byte| Some(hex(byte)? as u8)).collect::<Option<_>>()?;
            rig.hear(0);
            rig.send(Rig::<S>::own(0x600), &request);
            return Some(
                rig.hear_from(Rig::<S>::own(0x580), 0)
                    .first()
                    .is_some_and(|data_found| is_like(data_found, data[at + 1])),
            );
        }
        ("status", args) => return is_word(rig.status(), args),
        ("state", words) => return Some(state_name(rig.state()).eq_ignore_ascii_case(&words.join(" "))),
        ("nmt-state", [state]) => return Some(rig.nmt_state().code().to_string() == *state),
        ("heard", [of, span, range]) => return Some(is_in(count(rig.hear_from(id(of)?, ms(span)?)), range)),
        ("hears", [of, span, patterns @ ..]) => {
            let found = rig.hear_from(id(of)?, ms(span)?);
            return Some(
                found.len() == patterns.len()
                    && found.iter().zip(patterns).all(|(data, pattern)| is_like(data, pattern)),
            );
        }
        ("first", [of, span, pattern]) => {
            return Some(rig.hear_from(id(of)?, ms(span)?).first().is_some_and(|data| is_like(data, pattern)));
        }
        ("last", [of, span, pattern]) => {
            return Some(rig.hear_from(id(of)?, ms(span)?).last().is_some_and(|data| is_like(data, pattern)));
        }
        // No other frame comes.
        ("only", [of, span, range]) => {
            let (of, found) = (u32::from(id(of)?), rig.hear(ms(span)?));
            return Some(is_in(found.len() as i64, range) && found.iter().all(|frame| frame.id().raw() == of));
        }
        ("asked", [of, range]) => return Some(is_in(count(rig.requested(id(of)?, 0)), range)),
        ("answers", [of, pattern]) => return Some(is_like(&rig.requested(id(of)?, 0).concat(), pattern)),
        _ => return None,
    }
    Some(true)
}

/// Writes a value given as `2410:04=51`; `None` if the text is none.
pub(crate) fn write<S: Scripted>(rig: &mut Rig<S>, text: &str) -> Option<Result<(), u32>> {
    let (at, value) = text.split_once('=')?;
    let ((index, sub), value) = (address(at)?, value_of::<S>(value)?);
    let size = S::size(rig, index, sub);
    Some(rig.write(index, sub, value, size))
}

/// An address as `2410:04`.
pub(crate) fn address(text: &str) -> Option<(u16, u8)> {
    let (index, sub) = text.split_once(':')?;
    Some((u16::from_str_radix(index, 16).ok()?, u8::from_str_radix(sub, 16).ok()?))
}

fn value_of<S: Scripted>(text: &str) -> Option<i64> {
    number(text).and_then(|number| i64::try_from(number).ok()).or_else(|| S::value(text))
}

/// Whether a value that was read is as expected, taken with or without a sign.
fn is_value<S: Scripted>(found: u32, range: &str) -> bool {
    let value = S::value(range);
    value == Some(found.into())
        || value.is_none() && (is_in(found.into(), range) || is_in((found as i32).into(), range))
}

/// Whether a number is equal to the given one, or within `>0`, `<0` or `10..11`.
pub(crate) fn is_in(found: i64, range: &str) -> bool {
    let found = i128::from(found);
    let is = |text: &str, holds: fn(&i128, &i128) -> bool| number(text).is_some_and(|number| holds(&found, &number));
    match (range.strip_prefix('>'), range.strip_prefix('<'), range.split_once("..")) {
        (Some(low), ..) => is(low, i128::gt),
        (_, Some(high), _) => is(high, i128::lt),
        (.., Some((low, high))) => is(low, i128::ge) && is(high, i128::le),
        _ => is(range, i128::eq),
    }
}

/// Whether a word has this bit (`4 1`), or these bits (`6F=21`).
pub(crate) fn is_word(word: u16, args: &[&str]) -> Option<bool> {
    match args {
        [bit, value] => Some((word >> bit.parse::<u16>().ok()? & 1).to_string() == *value),
        [bits] => {
            let (mask, value) = bits.split_once('=')?;
            Some(u32::from(word) & hex(mask)? == hex(value)?)
        }
        _ => None,
    }
}

fn is_like(data: &[u8], pattern: &str) -> bool {
    let text: String = data.iter().map(|byte| format!("{byte:02X}")).collect();
    let (head, any_rest) = pattern.strip_suffix('*').map_or((pattern, false), |head| (head, true));
    let same = head.len() == text.len() || any_rest && head.len() < text.len();
    same && head.bytes().zip(text.bytes()).all(|(wanted, is)| wanted == b'.' || wanted == is)
}
