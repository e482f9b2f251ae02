//! Logs as `candump -L` writes them: `(1436509052.249713) can0 605#407C600000000000`.
//!
//! One line per frame. `canplayer`, Wireshark and `log2asc` read this format, too.

use std::fmt;
use std::str::FromStr;
use std::string::{String, ToString};
use std::vec::Vec;

use crate::{CobId, Frame, Instant};

/// One line of a log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Line {
    /// When the frame was received.
    pub at: Instant,
    /// The interface: `can0`.
    pub interface: String,
    /// The frame.
    pub frame: Frame,
}

impl fmt::Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let us = self.at.as_micros();
        write!(f, "({:010}.{:06}) {} {}", us / 1_000_000, us % 1_000_000, self.interface, self.frame)
    }
}

impl FromStr for Line {
    type Err = NotALogLine;

    fn from_str(line: &str) -> Result<Self, NotALogLine> {
        let mut words = line.split_ascii_whitespace();
        let stamp =
            words.next().and_then(|word| word.strip_prefix('(')?.strip_suffix(')')).ok_or(NotALogLine::Stamp)?;
        let at = instant(stamp).ok_or(NotALogLine::Stamp)?;
        let interface = words.next().ok_or(NotALogLine::Interface)?.to_string();
        let frame = frame(words.next().ok_or(NotALogLine::Frame)?).ok_or(NotALogLine::Frame)?;
        Ok(Line { at, interface, frame })
    }
}

/// Why a line is not one of `candump -L`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NotALogLine {
    /// The first word is not `(seconds.microseconds)`.
    #[error("the line does not begin with a time stamp such as (1436509052.249713)")]
    Stamp,
    /// The second word is missing.
    #[error("the line names no interface")]
    Interface,
    /// The third word is not a classic CAN frame.
    #[error("the line has no classic CAN frame such as 605#407C600000000000 or 705#R1")]
    Frame,
}

/// Parses the format of [`Line`]: `605#407C600000000000`, `705#R1`.
impl FromStr for Frame {
    type Err = NotAFrame;

    fn from_str(text: &str) -> Result<Self, NotAFrame> {
        frame(text).ok_or(NotAFrame)
    }
}

/// The text is not a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("it is no classic CAN frame such as 605#407C600000000000 or 705#R1")]
pub struct NotAFrame;

fn instant(stamp: &str) -> Option<Instant> {
    let (seconds, fraction) = stamp.split_once('.').filter(|(_, fraction)| fraction.len() == 6)?;
    let (seconds, micros) = (decimal(seconds)?, decimal(fraction)?);
    Some(Instant::from_micros(seconds.checked_mul(1_000_000)?.checked_add(micros)?))
}

fn frame(word: &str) -> Option<Frame> {
    let (id, data) = word.split_once('#')?;
    let number = hex(id.as_bytes())?;
    // The number of digits distinguishes standard and extended identifiers.
    let id = match id.len() {
        3 => CobId::standard(u16::try_from(number).ok()?)?,
        8 => CobId::extended(number)?,
        _ => return None,
    };
    if let Some(len) = data.strip_prefix('R') {
        return Frame::remote(id, if len.is_empty() { 0 } else { u8::try_from(decimal(len)?).ok()? });
    }
    let (bytes, rest) = data.as_bytes().as_chunks::<2>();
    let bytes: Option<Vec<u8>> = bytes.iter().map(|digits| u8::try_from(hex(digits)?).ok()).collect();
    Frame::new(id, &bytes?).filter(|_| rest.is_empty())
}

/// A number without a sign, which `parse` would accept.
fn decimal(digits: &str) -> Option<u64> {
    digits.parse().ok().filter(|_| !digits.starts_with('+'))
}

/// A hexadecimal number without a sign.
fn hex(digits: &[u8]) -> Option<u32> {
    let digits = str::from_utf8(digits).ok()?;
    u32::from_str_radix(digits, 16).ok().filter(|_| !digits.starts_with('+'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn round_trip(line: &str) {
        assert_eq!(line.parse::<Line>().map(|line| line.to_string()), Ok(line.to_string()));
    }

    #[test]
    fn lines_read_back_as_written() {
        round_trip("(1436509052.249713) can0 605#407C600000000000");
        round_trip("(0000000000.000001) vcan1 000#0105");
        round_trip("(0000000012.000000) can0 705#R1");
        round_trip("(0000000012.000000) can0 080#");
        round_trip("(0000000012.000000) can0 00000185#FF");
    }

    #[test]
    fn a_frame_is_read_alone() {
        let frame: Frame = "705#R1".parse().unwrap();
        assert_eq!((frame.is_remote(), frame.to_string().as_str()), (true, "705#R1"));
        assert_eq!("705".parse::<Frame>(), Err(NotAFrame));
    }

    #[test]
    fn other_lines_are_refused() {
        for (line, error) in [
            ("", NotALogLine::Stamp),
            ("1.000000 can0 605#", NotALogLine::Stamp),
            ("(1.5) can0 605#", NotALogLine::Stamp),
            ("(1.000000)", NotALogLine::Interface),
            ("(1.000000) can0", NotALogLine::Frame),
            ("(1.000000) can0 800#", NotALogLine::Frame),
            ("(1.000000) can0 605#4", NotALogLine::Frame),
            ("(1.000000) can0 605#é0", NotALogLine::Frame),
            ("(1.000000) can0 +05#", NotALogLine::Frame),
            ("(1.000000) can0 605#+1", NotALogLine::Frame),
            ("(1.000000) can0 605#R+1", NotALogLine::Frame),
            ("(+1.000000) can0 605#", NotALogLine::Stamp),
            ("(1.+00001) can0 605#", NotALogLine::Stamp),
            ("(1.000000) can0 605##1112233", NotALogLine::Frame),
            ("(1.000000) can0 605#112233445566778899", NotALogLine::Frame),
        ] {
            assert_eq!(line.parse::<Line>(), Err(error), "{line:?}");
        }
    }
}
