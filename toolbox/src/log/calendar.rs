//! Dates in logs. No format states its time zone: dates are read and written as UTC.

use lexican_runtime::Instant;

use super::number::{decimal, fixed};
use crate::text::calendar::Civil;

const SECOND: u64 = 1_000_000;

/// Days from 30 December 1899, PEAK's epoch, to 1 January 1970.
pub(super) const DAYS_FROM_1899: u64 = 25_569;

const WEEKDAYS: [&str; 7] = ["Sun", "Mon", "Tue", "Wed", "Thu", "Fri", "Sat"];
const MONTHS: [&str; 12] = ["Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec"];
/// German month names of Vector's tools that differ from English; `M\u{fffd}r` is Latin-1 `M\u{e4}r` decoded as UTF-8.
const GERMAN: [(&str, u64); 6] = [("M\u{e4}r", 3), ("M\u{fffd}r", 3), ("Mrz", 3), ("Mai", 5), ("Okt", 10), ("Dez", 12)];

/// A date in English, as Vector's tools write it: `Sat Sep 30 03:06:13.191 pm 2017`.
pub(super) fn vector(at: Instant) -> String {
    let civil = Civil::of(at);
    let [hours, minutes, seconds, ms] = civil.clock();
    let (weekday, month) = (WEEKDAYS[civil.weekday() as usize % 7], MONTHS[(civil.month as usize + 11) % 12]);
    let (half, hours) = (if hours < 12 { "am" } else { "pm" }, (hours + 11) % 12 + 1);
    format!("{weekday} {month} {} {hours:02}:{minutes:02}:{seconds:02}.{ms:03} {half} {}", civil.day, civil.year)
}

/// Parses a date of Vector's tools: English or German, with 24 hours or with am and pm.
pub(super) fn parse_vector(text: &str) -> Option<Instant> {
    let mut words = text.split_ascii_whitespace().skip(1);
    let month = month(words.next()?)?;
    let day = decimal(words.next()?)?;
    let time = clock(words.next()?)?;
    let mut year = words.next()?;
    let hour = 3600 * SECOND;
    let time = match year.to_ascii_lowercase().as_str() {
        "am" | "pm" if !(hour..13 * hour).contains(&time) => return None,
        "am" => time % (12 * hour),
        "pm" => time % (12 * hour) + 12 * hour,
        _ => time,
    };
    if ["am", "pm"].contains(&year.to_ascii_lowercase().as_str()) {
        year = words.next()?;
    }
    Civil { year: decimal(year)?, month, day, time }.at()
}

fn month(word: &str) -> Option<u64> {
    let english = MONTHS.iter().position(|name| name.eq_ignore_ascii_case(word)).map(|at| at as u64 + 1);
    english.or_else(|| GERMAN.iter().find(|(name, _)| *name == word).map(|(_, month)| *month))
}

/// `15:06:13.191`, with or without a fraction, in microseconds.
fn clock(text: &str) -> Option<u64> {
    let mut parts = text.splitn(3, ':');
    let (hours, minutes, seconds) = (decimal(parts.next()?)?, decimal(parts.next()?)?, fixed(parts.next()?, 6)?);
    let fits = hours < 24 && minutes < 60 && seconds < 60 * SECOND;
    fits.then(|| hours * 3600 * SECOND + minutes * 60 * SECOND + seconds)
}

/// Parses PEAK's dates in comments, `30.09.2017 15:06:13.191.0`, whose last part is tenths of a millisecond.
pub(super) fn parse_peak(date: &str, time: &str) -> Option<Instant> {
    let mut parts = date.splitn(3, '.');
    let (day, month, year) = (decimal(parts.next()?)?, decimal(parts.next()?)?, decimal(parts.next()?)?);
    let mut fractions = time.splitn(3, '.');
    let (seconds, ms) = (fractions.next()?, fractions.next().unwrap_or("0"));
    let tenths = decimal(fractions.next().unwrap_or("0"))?;
    let time = clock(&format!("{seconds}.{ms}"))?.checked_add(tenths.checked_mul(100)?)?;
    Civil { year, month, day, time }.at()
}

/// `2017-09-30` and `15:06:13.191`, in UTC.
pub(super) fn parse_iso(date: &str, time: &str) -> Option<Instant> {
    let mut parts = date.splitn(3, '-');
    let (year, month, day) = (decimal(parts.next()?)?, decimal(parts.next()?)?, decimal(parts.next()?)?);
    Civil { year, month, day, time: clock(time)? }.at()
}

/// A point in time: `2017-09-30T15:06:13.191Z`, the same with a space, or seconds since 1970. All are UTC.
///
/// Errors: [`InvalidTime`] also for dates before 1970 or after the year 9999.
pub fn parse_time(text: &str) -> Result<Instant, InvalidTime> {
    let at = match text.split_once(['T', ' ']) {
        Some((date, time)) => parse_iso(date, time.strip_suffix('Z').unwrap_or(time)),
        None => fixed(text, 6).map(Instant::from_micros).filter(|at| Civil::of(*at).year <= 9999),
    };
    at.ok_or_else(|| InvalidTime { text: text.to_owned() })
}

/// The text is not a point in time.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{text}` is no time; write 2026-09-30T15:06:13Z (UTC), or seconds since 1970")]
pub struct InvalidTime {
    /// The text.
    pub text: String,
}

#[cfg(test)]
mod tests {
    use super::*;

    const AT: Instant = Instant::from_micros(1_506_783_973_191_000);

    #[test]
    fn dates_of_all_writers_are_the_same_point_in_time() {
        for text in
            ["Sat Sep 30 15:06:13.191 2017", "Sat Sep 30 03:06:13.191 PM 2017", "Sat sep 30 03:06:13.191000 pm 2017"]
        {
            assert_eq!(parse_vector(text), Some(AT), "{text}");
        }
        assert_eq!(parse_peak("30.09.2017", "15:06:13.191.0"), Some(AT));
        assert_eq!(parse_iso("2017-09-30", "15:06:13.191"), Some(AT));
        for text in ["2017-09-30T15:06:13.191Z", "2017-09-30 15:06:13.191", "1506783973.191"] {
            assert_eq!(parse_time(text), Ok(AT), "{text}");
        }
        assert_eq!(vector(AT), "Sat Sep 30 03:06:13.191 pm 2017");
        let midnight = parse_vector("Die M\u{e4}r 1 12:00:00 am 2016").unwrap();
        assert_eq!(vector(midnight), "Tue Mar 1 12:00:00.000 am 2016");
        assert_eq!(parse_vector("Sat Dez 31 12:30:00 pm 2016"), parse_iso("2016-12-31", "12:30:00"));
    }

    #[test]
    fn dates_that_do_not_exist_are_refused() {
        for text in
            ["2017-02-29T00:00:00Z", "2017-13-01T00:00:00Z", "1969-12-31T00:00:00Z", "2017-01-01T24:00:00Z", "x"]
        {
            assert!(parse_time(text).is_err(), "{text}");
        }
        assert_eq!(parse_vector("Sat Sep 30 13:06:13 PM 2017"), None);
    }
}
