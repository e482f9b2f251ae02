//! TIME_OF_DAY (CiA 301, 7.1.6.5) as text: `2026-11-23 12:00:00.500`.

use lexican_runtime::Instant;
use lexican_runtime::object::TimeOfDay;

use super::calendar::{Civil, DAY};

const MS_PER_DAY: u64 = 86_400_000;

/// Days from 1 January 1970 to 1 January 1984, the epoch of TIME_OF_DAY.
const EPOCH: u64 = 5113;

/// Converts milliseconds since 1970 in UTC; `None` before 1984, and from 2163 on, when the days exceed 16 bits.
#[must_use]
pub fn of_unix(ms: u64) -> Option<TimeOfDay> {
    let days = (ms / MS_PER_DAY).checked_sub(EPOCH)?;
    Some(TimeOfDay { days: u16::try_from(days).ok()?, ms: (ms % MS_PER_DAY) as u32 })
}

/// Milliseconds since 1970.
#[must_use]
pub fn to_unix(time: TimeOfDay) -> u64 {
    (u64::from(time.days) + EPOCH) * MS_PER_DAY + u64::from(time.ms)
}

/// The time plus `ms` milliseconds; `None` if the days exceed 16 bits.
#[must_use]
pub fn later(time: TimeOfDay, ms: u64) -> Option<TimeOfDay> {
    let total = u64::from(time.ms).checked_add(ms)?;
    let days = u64::from(time.days) + total / MS_PER_DAY;
    Some(TimeOfDay { days: u16::try_from(days).ok()?, ms: (total % MS_PER_DAY) as u32 })
}

/// Parses a date with or without time, seconds and milliseconds, separated by a blank or a T: `2026-11-23 12:00`.
/// `None` for other texts, and for dates that TIME_OF_DAY cannot express.
#[must_use]
pub fn parse(text: &str) -> Option<TimeOfDay> {
    let (date, time) = text.trim().split_once([' ', 'T']).unwrap_or((text.trim(), "00:00"));
    let [year, month, day] = numbers(date, '-')?;
    let midnight = Civil { year, month, day, time: 0 }.at()?;
    let days = (midnight.as_micros() / DAY).checked_sub(EPOCH)?;
    Some(TimeOfDay { days: u16::try_from(days).ok()?, ms: of_day(time.trim())? })
}

/// `2026-11-23 12:00:00.500`. If a device sends more milliseconds than a day has, the hours exceed 23.
#[must_use]
pub fn text(time: TimeOfDay) -> String {
    let Civil { year, month, day, .. } = Civil::of(Instant::from_micros((u64::from(time.days) + EPOCH) * DAY));
    let (seconds, ms) = (time.ms / 1000, time.ms % 1000);
    let (hours, minutes, seconds) = (seconds / 3600, seconds / 60 % 60, seconds % 60);
    format!("{year}-{month:02}-{day:02} {hours:02}:{minutes:02}:{seconds:02}.{ms:03}")
}

/// Parses a time; in milliseconds since midnight.
fn of_day(text: &str) -> Option<u32> {
    let (clock, fraction) = text.split_once('.').unwrap_or((text, "0"));
    let [hours, minutes, seconds] = match numbers(clock, ':') {
        Some(all) => all,
        None => numbers::<2>(clock, ':').map(|[hours, minutes]| [hours, minutes, 0])?,
    };
    let is_time = hours < 24 && minutes < 60 && seconds < 60;
    let is_fraction = (1..=3).contains(&fraction.len()) && fraction.bytes().all(|byte| byte.is_ascii_digit());
    let ms: u64 = format!("{fraction:0<3}").parse().ok().filter(|_| is_time && is_fraction)?;
    u32::try_from(((hours * 60 + minutes) * 60 + seconds) * 1000 + ms).ok()
}

/// Unsigned numbers between separators.
fn numbers<const N: usize>(text: &str, separator: char) -> Option<[u64; N]> {
    let number = |digits: &str| digits.parse().ok().filter(|_| digits.bytes().all(|byte| byte.is_ascii_digit()));
    text.split(separator).map(number).collect::<Option<Vec<u64>>>()?.try_into().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_read_back_as_written() {
        for (text, days, ms) in [
            ("1984-01-01 00:00:00.000", 0, 0),
            ("1984-03-01 00:00:00.001", 60, 1),
            ("2026-11-23 12:34:56.789", 15_667, 45_296_789),
            ("2100-03-01 23:59:59.999", 42_428, 86_399_999),
            ("2163-06-06 00:00:00.000", 65_535, 0),
        ] {
            let time = TimeOfDay { days, ms };
            assert_eq!((parse(text), self::text(time).as_str()), (Some(time), text), "{text}");
        }
        for (short, whole) in
            [("2026-11-23", "2026-11-23 00:00:00.000"), ("2026-11-23T12:00", "2026-11-23 12:00:00.000")]
        {
            assert_eq!(parse(short), parse(whole), "{short}");
        }
        assert_eq!(parse("2026-11-23 12:00:00.5"), parse("2026-11-23 12:00:00.500"));
    }

    #[test]
    fn what_is_no_time_is_refused() {
        for text in [
            "",
            "now",
            "1983-12-31",
            "2163-06-07",
            "2026-13-01",
            "2026-02-29",
            "2026-11-23 24:00",
            "2026-11-23 12",
            "2026-1+1-1",
        ] {
            assert_eq!(parse(text), None, "{text}");
        }
    }

    #[test]
    fn the_time_of_a_machine_counts_from_1970() {
        let midnight = parse("2026-11-23").unwrap();
        assert_eq!(of_unix(1_795_392_000_000), Some(midnight));
        assert_eq!((of_unix(0), later(midnight, 86_400_500)), (None, parse("2026-11-24 00:00:00.5")));
        assert_eq!(later(TimeOfDay { days: u16::MAX, ms: 1 }, MS_PER_DAY), None);
    }
}
