//! PEAK TRC: comments with version and start, then one numbered line per frame, whose columns depend on the version: `
//! 1      1059.900 DT 1      0605 Rx -  8    40 7C 60 00 00 00 00 00`.

use std::io::Write as _;

use lexican_runtime::{CobId, Frame, Instant};

use crate::log::calendar::DAYS_FROM_1899;
use crate::log::channel::{Channels, Interfaces};
use crate::log::codec::{Encode, Lines, Skipped, WriteError};
use crate::log::input::Flaw;
use crate::log::number::{decimal, fixed, hex};
use crate::log::{Direction, Record, calendar};
use crate::text::calendar::{Civil, DAY};

/// A column, with its letter in `$COLUMNS` of version 2; older versions have fixed columns. Data is always last.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Column {
    /// `N`, and columns that are not used.
    Other,
    /// `O`: the time in milliseconds since the start.
    Offset,
    /// `T`: the kind of frame.
    Type,
    /// `B`
    Bus,
    /// `I`: an identifier of four digits, or of more.
    Id,
    /// `d`: Rx, Tx, or in version 1 a warning or an error.
    Direction,
    /// `l` or `L`: the length.
    Length,
}

use Column::{Bus, Direction as Way, Id, Length, Offset, Other, Type};

const fn columns(version: TrcVersion) -> &'static [Column] {
    match version {
        TrcVersion::V1_0 => &[Other, Offset, Id, Length],
        TrcVersion::V1_1 => &[Other, Offset, Way, Id, Length],
        TrcVersion::V1_3 => &[Other, Offset, Bus, Way, Id, Other, Length],
        TrcVersion::V2_0 => &[Other, Offset, Type, Id, Way, Length],
        TrcVersion::V2_1 => &[Other, Offset, Type, Bus, Id, Way, Other, Length],
    }
}

/// The columns of version 1.2: with a bus, but without a reserved column.
const COLUMNS_1_2: &[Column] = &[Other, Offset, Bus, Way, Id, Length];

/// A version of PEAK's TRC.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum TrcVersion {
    /// 1.0: times in milliseconds, no date, direction or channel.
    V1_0,
    /// 1.1: times in tenths of a millisecond, no channel.
    V1_1,
    /// 1.3
    V1_3,
    /// 2.0: no channel.
    V2_0,
    /// 2.1
    #[default]
    V2_1,
}

pub(super) struct Read {
    columns: Vec<Column>,
    start: Instant,
    interfaces: Interfaces,
}

impl Default for Read {
    fn default() -> Self {
        // Files of version 1.0 do not state their version.
        Read { columns: columns(TrcVersion::V1_0).to_vec(), start: Instant::ZERO, interfaces: Interfaces::default() }
    }
}

impl Lines for Read {
    fn line(&mut self, line: &str, skipped: &mut Skipped) -> Result<Option<Record>, Flaw> {
        if let Some(comment) = line.strip_prefix(';') {
            self.comment(comment.trim(), skipped)?;
            return Ok(None);
        }
        if line.is_empty() {
            return Ok(None);
        }
        let mut words = line.split_ascii_whitespace();
        let (mut offset, mut kind, mut channel, mut id) = (None, "DT", 1, "");
        let (mut direction, mut len) = ("Rx", None);
        for column in &self.columns {
            let Some(word) = words.next() else { break };
            match column {
                Other => {}
                Offset => offset = Some(fixed(word, 3).ok_or(Flaw::Time)?),
                Type => kind = word,
                Bus => channel = decimal(word).and_then(|bus| u16::try_from(bus).ok()).unwrap_or(1),
                Id => id = word,
                Way => direction = word,
                Length => len = Some(word),
            }
            // Events that are not classic frames have other columns from here on.
            match column {
                Type if matches!(word, "FD" | "FB" | "FE" | "BI") => {
                    skipped.fd += 1;
                    return Ok(None);
                }
                Type if word == "ER" => {
                    skipped.errors += 1;
                    return Ok(None);
                }
                Type if !matches!(word, "DT" | "RR") => {
                    skipped.other += 1;
                    return Ok(None);
                }
                Way if Direction::of_word(word).is_none() => {
                    let is_error = matches!(&*word.to_ascii_lowercase(), "error" | "warng" | "warning");
                    skipped.errors += u64::from(is_error);
                    skipped.other += u64::from(!is_error);
                    return Ok(None);
                }
                Id if word == "FFFFFFFF" => {
                    skipped.errors += 1;
                    return Ok(None);
                }
                _ => {}
            }
        }
        let len = len.and_then(decimal).and_then(|len| u8::try_from(len).ok()).ok_or(Flaw::Frame)?.min(8);
        let id = cob_id(id).ok_or(Flaw::Frame)?;
        let mut words = words.peekable();
        let frame = if kind == "RR" || words.peek() == Some(&"RTR") {
            Frame::remote(id, len)
        } else {
            let mut bytes = [0; 8];
            for byte in &mut bytes[..usize::from(len)] {
                let value = words.next().and_then(hex).and_then(|value| u8::try_from(value).ok());
                *byte = value.ok_or(Flaw::Frame)?;
            }
            Frame::new(id, &bytes[..usize::from(len)])
        };
        // The offset is in microseconds: milliseconds with three decimals.
        let at = self.start.as_micros().saturating_add(offset.ok_or(Flaw::Time)?);
        let at = Instant::from_micros(at);
        let direction = Direction::of_word(direction).unwrap_or_default();
        let record = |frame| Record { at, interface: self.interfaces.of(channel), direction, frame };
        frame.map(record).map(Some).ok_or(Flaw::Frame)
    }
}

impl Read {
    fn comment(&mut self, comment: &str, skipped: &mut Skipped) -> Result<(), Flaw> {
        if let Some(version) = comment.strip_prefix("$FILEVERSION=") {
            self.columns = match version.trim() {
                "1.0" => columns(TrcVersion::V1_0),
                "1.1" => columns(TrcVersion::V1_1),
                "1.2" => COLUMNS_1_2,
                "1.3" => columns(TrcVersion::V1_3),
                "2.0" => columns(TrcVersion::V2_0),
                "2.1" => columns(TrcVersion::V2_1),
                other => {
                    let (major, minor) = other.split_once('.').unwrap_or((other, "0"));
                    let number = |digits: &str| digits.parse().unwrap_or(0);
                    return Err(Flaw::Version { major: number(major), minor: number(minor) });
                }
            }
            .to_vec();
        } else if let Some(names) = comment.strip_prefix("$COLUMNS=") {
            let all = names.split(',').map(|name| match name.trim() {
                "O" => Offset,
                "T" => Type,
                "B" => Bus,
                "I" => Id,
                "d" => Way,
                "l" | "L" => Length,
                _ => Other,
            });
            // Data is last, and its length is that of the frame.
            self.columns = all.take(names.trim_end().strip_suffix(",D").unwrap_or(names).split(',').count()).collect();
            if [Offset, Id, Length].iter().any(|needed| !self.columns.contains(needed)) {
                return Err(Flaw::Columns);
            }
        } else if let Some(days) = comment.strip_prefix("$STARTTIME=") {
            match since_1899(days.trim()) {
                Some(start) => self.start = start,
                None => skipped.other += 1,
            }
        } else if let Some(date) = comment.strip_prefix("Start time:")
            && self.start == Instant::ZERO
        {
            // Only in version 1.0; other versions have stated the start before.
            let mut words = date.split_ascii_whitespace();
            if let (Some(date), Some(time)) = (words.next(), words.next()) {
                self.start = calendar::parse_peak(date, time).unwrap_or_default();
            }
        }
        Ok(())
    }
}

fn cob_id(word: &str) -> Option<CobId> {
    let number = hex(word)?;
    if word.len() > 4 { CobId::extended(number) } else { CobId::standard(u16::try_from(number).ok()?) }
}

/// Days since 30 December 1899, with microsecond resolution.
fn since_1899(days: &str) -> Option<Instant> {
    /// The decimals of a day that are read; the last one is 86 ns.
    const PLACES: u32 = 12;
    let (whole, fraction) = days.split_once('.').unwrap_or((days, "0"));
    let whole = decimal(whole)?.checked_sub(DAYS_FROM_1899)?.checked_mul(DAY)?;
    let parts = u128::from(fixed(&format!("0.{fraction}"), PLACES)?);
    let unit = 10u128.pow(PLACES);
    let us = (parts * u128::from(DAY) + unit / 2) / unit;
    Some(Instant::from_micros(whole.checked_add(us as u64)?))
}

fn to_days(at: Instant) -> String {
    let (days, us) = (at.as_micros() / DAY + DAYS_FROM_1899, u128::from(at.as_micros() % DAY));
    format!("{days}.{:012}", us * 10u128.pow(12) / u128::from(DAY))
}

pub(super) struct Write {
    version: TrcVersion,
    start: Option<Instant>,
    number: u64,
    channels: Channels,
}

impl Write {
    pub(super) fn new(version: TrcVersion) -> Self {
        Write { version, start: None, number: 0, channels: Channels::default() }
    }

    fn begin(&mut self, out: &mut Vec<u8>, at: Instant) -> Instant {
        if let Some(start) = self.start {
            return start;
        }
        self.start = Some(at);
        let version = match self.version {
            TrcVersion::V1_0 => None,
            TrcVersion::V1_1 => Some("1.1"),
            TrcVersion::V1_3 => Some("1.3"),
            TrcVersion::V2_0 => Some("2.0"),
            TrcVersion::V2_1 => Some("2.1"),
        };
        let mut head = String::new();
        if let Some(version) = version {
            head = format!(";$FILEVERSION={version}\r\n;$STARTTIME={}\r\n", to_days(at));
        }
        match self.version {
            TrcVersion::V2_0 => head += ";$COLUMNS=N,O,T,I,d,L,D\r\n",
            TrcVersion::V2_1 => head += ";$COLUMNS=N,O,T,B,I,d,R,L,D\r\n",
            _ => {}
        }
        let civil = Civil::of(at);
        let [hours, minutes, seconds, ms] = civil.clock();
        let tenths = civil.time % 1000 / 100;
        head += &format!(
            ";\r\n;   Start time: {:02}.{:02}.{} {hours:02}:{minutes:02}:{seconds:02}.{ms:03}.{tenths}\r\n\
             ;   Generated by lexican\r\n;---+--   ----+----  --+--  +  -+ -- -- -- -- -- -- --\r\n",
            civil.day, civil.month, civil.year
        );
        out.extend(head.bytes());
        at
    }
}

impl Encode for Write {
    fn record(&mut self, out: &mut Vec<u8>, record: &Record) -> Result<(), WriteError> {
        let Record { at, interface, direction, frame } = record;
        let (channel, start) = (self.channels.of(interface)?, self.begin(out, *at));
        self.number += 1;
        let number = self.number;
        let us = at.since(start).as_micros();
        let (ms, fraction) = (us / 1000, us % 1000);
        let way = direction.word();
        let raw = frame.id().raw();
        let id = if frame.id().is_extended() { format!("{raw:08X}") } else { format!("{raw:04X}") };
        let (len, kind) = (frame.dlc(), if frame.is_remote() { "RR" } else { "DT" });
        match self.version {
            TrcVersion::V1_0 => write!(out, "{number:>6})  {ms:>8}  {id:>8}  {len}  ")?,
            TrcVersion::V1_1 => write!(out, "{number:>6})  {ms:>8}.{}  {way}    {id:>8}  {len}  ", fraction / 100)?,
            TrcVersion::V1_3 => {
                write!(out, "{number:>6})  {ms:>8}.{fraction:03} {channel}  {way}    {id:>8} -  {len}    ")?;
            }
            TrcVersion::V2_0 => write!(out, "{number:>7} {ms:>9}.{fraction:03} {kind} {id:>8} {way} {len}  ")?,
            TrcVersion::V2_1 => {
                write!(out, "{number:>7} {ms:>9}.{fraction:03} {kind} {channel:>2} {id:>8} {way} -  {len}    ")?;
            }
        }
        if frame.is_remote() && !matches!(self.version, TrcVersion::V2_0 | TrcVersion::V2_1) {
            write!(out, "RTR ")?;
        }
        frame.data().iter().try_for_each(|byte| write!(out, "{byte:02X} "))?;
        write!(out, "\r\n")?;
        Ok(())
    }

    fn finish(&mut self, out: &mut Vec<u8>) {
        self.begin(out, Instant::ZERO);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(lines: &str) -> (Vec<String>, Skipped) {
        crate::log::codec::read::<Read>(lines)
    }

    #[test]
    fn every_version_is_read() {
        let expected = ["1059900 can0 300#0001 Rx", "1060000 can0 18FEE900#R3 Rx"];
        let versions = [
            ";    Columns\n 1) 1059 0300 2 00 01\n 2) 1060 18FEE900 3 RTR\n 3) 1061 FFFFFFFF 4 00 00 00 08 BUSHEAVY",
            ";$FILEVERSION=1.1\n;$STARTTIME=25569\n 1) 1059.9 Rx 0300 2 00 01 \n 2) 1060.0 Rx 18FEE900 3 RTR\n \
             3) 1061.0 Error 0300 2 00 01",
            ";$FILEVERSION=1.2\n 1) 1059.900 1 Rx 0300 2 00 01\n 2) 1060.0 1 Rx 18FEE900 3 RTR\n 3) 1061.0 1 Warng FFFFFFFF 4",
            ";$FILEVERSION=1.3\n 1) 1059.900 1 Rx 0300 - 2 00 01\n 2) 1060.0 1 Rx 18FEE900 - 3 RTR\n 3) 1061.0 1 Error 1",
            ";$FILEVERSION=2.0\n;$COLUMNS=N,O,T,I,d,l,D\n 1 1059.900 DT 0300 Rx 2 00 01\n 2 1060.000 RR 18FEE900 Rx 3\n \
             3 1061.000 ER Rx 04 00",
            ";$FILEVERSION=2.1\n;$COLUMNS=N,O,T,B,I,d,R,L,D\n 1 1059.900 DT 1 0300 Rx - 2 00 01\n \
             2 1060.000 RR 1 18FEE900 Rx - 3\n 3 1061.000 ER 1 - Rx - 5 04 00",
        ];
        for (number, lines) in versions.into_iter().enumerate() {
            let (mut records, skipped) = read(lines);
            if number == 0 {
                records[0] = records[0].replace("1059000", "1059900");
            }
            assert_eq!(records, expected, "{lines}");
            assert_eq!(skipped, Skipped { errors: 1, ..Skipped::default() }, "{lines}");
        }
        let (records, skipped) = read(
            ";$FILEVERSION=2.1\n;$COLUMNS=N,O,T,B,I,d,R,L,D\n 1 1.0 FD 1 0300 Rx - 9 00\n 2 1.0 ST 1 - - - 4 00\n \
             3 1.0 DT 2 0300 Tx - 0",
        );
        assert_eq!((records, skipped.fd, skipped.other), (vec!["1000 can1 300# Tx".to_owned()], 1, 1));
    }

    #[test]
    fn the_start_is_read_to_the_microsecond() {
        for us in [0, 1, 999_999, 86_399_999_999, 1_506_783_973_191_234] {
            let at = Instant::from_micros(us);
            assert_eq!(since_1899(&to_days(at)), Some(at), "{}", to_days(at));
        }
        let comment = ";   Start time: 30.09.2017 15:06:13.191.2\n 1) 1 0300 0";
        assert_eq!(read(comment).0, ["1506783973192200 can0 300# Rx"]);
    }

    #[test]
    fn what_cannot_be_read_is_refused() {
        for (lines, flaw) in [
            (";$FILEVERSION=3.1", Flaw::Version { major: 3, minor: 1 }),
            (";$COLUMNS=N,O,T", Flaw::Columns),
            ("1) x 0300 0", Flaw::Time),
            ("1) 1 0300", Flaw::Frame),
            ("1) 1 0800 0", Flaw::Frame),
            ("1) 1 0300 2 00", Flaw::Frame),
            ("1) 1 0300 1 100", Flaw::Frame),
        ] {
            assert_eq!(Read::default().line(lines, &mut Skipped::default()), Err(flaw), "{lines}");
        }
    }
}
