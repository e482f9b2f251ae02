//! Parses durations as users write them.

use lexican_runtime::Duration;

/// In whole milliseconds, rounded down.
pub fn in_milliseconds(duration: Duration) -> u64 {
    duration.as_micros() / 1000
}

/// Parses a duration: `10s`, `0.5s`, `500ms`, `2min`, `0`.
pub fn time(text: &str) -> Result<Duration, String> {
    text.parse().map_err(|_| match text.bytes().all(|byte| byte.is_ascii_digit()) {
        true if !text.is_empty() => format!("{text} of what? write {text}ms, {text}s or {text}min"),
        _ => format!("{text:?} is not a time such as 500ms, 10s, 0.5s or 2min"),
    })
}

/// Parses a duration in whole milliseconds, up to an hour.
pub fn milliseconds(text: &str) -> Result<Duration, String> {
    let whole = |time: &Duration| time.as_micros() <= HOUR && time.as_micros().is_multiple_of(1000);
    let wrong = || format!("{text} is not a time of whole milliseconds, up to an hour");
    time(text).and_then(|time| Some(time).filter(whole).ok_or_else(wrong))
}

/// Parses a duration that is not zero, up to an hour.
pub fn period(text: &str) -> Result<Duration, String> {
    let is_period = |time: &Duration| (1..=HOUR).contains(&time.as_micros());
    time(text).and_then(|time| {
        Some(time).filter(is_period).ok_or_else(|| format!("{text} is not a time above zero, up to an hour"))
    })
}

/// In µs. A longer duration where milliseconds are usual is a mistake.
const HOUR: u64 = 3_600_000_000;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_have_a_unit() {
        let check = |text: &str, any: Option<u64>, in_ms: Option<u64>, as_period: Option<u64>| {
            let micros = |duration: Result<Duration, String>| duration.ok().map(Duration::as_micros);
            let parsed = (micros(time(text)), micros(milliseconds(text)), micros(period(text)));
            assert_eq!(parsed, (any, in_ms, as_period), "{text:?}");
        };
        check("0", Some(0), Some(0), None);
        check("500ms", Some(500_000), Some(500_000), Some(500_000));
        check("1.5 s", Some(1_500_000), Some(1_500_000), Some(1_500_000));
        check("2min", Some(120_000_000), Some(120_000_000), Some(120_000_000));
        check("250us", Some(250), None, Some(250));
        check("0ms", Some(0), Some(0), None);
        check("3601s", Some(3_601_000_000), None, None);
        for text in ["", "s", "500", "0.5", "-1ms", "+1s", "1e3ms", "1m", "1h", "NaN", "infs", ".s", "1.2.3s"] {
            check(text, None, None, None);
        }
        check("10000000000s", None, None, None);
        assert_eq!(time("500"), Err("500 of what? write 500ms, 500s or 500min".to_owned()));
    }
}
