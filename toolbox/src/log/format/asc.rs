//! Vector ASC: a date, then a line for each frame or event:
//! `   0.015991 1  605             Rx   d 8 40 7C 60 00 00 00 00 00  Length = 0 BitCount = 0`.

use std::io::Write as _;

use lexican_runtime::{CobId, Duration, Frame, Instant};

use crate::log::channel::{Channels, Interfaces};
use crate::log::codec::{Encode, Lines, Skipped, WriteError};
use crate::log::input::Flaw;
use crate::log::number::{decimal, fixed};
use crate::log::{Direction, Record, calendar};
use crate::text::calendar::Civil;

pub(super) struct Read {
    /// The base of identifiers and data: 16 or 10.
    base: u32,
    /// Whether time stamps are relative to the previous line.
    is_relative: bool,
    /// When the measurement began, and the time from then to the last line.
    start: Option<Instant>,
    passed: Duration,
    /// The date of a trigger, until the next line with a time stamp.
    trigger: Option<Instant>,
    interfaces: Interfaces,
}

impl Default for Read {
    fn default() -> Self {
        Read {
            base: 16,
            is_relative: false,
            start: None,
            passed: Duration::ZERO,
            trigger: None,
            interfaces: Interfaces::default(),
        }
    }
}

impl Lines for Read {
    fn line(&mut self, line: &str, skipped: &mut Skipped) -> Result<Option<Record>, Flaw> {
        let mut words = line.split_ascii_whitespace();
        let Some(first) = words.next() else { return Ok(None) };
        if !first.starts_with(|c: char| c.is_ascii_digit()) {
            self.head(&first.to_ascii_lowercase(), line, skipped);
            return Ok(None);
        }
        let stamp = fixed(first, 6).map(Duration::from_micros).ok_or(Flaw::Time)?;
        self.passed = if self.is_relative { self.passed + stamp } else { stamp };
        self.settle_trigger();
        let second = words.next().unwrap_or_default();
        // Statistics, chip states and other buses are no frames.
        let Some(channel) = decimal(second).and_then(|channel| u16::try_from(channel).ok()) else {
            skipped.fd += u64::from(second.eq_ignore_ascii_case("canfd"));
            return Ok(None);
        };
        let id = words.next().unwrap_or_default();
        if id.eq_ignore_ascii_case("errorframe") {
            skipped.errors += 1;
            return Ok(None);
        }
        let (direction, kind) = (words.next().and_then(Direction::of_word), words.next().unwrap_or_default());
        // Other lines of a channel: requests to send, overload frames, remarks.
        let (Some(direction), true) = (direction, ["d", "r"].contains(&&*kind.to_ascii_lowercase())) else {
            skipped.other += 1;
            return Ok(None);
        };
        let id = self.cob_id(id).ok_or(Flaw::Frame)?;
        let is_remote = kind.eq_ignore_ascii_case("r");
        let len = match words.next() {
            // Older tools write no length, and newer ones may append other fields.
            None => None,
            Some(word) if is_remote => u8::from_str_radix(word, 16).ok(),
            Some(word) => Some(u8::from_str_radix(word, 16).map_err(|_| Flaw::Frame)?),
        };
        let frame = if is_remote {
            Frame::remote(id, len.unwrap_or(0).min(8))
        } else {
            // Lengths above 8 mean 8 (ISO 11898-1).
            let len = usize::from(len.ok_or(Flaw::Frame)?.min(8));
            let mut bytes = [0; 8];
            for byte in &mut bytes[..len] {
                let word = words.next().filter(|word| !word.starts_with('+')).ok_or(Flaw::Frame)?;
                *byte = u8::from_str_radix(word, self.base).map_err(|_| Flaw::Frame)?;
            }
            Frame::new(id, &bytes[..len])
        };
        let at = self.start.unwrap_or_default() + self.passed;
        let record = |frame| Record { at, interface: self.interfaces.of(channel), direction, frame };
        frame.map(record).map(Some).ok_or(Flaw::Frame)
    }
}

impl Read {
    /// A line that has no time stamp; `first` is its first word in lower case.
    fn head(&mut self, first: &str, line: &str, skipped: &mut Skipped) {
        let rest = line.get(first.len()..).unwrap_or_default();
        match first {
            "date" => match calendar::parse_vector(rest) {
                Some(start) => self.start = Some(start),
                None => skipped.other += 1,
            },
            "base" => {
                let rest = rest.to_ascii_lowercase();
                self.base = if rest.contains("dec") { 10 } else { 16 };
                self.is_relative = rest.contains("relative");
            }
            "begin" => {
                let date = rest.trim_start().split_once(' ').map_or("", |(_, date)| date);
                self.trigger = calendar::parse_vector(date);
            }
            "end" | "internal" | "no" => {}
            _ if first.starts_with("//") => {}
            _ => skipped.other += 1,
        }
    }

    /// At the first time after a trigger, decides whether times count from the trigger or from the date of the file.
    /// Vector's tools continue to count from the date; other writers restart at zero, and their date is that of
    /// creating the file.
    fn settle_trigger(&mut self) {
        const TOLERANCE: Duration = Duration::from_secs(2);
        let Some(trigger) = self.trigger.take() else { return };
        let line = self.start.unwrap_or_default() + self.passed;
        let fits = !self.passed.is_zero() && line.since(trigger) + trigger.since(line) <= TOLERANCE;
        if self.start.is_none() || !fits && !self.is_relative {
            self.start = Some(trigger);
        }
    }

    fn cob_id(&self, word: &str) -> Option<CobId> {
        let extended = word.strip_suffix(['x', 'X']);
        let digits = extended.unwrap_or(word);
        let number = u32::from_str_radix(digits, self.base).ok().filter(|_| !digits.starts_with('+'))?;
        match extended {
            Some(_) => CobId::extended(number),
            None => CobId::standard(u16::try_from(number).ok()?),
        }
    }
}

/// Writes hexadecimal numbers, and times relative to the date, which is in milliseconds.
#[derive(Default)]
pub(super) struct Write {
    start: Option<Instant>,
    channels: Channels,
}

impl Write {
    fn begin(&mut self, out: &mut Vec<u8>, at: Instant) -> Instant {
        *self.start.get_or_insert_with(|| {
            let start = Instant::from_micros(at.as_micros() / 1000 * 1000);
            let date = calendar::vector(start);
            out.extend(
                format!(
                    "date {date}\nbase hex  timestamps absolute\nno internal events logged\n\
                     Begin Triggerblock {date}\n   0.000000 Start of measurement\n"
                )
                .bytes(),
            );
            start
        })
    }
}

impl Encode for Write {
    fn record(&mut self, out: &mut Vec<u8>, record: &Record) -> Result<(), WriteError> {
        let Record { at, interface, direction, frame } = record;
        if Civil::of(*at).year > 9999 {
            return Err(WriteError::Time { at: *at });
        }
        let channel = self.channels.of(interface)?;
        let passed = at.since(self.begin(out, *at)).as_micros();
        let (seconds, us) = (passed / 1_000_000, passed % 1_000_000);
        let suffix = if frame.id().is_extended() { "x" } else { "" };
        let id = format!("{:X}{suffix}", frame.id().raw());
        write!(out, "{seconds:>4}.{us:06} {channel:<2} {id:<15} {:<4} ", direction.word())?;
        if frame.is_remote() {
            write!(out, "r {:x}", frame.dlc())?;
        } else {
            write!(out, "d {:x}", frame.dlc())?;
            frame.data().iter().try_for_each(|byte| write!(out, " {byte:02X}"))?;
        }
        out.push(b'\n');
        Ok(())
    }

    fn finish(&mut self, out: &mut Vec<u8>) {
        self.begin(out, Instant::ZERO);
        out.extend(b"End TriggerBlock\n");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(lines: &str) -> (Vec<String>, Skipped) {
        crate::log::codec::read::<Read>(lines)
    }

    #[test]
    fn numbers_and_times_are_read_in_both_ways() {
        let (records, skipped) = read(
            "date Sat Sep 30 03:06:13.191 PM 2017
             base dec  timestamps relative
             internal events logged
             // version 9.0.0
             Begin Triggerblock Sat Sep 30 15:06:13.191 2017
                0.000000 Start of measurement
                0.015991 CAN 1 Status:chip status error passive - TxErr: 132 RxErr: 0
                0.001 1  1541             Rx   d 3 10 255 0  Length = 0 BitCount = 0 ID = 1541
                0.001 2  389x             Tx   r
                0.001 2  389             Tx   r 4
                0.001 1  ErrorFrame
                0.001 1  389 TxRq   d 0
                0.001 CANFD   1 Rx        389  1 0 d 32 00
                0.001 1  Statistic: D 0 R 0 XD 0 XR 0 E 0 O 0 B 0.00%
                0.001 1  0 Rx d f 0 1 2 3 4 5 6 7
             End TriggerBlock",
        );
        let expected = [
            "1506783973207991 can0 605#0AFF00 Rx",
            "1506783973208991 can1 00000185#R0 Tx",
            "1506783973209991 can1 185#R4 Tx",
            "1506783973214991 can0 000#0001020304050607 Rx",
        ];
        assert_eq!(records, expected);
        assert_eq!(skipped, Skipped { fd: 1, errors: 1, other: 2, cut: false });
    }

    #[test]
    fn without_a_date_times_count_from_the_trigger_or_from_zero() {
        let frame = "2.5 1 605 Rx d 1 40";
        let at = |head: &str| read(&format!("{head}\nbase hex timestamps absolute\n{frame}"));
        assert_eq!(at("// no date").0, ["2500000 can0 605#40 Rx"]);
        assert_eq!(at("Begin Triggerblock Thu Jan 1 00:00:01 1970").0, ["3500000 can0 605#40 Rx"]);
        // A date of creation, later than the trigger; and a trigger 2 s after the beginning.
        let made_later = "date Sat Sep 30 15:06:13.191 2017\nBegin Triggerblock Thu Jan 1 00:00:01 1970\n0.0 Start";
        assert_eq!(at(made_later).0, ["3500000 can0 605#40 Rx"]);
        let again = "date Thu Jan 1 00:00:01 1970\nBegin Triggerblock Thu Jan 1 00:00:03 1970";
        assert_eq!(at(again).0, ["3500000 can0 605#40 Rx"]);
        let (records, skipped) = at("date sobota 30 wrze\u{15b}nia 2017");
        assert_eq!((records.len(), skipped.other), (1, 1));
    }

    #[test]
    fn frames_that_cannot_be_are_refused() {
        for line in [
            "0.5 1 605 Rx d 2 40",
            "0.5 1 605 Rx d 1 100",
            "0.5 1 605 Rx d",
            "0.5 1 605 Rx d x 1",
            "0.5 1 800 Rx d 0",
            "0.5 1 20000000x Rx d 0",
            "0.5 1 +5 Rx d 0",
            "0.5 1 605 Rx d 1 +1",
        ] {
            assert_eq!(Read::default().line(line, &mut Skipped::default()), Err(Flaw::Frame), "{line}");
        }
        assert_eq!(Read::default().line("0.5.1 1 605 Rx d 0", &mut Skipped::default()), Err(Flaw::Time));
    }
}
