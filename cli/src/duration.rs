//! Durations on the command line.

use lexican_runtime::Duration;

/// A duration in whole milliseconds, rounded down.
pub(crate) fn in_milliseconds(duration: Duration) -> u64 {
    duration.as_micros() / 1000
}

/// Parses whole milliseconds: `500`.
pub(crate) fn milliseconds(text: &str) -> Result<Duration, String> {
    let ms = text.parse().ok().filter(|_| !text.starts_with('+'));
    // More than an hour is a mistake.
    let ms = ms.filter(|ms| *ms <= 3_600_000).map(Duration::from_millis);
    ms.ok_or_else(|| format!("{text:?} is not a number of milliseconds such as 500"))
}

/// Parses seconds: `10`, `0.5`.
pub(crate) fn seconds(text: &str) -> Result<Duration, String> {
    let digits = text.bytes().all(|byte| byte.is_ascii_digit() || byte == b'.');
    let seconds = text.parse().ok().filter(|seconds: &f64| digits && *seconds < 1e9);
    let seconds = seconds.map(|seconds| Duration::from_micros((seconds * 1e6).round() as u64));
    seconds.ok_or_else(|| format!("{text:?} is not a number of seconds such as 10 or 0.5"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_are_numbers_of_their_unit() {
        let check = |text: &str, ms: Option<u64>, s: Option<u64>| {
            let micros = |duration: Result<Duration, String>| duration.ok().map(Duration::as_micros);
            assert_eq!((micros(milliseconds(text)), micros(seconds(text))), (ms, s), "{text:?}");
        };
        check("0", Some(0), Some(0));
        check("500", Some(500_000), Some(500_000_000));
        check("0.5", None, Some(500_000));
        check("3600001", None, Some(3_600_001_000_000));
        for text in ["", "1s", "-1", "+1", "1e3", "NaN", "inf", ".", "1.2.3", "10000000000"] {
            check(text, None, None);
        }
    }
}
