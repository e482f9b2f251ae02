//! Durations on the command line.

use lexican_runtime::Duration;

/// A duration in whole milliseconds, rounded down.
pub(crate) fn in_milliseconds(duration: Duration) -> u64 {
    duration.as_micros() / 1000
}

/// Parses whole milliseconds: `500`, `500ms`, `2s`. Up to an hour.
pub(crate) fn milliseconds(text: &str) -> Result<Duration, String> {
    let whole = micros(text, 1e3).filter(|micros| *micros <= HOUR && micros % 1000 == 0);
    whole
        .map(Duration::from_micros)
        .ok_or_else(|| format!("{text:?} is not a number of milliseconds such as 500, or a time such as 500ms or 2s"))
}

/// Parses seconds: `10`, `0.5`, `500ms`, `2min`.
pub(crate) fn seconds(text: &str) -> Result<Duration, String> {
    micros(text, 1e6).map(Duration::from_micros).ok_or_else(|| {
        format!("{text:?} is not a number of seconds such as 10 or 0.5, or a time such as 500ms or 2min")
    })
}

/// Parses a time with its unit: `10ms`, `0.5s`, `250us`; a plain number is in milliseconds. Not zero, and up to an hour.
pub(crate) fn period(text: &str) -> Result<Duration, String> {
    let period = micros(text, 1e3).filter(|micros| (1..=HOUR).contains(micros));
    period.map(Duration::from_micros).ok_or_else(|| format!("{text:?} is not a time such as 10ms, 0.5s or 250us"))
}

/// In microseconds: a longer time that is usually one of milliseconds is a mistake.
const HOUR: u64 = 3_600_000_000;

/// A number with a unit, or a plain one in units of `plain` microseconds, as whole microseconds; of less than 30 years.
fn micros(text: &str, plain: f64) -> Option<u64> {
    let (number, unit) = [("us", 1.0), ("ms", 1e3), ("s", 1e6), ("min", 6e7)]
        .into_iter()
        .find_map(|(unit, micros)| Some((text.strip_suffix(unit)?.trim_end(), micros)))
        .unwrap_or((text, plain));
    let digits = number.bytes().all(|byte| byte.is_ascii_digit() || byte == b'.');
    let number: Option<f64> = number.parse().ok().filter(|_| digits);
    number.map(|number| (number * unit).round()).filter(|micros| *micros < 1e15).map(|micros| micros as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_are_plain_or_have_a_unit() {
        let check = |text: &str, in_ms: Option<u64>, in_s: Option<u64>, as_period: Option<u64>| {
            let micros = |duration: Result<Duration, String>| duration.ok().map(Duration::as_micros);
            let parsed = (micros(milliseconds(text)), micros(seconds(text)), micros(period(text)));
            assert_eq!(parsed, (in_ms, in_s, as_period), "{text:?}");
        };
        check("0", Some(0), Some(0), None);
        check("500", Some(500_000), Some(500_000_000), Some(500_000));
        check("0.5", None, Some(500_000), Some(500));
        check("500ms", Some(500_000), Some(500_000), Some(500_000));
        check("1.5 s", Some(1_500_000), Some(1_500_000), Some(1_500_000));
        check("2min", Some(120_000_000), Some(120_000_000), Some(120_000_000));
        check("250us", None, Some(250), Some(250));
        check("0ms", Some(0), Some(0), None);
        check("3600001", None, Some(3_600_001_000_000), None);
        check("3601s", None, Some(3_601_000_000), None);
        for text in ["", "s", "-1", "-1ms", "+1", "+1s", "1e3", "1e3ms", "1m", "1h", "NaN", "inf", ".", "1.2.3"] {
            check(text, None, None, None);
        }
        check("10000000000", None, None, None);
    }
}
