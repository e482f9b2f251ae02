//! The Lawicel protocol: lines of text that stand for frames, commands and answers.
//!
//! `t12320A0B` is the data frame 123h with the bytes 0Ah 0Bh, `T` the same with eight digits of identifier, `r` and `R`
//! are remote frames. A carriage return ends a line; the bell says that a command was refused.

use core::fmt::Write;
use std::string::String;

use crate::host::BusState;
use crate::{CobId, Frame};

/// The bit rates that the protocol has a command for, in bit/s: `S0` to `S8`.
pub const BIT_RATES: [u32; 9] = [10_000, 20_000, 50_000, 100_000, 125_000, 250_000, 500_000, 800_000, 1_000_000];

/// The longest line: an extended frame with eight bytes and a time stamp, `T` + 8 + 1 + 16 + 4.
const LONGEST: usize = 30;

/// A frame as a line, without its end: `t12320A0B`.
#[must_use]
pub fn line(frame: &Frame) -> String {
    let mut line = String::with_capacity(LONGEST);
    let letter = match (frame.is_remote(), frame.id().is_extended()) {
        (false, false) => 't',
        (false, true) => 'T',
        (true, false) => 'r',
        (true, true) => 'R',
    };
    let written = write!(line, "{letter}{}{}", frame.id(), frame.dlc())
        .and_then(|()| frame.data().iter().try_for_each(|byte| write!(line, "{byte:02X}")));
    written.expect("writing to a String does not fail");
    line
}

/// A message of the adapter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Message {
    /// A frame on the bus.
    Frame(Frame),
    /// The controller's state, in an answer to `F` or unasked (`s`).
    State(BusState),
    /// A command was carried out, or a frame was accepted.
    Done,
    /// A command was refused, or a frame was not accepted: the bell.
    Refused,
    /// Anything else: a version, a serial number, a command of another host, noise.
    Other,
}

/// Decodes a stream of bytes into messages.
#[derive(Clone, Debug, Default)]
pub struct Decoder {
    line: [u8; LONGEST],
    /// If it exceeds the buffer, the line is not a message.
    len: usize,
}

impl Decoder {
    /// Takes one byte; returns the message that it completes.
    pub fn take(&mut self, byte: u8) -> Option<Message> {
        match byte {
            b'\r' => {
                let message = self.line.get(..self.len).map_or(Message::Other, message);
                self.len = 0;
                Some(message)
            }
            // The bell discards all that came before it on its line.
            0x07 => {
                self.len = 0;
                Some(Message::Refused)
            }
            b'\n' => None,
            _ => {
                if let Some(place) = self.line.get_mut(self.len) {
                    *place = byte;
                }
                self.len = self.len.saturating_add(1);
                None
            }
        }
    }

    /// Drops an incomplete line.
    pub fn reset(&mut self) {
        self.len = 0;
    }
}

fn message(line: &[u8]) -> Message {
    match line {
        [] | [b'z' | b'Z'] => Message::Done,
        [b't' | b'T' | b'r' | b'R', ..] => frame(line).map_or(Message::Other, Message::Frame),
        [b'F', digits @ ..] if digits.len() == 2 => number(digits).map_or(Message::Other, status),
        [b's', state, ..] => self::state(*state).map_or(Message::Other, Message::State),
        _ => Message::Other,
    }
}

fn frame(line: &[u8]) -> Option<Frame> {
    let (&letter, rest) = line.split_first()?;
    let digits = if letter.is_ascii_uppercase() { 8 } else { 3 };
    let (id, rest) = rest.split_at_checked(digits)?;
    let id = match digits {
        3 => CobId::standard(u16::try_from(number(id)?).ok()?)?,
        _ => CobId::extended(number(id)?)?,
    };
    let (&len, rest) = rest.split_first()?;
    let len = len.checked_sub(b'0').filter(|len| *len <= 8)?;
    let remote = letter.eq_ignore_ascii_case(&b'r');
    let (data, stamp) = rest.split_at_checked(if remote { 0 } else { 2 * usize::from(len) })?;
    // Adapters may append time stamps: milliseconds in four digits.
    if !matches!(stamp.len(), 0 | 4) || !stamp.iter().all(u8::is_ascii_hexdigit) {
        return None;
    }
    if remote {
        return Frame::remote(id, len);
    }
    let mut bytes = [0; 8];
    for (byte, digits) in bytes.iter_mut().zip(data.chunks(2)) {
        *byte = u8::try_from(number(digits)?).ok()?;
    }
    Frame::new(id, bytes.get(..usize::from(len))?)
}

/// The status flags of an SJA1000, the controller of the first adapters, which all others imitate.
fn status(flags: u32) -> Message {
    const WARNING: u32 = 1 << 2;
    const PASSIVE: u32 = 1 << 5;
    Message::State(match flags {
        _ if flags & PASSIVE != 0 => BusState::Passive,
        _ if flags & WARNING != 0 => BusState::Warning,
        _ => BusState::Active,
    })
}

/// The letters that Linux's slcan driver also accepts.
fn state(letter: u8) -> Option<BusState> {
    match letter {
        b'a' => Some(BusState::Active),
        b'w' => Some(BusState::Warning),
        b'p' => Some(BusState::Passive),
        b'b' => Some(BusState::Off),
        _ => None,
    }
}

/// A number of up to eight hexadecimal digits, without any other character.
fn number(digits: &[u8]) -> Option<u32> {
    digits.iter().try_fold(0u32, |number, digit| Some(number.checked_mul(16)? | char::from(*digit).to_digit(16)?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    fn messages(bytes: &[u8]) -> Vec<Message> {
        let mut decoder = Decoder::default();
        bytes.iter().filter_map(|byte| decoder.take(*byte)).collect()
    }

    fn heard(frame: &str) -> Message {
        let line = std::format!("(0.000000) slcan0 {frame}");
        Message::Frame(line.parse::<crate::host::candump::Line>().unwrap().frame)
    }

    #[test]
    fn lines_are_what_the_protocol_says() {
        for (text, message) in [
            ("t12320A0B", heard("123#0A0B")),
            ("t1230", heard("123#")),
            ("T000001238AABBCCDDEEFF0011", heard("00000123#AABBCCDDEEFF0011")),
            ("r7051", heard("705#R1")),
            ("R1FFFFFFF0", heard("1FFFFFFF#R0")),
            // With a time stamp; with small letters.
            ("t0801FF1234", heard("080#FF")),
            ("t7ff1ab", heard("7FF#AB")),
            ("", Message::Done),
            ("z", Message::Done),
            ("Z", Message::Done),
            ("F00", Message::State(BusState::Active)),
            ("F04", Message::State(BusState::Warning)),
            ("F24", Message::State(BusState::Passive)),
            ("sb256256", Message::State(BusState::Off)),
            ("sa057033", Message::State(BusState::Active)),
            // Not frames: too long, too short, not hexadecimal, out of range, and other words.
            ("t1239", Message::Other),
            ("t12320A", Message::Other),
            ("t12320A0B0", Message::Other),
            ("t12320A0G", Message::Other),
            ("t+231AA", Message::Other),
            ("t8000", Message::Other),
            ("T200000000", Message::Other),
            ("r12310A", Message::Other),
            ("S6", Message::Other),
            ("V1013", Message::Other),
            ("F", Message::Other),
            ("T000001238AABBCCDDEEFF00111234567890", Message::Other),
        ] {
            assert_eq!(messages(std::format!("{text}\r").as_bytes()), [message], "{text:?}");
        }
    }

    #[test]
    fn a_bell_ends_what_came_before_it() {
        assert_eq!(messages(b"t123\x07t1230\r\n"), [Message::Refused, heard("123#")]);
    }

    fn any_frame() -> impl Strategy<Value = Frame> {
        let id = prop_oneof![
            (0..=0x7FFu16).prop_map(|id| CobId::standard(id).unwrap()),
            (0..=0x1FFF_FFFFu32).prop_map(|id| CobId::extended(id).unwrap()),
        ];
        (id, any::<bool>(), prop::collection::vec(any::<u8>(), 0..=8)).prop_map(|(id, remote, data)| {
            let frame = if remote { Frame::remote(id, data.len() as u8) } else { Frame::new(id, &data) };
            frame.unwrap()
        })
    }

    proptest! {
        #[test]
        fn frames_read_back_as_written(frame in any_frame()) {
            let text = line(&frame) + "\r";
            prop_assert_eq!(messages(text.as_bytes()), [Message::Frame(frame)]);
        }

        #[test]
        fn noise_is_survived(noise in prop::collection::vec(any::<u8>(), 0..200), frame in any_frame()) {
            let text = line(&frame) + "\r";
            let heard = messages(&[&noise[..], b"\r", text.as_bytes()].concat());
            prop_assert_eq!(heard.last(), Some(&Message::Frame(frame)));
        }
    }
}
