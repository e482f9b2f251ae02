//! The rows of a trace: frames to send or expect, with conditions.

use lexican_runtime::cia301::connection;
use lexican_runtime::wire::nmt::NmtCommand;
use lexican_runtime::{CobId, Duration, Frame, NodeId};

use crate::hazard::Hazard;
use crate::sheet::Sheet;

/// How long `until` waits if no time is given: enough for the slowest travel in a manual's example.
const LONGEST: Duration = Duration::from_secs(120);

/// The longest time in a condition.
const LIMIT: Duration = Duration::from_secs(3600);

/// A row of the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Step {
    pub(super) line: u64,
    pub(super) chapter: String,
    pub(super) meaning: String,
    /// Such as the line of a log.
    pub(super) source: String,
    pub(super) is_sent: bool,
    pub(super) id: Option<CobId>,
    /// The number of bytes that a remote frame requests.
    remote: Option<u8>,
    data: Vec<u8>,
    /// The bits that are compared, for each byte.
    mask: Vec<u8>,
    pub(super) conditions: Vec<Condition>,
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Condition {
    /// It may take this long, and a question before it is repeated until then.
    Until(Duration),
    /// The number in these bytes may differ by 5 %. Without bytes: the value of an SDO, or all data of a frame.
    About(Option<(usize, usize)>),
    /// The value of an SDO, or the data of a frame, are not compared.
    AnyValue,
    /// It may come at any time between its neighbours with the same COB-ID: nothing waits for it until the end of the
    /// chapter.
    AnyTime,
    /// It must not come earlier than this after the last frame sent.
    NotBefore(Duration),
    /// It is sent this long after the previous step.
    After(Duration),
    /// An outside condition, which no frame can bring about.
    World(String),
}

impl Step {
    /// Reads a row from its cells.
    ///
    /// Errors: the name of the column, and what is wrong in its cell.
    pub fn parse<'a>(line: u64, cell: impl Fn(&str) -> &'a str) -> Result<Self, (&'static str, &'static str)> {
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
        let remote = cell("data").strip_prefix('R').map(|len| if len.is_empty() { Some(0) } else { len.parse().ok() });
        let remote = match remote {
            Some(len) => Some(len.filter(|len| *len <= 8).ok_or(("data", "is no remote frame such as R or R8"))?),
            None => None,
        };
        for byte in cell("data").split_whitespace().filter(|_| remote.is_none()) {
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
            "" => remote.is_some() || !id.is_some_and(is_of_device),
            _ => return Err(("direction", "is none of send, expect, to device, from device")),
        };
        if is_sent && mask.iter().any(|mask| *mask != 0xFF) {
            return Err(("data", "is sent, and what is sent has no x"));
        }
        if is_sent && remote.is_none() && id.is_some_and(|id| is_at(id, connection::SDO_REQUEST)) {
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
        let [chapter, meaning, source] = ["chapter", "meaning", "source"].map(|column| cell(column).to_owned());
        Ok(Step { line, chapter, meaning, source, is_sent, id, remote, data, mask, conditions })
    }

    pub(super) fn printed(&self) -> String {
        let Some(id) = self.id else { return "wait".to_owned() };
        if let Some(len) = self.remote {
            return format!("{id}#R{len}");
        }
        let digit = |value: u8, mask: u8| if mask == 0 { "x".to_owned() } else { format!("{value:X}") };
        let bytes = self.data.iter().zip(&self.mask);
        let bytes = bytes.map(|(byte, mask)| digit(byte >> 4, mask >> 4) + &digit(byte & 0xF, mask & 0xF));
        format!("{id}#{}", bytes.collect::<String>())
    }

    /// The line of the step, with its source.
    pub(super) fn place(&self) -> String {
        let source = if self.source.is_empty() { String::new() } else { format!(" ({})", self.source) };
        format!("line {}{source}", self.line)
    }

    pub(super) fn frame(&self) -> Option<Frame> {
        match self.remote {
            Some(len) => Frame::remote(self.id?, len),
            None => Frame::new(self.id?, &self.data),
        }
    }

    /// Sends another frame than that in the file.
    pub fn send_instead(&mut self, frame: &Frame) {
        (self.id, self.data) = (Some(frame.id()), frame.data().to_vec());
        self.mask = vec![0xFF; self.data.len()];
    }

    pub(super) fn has(&self, condition: &Condition) -> bool {
        self.conditions.contains(condition)
    }

    pub(super) fn is_at(&self, base: u16) -> bool {
        self.id.is_some_and(|id| is_at(id, base))
    }

    pub(super) fn is_like(&self, frame: &Frame) -> bool {
        Some(frame.id()) == self.id && self.has_data_like(frame)
    }

    /// Whether the data of a frame are as expected, whatever its COB-ID.
    #[must_use]
    pub fn has_data_like(&self, frame: &Frame) -> bool {
        if self.remote.is_some() || frame.is_remote() {
            return frame.is_remote() == self.remote.is_some();
        }
        let found = frame.data();
        if found.len() != self.data.len() {
            return false;
        }
        let mut mask = self.mask.clone();
        if self.has(&Condition::AnyValue) {
            let (first, last) = self.number();
            mask.iter_mut().take(last + 1).skip(first).for_each(|mask| *mask = 0);
        }
        for condition in &self.conditions {
            let Condition::About(bytes) = condition else { continue };
            let (first, last) = bytes.unwrap_or(self.number());
            let (Some(printed), Some(heard)) = (self.data.get(first..=last), found.get(first..=last)) else {
                return false;
            };
            if !is_near(printed, heard) {
                return false;
            }
            mask.iter_mut().take(last + 1).skip(first).for_each(|mask| *mask = 0);
        }
        self.data.iter().zip(found).zip(mask).all(|((printed, found), mask)| (printed ^ found) & mask == 0)
    }

    /// The first and the last byte of the number in the frame: of the value of an SDO upload, or else of all data.
    fn number(&self) -> (usize, usize) {
        let last = self.data.len().saturating_sub(1);
        match self.data.first().map(|code| (code, code & 0xE3)) {
            // With and without size.
            Some((code, 0x43)) if self.is_at(connection::SDO_RESPONSE) => (4, 7 - usize::from(code >> 2 & 3)),
            Some((_, 0x42)) if self.is_at(connection::SDO_RESPONSE) => (4, 7),
            _ => (0, last),
        }
    }

    /// How long the step may take.
    pub(super) fn span(&self, answer: Duration) -> Duration {
        let spans = self.conditions.iter().map(|condition| match condition {
            Condition::Until(span) | Condition::NotBefore(span) | Condition::After(span) => *span,
            Condition::About(_) | Condition::AnyValue | Condition::AnyTime | Condition::World(_) => Duration::ZERO,
        });
        spans.fold(answer, |sum, span| sum + span)
    }

    /// Whether it is a read or a SYNC, which can be repeated until the answer is as expected.
    pub(super) fn is_question(&self) -> bool {
        let is_read =
            |id: CobId| is_at(id, connection::SDO_REQUEST) && self.data.first().is_some_and(|code| code >> 5 == 2);
        self.is_sent && self.id.is_some_and(|id| id == CobId::SYNC || is_read(id))
    }

    /// The hazard of sending it, if any.
    pub(super) fn hazard(&self, sheet: &Sheet) -> Option<Hazard> {
        let id = self.id.filter(|_| self.is_sent)?.raw();
        let orders = if sheet.device.profile == Some(402) { Hazard::Motion } else { Hazard::Outputs };
        let index = || Some(u16::from_le_bytes([*self.data.get(1)?, *self.data.get(2)?]));
        match id {
            _ if self.remote.is_some() => None,
            // Starting a node enables its PDOs.
            0x000 => (self.data.first() == Some(&NmtCommand::Start.code())).then_some(orders),
            0x080 | 0x100 | 0x701..=0x77F => None,
            0x600..=0x67F => match self.data.first().map(|code| code >> 5) {
                // A download, expedited, in segments or in blocks.
                Some(1 | 6) => match index()? {
                    // A downloaded program persists.
                    0x1F50..=0x1F5F => Some(Hazard::Store),
                    index => Hazard::of_write(&sheet.device, index),
                },
                _ => None,
            },
            0x7E4 | 0x7E5 => Some(Hazard::NodeId),
            // An RPDO, with any COB-ID.
            _ => Some(orders),
        }
    }

    /// The other node that it is from or for; 0 is all nodes, and `None` is `node`.
    pub(super) fn other_node(&self, node: NodeId) -> Option<u8> {
        let id = self.id?.raw();
        let of = match id {
            0x000 => *self.data.get(1)?,
            // The heartbeat of a manager, which the device may consume.
            0x701..=0x77F if self.is_sent && self.remote.is_none() => return None,
            0x081..=0x0FF | 0x181..=0x67F | 0x701..=0x77F => (id & 0x7F) as u8,
            _ => return None,
        };
        (of != node.get()).then_some(of)
    }
}

impl Condition {
    fn parse(word: &str) -> Result<Self, (&'static str, &'static str)> {
        let time = |text: &str| text.trim().parse().ok().filter(|span| *span <= LIMIT);
        let after = |name: &str| word.strip_prefix(name).map(time);
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
        if let Some(bytes) = word.strip_prefix("about ") {
            let wrong = ("condition", "has no bytes such as 0-3, from 0 to 7");
            let (first, last) = bytes.trim().split_once('-').ok_or(wrong)?;
            let bytes = first.parse().ok().zip(last.parse().ok());
            let bytes = bytes.filter(|(first, last)| first <= last && *last < 8).ok_or(wrong)?;
            return Ok(Condition::About(Some(bytes)));
        }
        Ok(match word {
            "until" => Condition::Until(LONGEST),
            "about" => Condition::About(None),
            "any time" => Condition::AnyTime,
            "any value" => Condition::AnyValue,
            other => Condition::World(other.to_owned()),
        })
    }
}

/// Whether two numbers, with or without sign, differ by at most 5 %.
fn is_near(printed: &[u8], heard: &[u8]) -> bool {
    let unused = 64 - 8 * printed.len().min(8) as u32;
    let number = |data: &[u8]| data.iter().rev().fold(0_u64, |number, byte| number << 8 | u64::from(*byte));
    let signed = |number: u64| (number << unused) as i64 >> unused;
    let (printed, heard) = (number(printed), number(heard));
    let apart = i128::from(signed(printed.wrapping_sub(heard))).abs();
    apart * 20 <= i128::from(signed(printed)).abs()
}

/// Whether a COB-ID belongs to a service of the predefined connection set, for any node.
fn is_at(id: CobId, base: u16) -> bool {
    id.raw() & !0x7F == u32::from(base)
}

/// Whether devices send frames with this COB-ID, by the predefined connection set.
fn is_of_device(id: CobId) -> bool {
    let id = id.raw();
    (0x81..0x780).contains(&id) && (id >> 7 & 1 == 1 || id >= 0x700) || id == 0x7E4
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn about_is_five_percent_of_numbers_with_either_sign() {
        for (printed, heard, is) in [
            (1000_i32, 1050, true),
            (1000, 1051, false),
            (-1000, -960, true),
            (-1000, -1051, false),
            // As an unsigned number it is near.
            (-1000, -1_000_000, false),
            (-1000, 1000, false),
            (0, 0, true),
            (0, 1, false),
            (i32::MAX, i32::MIN, true),
        ] {
            assert_eq!(is_near(&printed.to_le_bytes(), &heard.to_le_bytes()), is, "{printed} {heard}");
        }
    }
}
