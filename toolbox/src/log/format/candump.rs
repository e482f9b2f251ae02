//! `candump -L`: `(1436509052.249713) can0 605#407C600000000000`, and the default output of `candump`: `
//! (1436509052.249713)  can0  605   [8]  40 7C 60 00 00 00 00 00`, with the time stamps of `-ta`, `-tz` or `-tA`, or
//! without.
//!
//! `-td` cannot be told from `-tz`: its differences are read as absolute times.

use std::borrow::Cow;
use std::io::Write as _;
use std::sync::Arc;

use lexican_runtime::{CobId, Frame, Instant};

use crate::log::codec::{Encode, Lines, Skipped, WriteError};
use crate::log::input::Flaw;
use crate::log::number::{decimal, fixed, hex};
use crate::log::{Direction, INTERFACE, Record, calendar};

pub(super) struct Read {
    /// The name of the last interface, which frames share.
    interface: Arc<str>,
}

impl Default for Read {
    fn default() -> Self {
        Read { interface: INTERFACE.into() }
    }
}

impl Lines for Read {
    fn line(&mut self, line: &str, skipped: &mut Skipped) -> Result<Option<Record>, Flaw> {
        if line.is_empty() {
            return Ok(None);
        }
        let (at, rest) = match line.strip_prefix('(') {
            Some(rest) => {
                let (stamp, rest) = rest.split_once(')').ok_or(Flaw::Time)?;
                (instant(stamp).ok_or(Flaw::Time)?, rest)
            }
            None => (Instant::ZERO, line),
        };
        let mut words = rest.split_ascii_whitespace();
        let name = words.next().ok_or(Flaw::Interface)?;
        if *self.interface != *name {
            self.interface = name.into();
        }
        let word = words.next().ok_or(Flaw::Frame)?;
        let (direction, found) = if word.contains('#') {
            let direction = if words.next() == Some("T") { Direction::Sent } else { Direction::Received };
            (direction, compact(word)?)
        } else {
            printed(word, words)?
        };
        let record = |frame| Record { at, interface: Arc::clone(&self.interface), direction, frame };
        Ok(match found {
            Found::Frame(frame) => Some(record(frame)),
            Found::Fd => {
                skipped.fd += 1;
                None
            }
            Found::Error => {
                skipped.errors += 1;
                None
            }
        })
    }
}

/// `1436509052.249713`, or `2015-07-10 06:17:32.249713`.
fn instant(stamp: &str) -> Option<Instant> {
    match stamp.split_once(' ') {
        Some((date, time)) => calendar::parse_iso(date, time),
        None => fixed(stamp, 6).map(Instant::from_micros),
    }
}

enum Found {
    Frame(Frame),
    /// A frame of CAN FD or CAN XL.
    Fd,
    Error,
}

/// `605#407C6000`, `705#R1`, `123##1AABB` of CAN FD, and `123#1122334455667788_9` with a raw length.
fn compact(word: &str) -> Result<Found, Flaw> {
    let (id, data) = word.split_once('#').ok_or(Flaw::Frame)?;
    let Some(id) = cob_id(id)? else { return Ok(Found::Error) };
    if data.starts_with('#') || data.contains(':') {
        return Ok(Found::Fd);
    }
    let data = data.split_once('_').map_or(data, |(data, _)| data);
    let frame = match data.strip_prefix(['R', 'r']) {
        Some("") => Frame::remote(id, 0),
        Some(len) => decimal(len).and_then(|len| Frame::remote(id, u8::try_from(len).ok()?)),
        None => {
            let mut bytes = [0; 8];
            for (byte, digits) in bytes.iter_mut().zip(data.as_bytes().chunks(2)) {
                *byte = pair(digits).ok_or(Flaw::Frame)?;
            }
            if data.len() <= 2 * bytes.len() { Frame::new(id, &bytes[..data.len() / 2]) } else { None }
        }
    };
    frame.map(Found::Frame).ok_or(Flaw::Frame)
}

/// Two hexadecimal digits.
fn pair(digits: &[u8]) -> Option<u8> {
    let [high, low] = digits else { return None };
    let digit = |byte: u8| char::from(byte).to_digit(16);
    u8::try_from(digit(*high)? * 16 + digit(*low)?).ok()
}

/// Three or eight hexadecimal digits; `None` for an error frame, whose identifier has a bit above 29 bits set.
fn cob_id(word: &str) -> Result<Option<CobId>, Flaw> {
    let number = hex(word).ok_or(Flaw::Frame)?;
    match word.len() {
        3 => u16::try_from(number).ok().and_then(CobId::standard).map(Some).ok_or(Flaw::Frame),
        8 if number >> 29 == 1 => Ok(None),
        8 => CobId::extended(number).map(Some).ok_or(Flaw::Frame),
        _ => Err(Flaw::Frame),
    }
}

/// `605   [8]  40 7C 60 00 00 00 00 00`; `-x` puts `RX - -` before it, `-a` puts quoted characters after it.
fn printed<'a>(first: &'a str, mut words: impl Iterator<Item = &'a str>) -> Result<(Direction, Found), Flaw> {
    let (direction, id) = match first {
        "RX" | "TX" => {
            // "- -", "B E": flags of CAN FD.
            let id = words.find(|word| !matches!(*word, "-" | "B" | "E")).ok_or(Flaw::Frame)?;
            (Direction::of_word(first).unwrap_or_default(), id)
        }
        _ => (Direction::Received, first),
    };
    let len = words.next().and_then(|word| word.strip_prefix('[')?.strip_suffix(']')).ok_or(Flaw::Frame)?;
    let Some(id) = cob_id(id)? else { return Ok((direction, Found::Error)) };
    // Lengths of two digits belong to CAN FD.
    if len.len() != 1 {
        return Ok((direction, Found::Fd));
    }
    let len = decimal(len).filter(|len| *len <= 8).ok_or(Flaw::Frame)? as usize;
    let mut words = words.peekable();
    if words.peek() == Some(&"remote") {
        return Frame::remote(id, len as u8).map(|frame| (direction, Found::Frame(frame))).ok_or(Flaw::Frame);
    }
    let mut bytes = [0; 8];
    for byte in &mut bytes[..len] {
        *byte = words.next().and_then(|word| pair(word.as_bytes())).ok_or(Flaw::Frame)?;
    }
    // Only quoted characters may follow.
    if words.next().is_some_and(|word| !word.starts_with('\'')) {
        return Err(Flaw::Frame);
    }
    Frame::new(id, &bytes[..len]).map(|frame| (direction, Found::Frame(frame))).ok_or(Flaw::Frame)
}

/// Longer than the name of any interface.
const LONGEST_NAME: usize = 255;

fn is_gap(c: char) -> bool {
    c.is_whitespace() || c.is_control()
}

/// Writes the name of an interface without spaces, which Wireshark's names may have.
pub(super) struct Write;

impl Encode for Write {
    fn record(&mut self, out: &mut Vec<u8>, record: &Record) -> Result<(), WriteError> {
        let Record { at, interface, frame, .. } = record;
        let is_word = |name: &str| !name.is_empty() && name.len() <= LONGEST_NAME && !name.contains(is_gap);
        let interface: Cow<'_, str> = if is_word(interface) {
            Cow::Borrowed(interface)
        } else {
            let name: String = interface.chars().take(LONGEST_NAME).map(|c| if is_gap(c) { '_' } else { c }).collect();
            Cow::Owned(if name.is_empty() { INTERFACE.to_owned() } else { name })
        };
        let us = at.as_micros();
        writeln!(out, "({:010}.{:06}) {interface} {frame}", us / 1_000_000, us % 1_000_000)?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn read(line: &str) -> Result<Option<String>, Flaw> {
        let record = Read::default().line(line, &mut Skipped::default())?;
        Ok(record.map(|Record { at, interface, direction, frame }| {
            format!("{} {interface} {frame} {}", at.as_micros(), direction.word())
        }))
    }

    #[test]
    fn all_ways_to_print_a_frame_are_read() {
        for (line, record) in [
            ("(1436509052.249713) can0 605#407C600000000000", "1436509052249713 can0 605#407C600000000000 Rx"),
            ("(0000000012.000000) can1 00000185#FF T", "12000000 can1 00000185#FF Tx"),
            ("(12.000000123) can1 185# R", "12000000 can1 185# Rx"),
            ("(12.0) can1 705#R1", "12000000 can1 705#R1 Rx"),
            ("(12.0) can1 705#1122334455667788_9", "12000000 can1 705#1122334455667788 Rx"),
            ("vcan0  605   [4]  40 7C 60 00", "0 vcan0 605#407C6000 Rx"),
            ("vcan0  705   [1]  remote request", "0 vcan0 705#R1 Rx"),
            ("vcan0  080   [0]", "0 vcan0 080# Rx"),
            ("(12.000001)  can0  TX - -  00000185   [2]  01 41   '.A'", "12000001 can0 00000185#0141 Tx"),
            ("(2015-07-10 06:17:32.249713)  can0  080   [0] ", "1436509052249713 can0 080# Rx"),
        ] {
            assert_eq!(read(line), Ok(Some(record.to_owned())), "{line}");
        }
    }

    #[test]
    fn an_interface_is_written_as_one_word() {
        for (name, word) in
            [("can0", "can0"), ("", "can0"), ("Fake IF, text2pcap", "Fake_IF,_text2pcap"), ("\u{85}", "_")]
        {
            let frame = Frame::from_array(CobId::SYNC, [7]);
            let record = Record { at: Instant::ZERO, interface: name.into(), direction: Direction::Sent, frame };
            let mut line = Vec::new();
            Write.record(&mut line, &record).unwrap();
            assert_eq!(String::from_utf8(line).unwrap(), format!("(0000000000.000000) {word} 080#07\n"));
        }
    }

    #[test]
    fn other_frames_are_counted_and_other_lines_refused() {
        let mut skipped = Skipped::default();
        for line in [
            "(1.5) can0 123##1AABB",
            "(1.5) can0 123#80:00:11223344",
            "can0  123  [12]  00 01 02 03 04 05 06 07 08 09 0A 0B",
            "(1.5) can0 20000004#0004000000000000",
            "can0  20000080   [8]  00 00 08 00 00 00 00 00   ERRORFRAME",
        ] {
            assert_eq!(Read::default().line(line, &mut skipped), Ok(None), "{line}");
        }
        assert_eq!(skipped, Skipped { fd: 3, errors: 2, ..Skipped::default() });
        for (line, flaw) in [
            ("(1.5", Flaw::Time),
            ("(-1.5) can0 080#", Flaw::Time),
            ("(99999999999999999.5) can0 080#", Flaw::Time),
            ("(1.5)", Flaw::Interface),
            ("(1.5) can0", Flaw::Frame),
            ("(1.5) can0 800#", Flaw::Frame),
            ("(1.5) can0 0800#", Flaw::Frame),
            ("(1.5) can0 60000080#", Flaw::Frame),
            ("(1.5) can0 080#1", Flaw::Frame),
            ("(1.5) can0 080#+1", Flaw::Frame),
            ("(1.5) can0 080#112233445566778899", Flaw::Frame),
            ("(1.5) can0 080#11223344556677889", Flaw::Frame),
            ("(1.5) can0 080#R9", Flaw::Frame),
            ("can0  080   [2]  01", Flaw::Frame),
            ("can0  080   [1]  01 02", Flaw::Frame),
            ("can0  080   [9]  01 02 03 04 05 06 07 08 09", Flaw::Frame),
        ] {
            assert_eq!(read(line), Err(flaw), "{line}");
        }
    }
}
