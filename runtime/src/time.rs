//! Time as the core sees it: a number that the caller passes in. Nothing here reads a clock.

use core::fmt;
use core::num::NonZeroU64;
use core::ops::{Add, AddAssign, Sub, SubAssign};
use core::str::FromStr;

/// A point in time: microseconds since an origin that the caller chooses. Enough for 584 000 years,
/// so nothing here wraps.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
// One more than the microseconds, so that an `Option` takes no more room: a device keeps two dozen deadlines.
pub struct Instant(NonZeroU64);

/// A span of time in microseconds.
#[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Duration(u64);

impl Instant {
    /// The origin.
    pub const ZERO: Instant = Instant(NonZeroU64::MIN);

    /// The last point in time. A wait until then never ends by time.
    pub const MAX: Instant = Instant(NonZeroU64::MAX);

    /// `us` microseconds after the origin.
    #[must_use]
    pub const fn from_micros(us: u64) -> Self {
        Instant(NonZeroU64::MIN.saturating_add(us))
    }

    /// Microseconds since the origin.
    #[must_use]
    pub const fn as_micros(self) -> u64 {
        self.0.get() - 1
    }

    /// The time since `earlier`; zero when `earlier` is later.
    #[must_use]
    pub const fn since(self, earlier: Instant) -> Duration {
        Duration(self.0.get().saturating_sub(earlier.0.get()))
    }
}

/// A value that was measured, and when: so that the last one known is never taken for the present one.
///
/// Who shows it says its [`age`](Measured::age), who judges by it asks whether it is [`fresh`](Measured::fresh).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Measured<T> {
    /// What was measured.
    pub value: T,
    /// When it was measured, not when it was looked up; where that is uncertain, the earliest it can have been.
    pub at: Instant,
}

impl<T> Measured<T> {
    /// `value`, as it was at `at`.
    #[must_use]
    pub const fn new(value: T, at: Instant) -> Self {
        Measured { value, at }
    }

    /// How old it is.
    #[must_use]
    pub const fn age(&self, now: Instant) -> Duration {
        now.since(self.at)
    }

    /// The value, unless it is older than `limit`.
    #[must_use]
    pub fn fresh(&self, now: Instant, limit: Duration) -> Option<&T> {
        (self.age(now) <= limit).then_some(&self.value)
    }

    /// The value, if it was measured at `since` or later. The effect of an order is judged by values measured after it.
    #[must_use]
    pub fn since(&self, since: Instant) -> Option<&T> {
        (self.at >= since).then_some(&self.value)
    }

    /// Applies `f` to the value; the age stays.
    #[must_use]
    pub fn map<U>(self, f: impl FnOnce(T) -> U) -> Measured<U> {
        Measured { value: f(self.value), at: self.at }
    }
}

/// The deadline that is `span` from now; none if that is zero, as with all spans of a dictionary.
#[cfg_attr(target_pointer_width = "32", inline(never))]
pub(crate) fn after(now: Instant, span: Duration) -> Option<Instant> {
    if span.is_zero() { None } else { Some(now + span) }
}

/// Whether a deadline has come; then it is none.
#[cfg_attr(target_pointer_width = "32", inline(never))]
pub(crate) fn expire(deadline: &mut Option<Instant>, now: Instant) -> bool {
    deadline.take_if(|at| *at <= now).is_some()
}

/// Whether a deadline that comes once in each period has come; then it is the next one, without drift unless `now` is
/// late by a whole period.
#[cfg_attr(target_pointer_width = "32", inline(never))]
pub(crate) fn tick(deadline: &mut Option<Instant>, period: Duration, now: Instant) -> bool {
    let Some(last) = deadline.filter(|&at| at <= now) else { return false };
    let next = last + period;
    *deadline = Some(if next > now { next } else { now + period });
    true
}

/// The earliest of some deadlines. Out of `flatten().min()` the compiler makes ten times the instructions, for every
/// frame (tests/bench/instructions.md).
#[inline]
pub(crate) fn earliest(deadlines: impl IntoIterator<Item = Option<Instant>>) -> Option<Instant> {
    deadlines.into_iter().fold(None, sooner)
}

/// The earlier one of two deadlines.
#[cfg_attr(target_pointer_width = "32", inline(never))]
pub(crate) fn sooner(one: Option<Instant>, other: Option<Instant>) -> Option<Instant> {
    NonZeroU64::new(order(one).min(order(other)).wrapping_add(1)).map(Instant)
}

/// A number by which deadlines are in order. None is the number 0, and one less than that is later than all.
#[inline]
fn order(deadline: Option<Instant>) -> u64 {
    deadline.map_or(0, |at| at.0.get()).wrapping_sub(1)
}

impl Duration {
    /// No time at all.
    pub const ZERO: Duration = Duration(0);

    /// `us` microseconds.
    #[must_use]
    pub const fn from_micros(us: u64) -> Self {
        Duration(us)
    }

    /// `n` times 100 us: the unit of inhibit times (CiA 301, 7.5.2.16).
    #[must_use]
    pub const fn from_100us(n: u16) -> Self {
        Duration(n as u64 * 100)
    }

    /// `ms` milliseconds.
    #[must_use]
    pub const fn from_millis(ms: u64) -> Self {
        Duration(ms.saturating_mul(1_000))
    }

    /// `s` seconds.
    #[must_use]
    pub const fn from_secs(s: u64) -> Self {
        Duration(s.saturating_mul(1_000_000))
    }

    /// Microseconds.
    #[must_use]
    pub const fn as_micros(self) -> u64 {
        self.0
    }

    /// Seconds, with their fraction.
    #[must_use]
    pub const fn as_secs_f64(self) -> f64 {
        self.0 as f64 / 1e6
    }

    /// Whether this is no time at all. Many parameters of CiA 301 mean "off" by zero.
    #[must_use]
    pub const fn is_zero(self) -> bool {
        self.0 == 0
    }

    /// `self` taken `n` times, as life time = guard time x life time factor.
    #[must_use]
    pub const fn times(self, n: u32) -> Duration {
        Duration(self.0.saturating_mul(n as u64))
    }
}

impl Default for Instant {
    fn default() -> Self {
        Instant::ZERO
    }
}

/// A text is no time such as `500ms`, `10s`, `0.5s`, `2min` or `0`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no time such as 500ms, 10s, 0.5s or 2min")]
pub struct NoDuration;

/// A number with a unit (us, ms, s, min), or `0`, rounded to microseconds; of less than 30 years.
impl FromStr for Duration {
    type Err = NoDuration;

    fn from_str(text: &str) -> Result<Self, NoDuration> {
        if text == "0" {
            return Ok(Duration::ZERO);
        }
        let (number, micros) = [("us", 1.0), ("ms", 1e3), ("s", 1e6), ("min", 6e7)]
            .into_iter()
            .find_map(|(unit, micros)| Some((text.strip_suffix(unit)?.trim_end(), micros)))
            .ok_or(NoDuration)?;
        let digits = number.bytes().all(|byte| byte.is_ascii_digit() || byte == b'.');
        let number: Option<f64> = number.parse().ok().filter(|_| digits);
        let micros = number.map(|number| number * micros + 0.5).filter(|micros| *micros < 1e15);
        micros.map(|micros| Duration(micros as u64)).ok_or(NoDuration)
    }
}

impl Add<Duration> for Instant {
    type Output = Instant;
    #[cfg_attr(target_pointer_width = "32", inline(never))]
    fn add(self, span: Duration) -> Instant {
        Instant(self.0.saturating_add(span.0))
    }
}

impl AddAssign<Duration> for Instant {
    fn add_assign(&mut self, span: Duration) {
        *self = *self + span;
    }
}

/// Saturates at the origin.
impl Sub<Duration> for Instant {
    type Output = Instant;
    fn sub(self, span: Duration) -> Instant {
        Instant::from_micros(self.as_micros().saturating_sub(span.0))
    }
}

/// [`Instant::since`]: zero when `earlier` is later.
impl Sub for Instant {
    type Output = Duration;
    fn sub(self, earlier: Instant) -> Duration {
        self.since(earlier)
    }
}

impl Add for Duration {
    type Output = Duration;
    fn add(self, other: Duration) -> Duration {
        Duration(self.0.saturating_add(other.0))
    }
}

impl AddAssign for Duration {
    fn add_assign(&mut self, other: Duration) {
        *self = *self + other;
    }
}

/// Saturates at zero.
impl Sub for Duration {
    type Output = Duration;
    fn sub(self, other: Duration) -> Duration {
        Duration(self.0.saturating_sub(other.0))
    }
}

impl SubAssign for Duration {
    fn sub_assign(&mut self, other: Duration) {
        *self = *self - other;
    }
}

impl From<Duration> for core::time::Duration {
    fn from(span: Duration) -> Self {
        core::time::Duration::from_micros(span.0)
    }
}

/// Longer spans than 584 000 years become the longest one.
impl From<core::time::Duration> for Duration {
    fn from(span: core::time::Duration) -> Self {
        Duration(u64::try_from(span.as_micros()).unwrap_or(u64::MAX))
    }
}

/// Seconds with six decimals, as `candump -L` stamps frames.
impl fmt::Display for Instant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let us = self.as_micros();
        write!(f, "{}.{:06}", us / 1_000_000, us % 1_000_000)
    }
}

/// In the largest unit that is not larger than the span, without trailing zeros: `1.5 s`, `20 ms`, `2.5 ms`, `0 s`.
impl fmt::Display for Duration {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            us @ 1..1_000 => write!(f, "{us} us"),
            us @ 1_000..1_000_000 => write_fraction(f, us, 1_000, "ms"),
            us => write_fraction(f, us, 1_000_000, "s"),
        }
    }
}

fn write_fraction(f: &mut fmt::Formatter<'_>, us: u64, unit: u64, name: &str) -> fmt::Result {
    write!(f, "{}", us / unit)?;
    let (mut rest, mut digit) = (us % unit, unit / 10);
    if rest != 0 {
        f.write_str(".")?;
    }
    while rest != 0 {
        write!(f, "{}", rest / digit)?;
        (rest, digit) = (rest % digit, digit / 10);
    }
    write!(f, " {name}")
}

/// As it is displayed.
impl fmt::Debug for Instant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

/// As it is displayed.
impl fmt::Debug for Duration {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::format;

    #[test]
    fn spans_are_printed_in_a_unit_that_fits() {
        let texts = [
            (0, "0 s"),
            (1, "1 us"),
            (999, "999 us"),
            (1_000, "1 ms"),
            (2_500, "2.5 ms"),
            (20_001, "20.001 ms"),
            (1_000_000, "1 s"),
            (1_500_000, "1.5 s"),
            (61_000_050, "61.00005 s"),
            (u64::MAX, "18446744073709.551615 s"),
        ];
        for (us, text) in texts {
            let span = Duration::from_micros(us);
            assert_eq!((format!("{span}"), format!("{span:?}")), (text.into(), text.into()));
        }
        assert_eq!(format!("{:?}", Some(Instant::from_micros(1_500_000))), "Some(1.500000)");
    }

    #[test]
    fn what_was_measured_grows_old() {
        let at = Instant::from_micros;
        let position = Measured::new(7, at(10));
        assert_eq!(position.age(at(15)), Duration::from_micros(5));
        assert_eq!(position.fresh(at(15), Duration::from_micros(5)), Some(&7));
        assert_eq!(position.fresh(at(16), Duration::from_micros(5)), None);
        assert_eq!((position.since(at(10)), position.since(at(11))), (Some(&7), None));
        assert_eq!(position.map(|steps| steps * 2), Measured::new(14, at(10)));
    }

    #[test]
    fn points_in_time_are_subtracted_and_never_wrap() {
        let at = Instant::from_micros;
        let span = Duration::from_micros;
        assert_eq!((at(5) - at(3), at(3) - at(5)), (span(2), Duration::ZERO));
        assert_eq!((at(5) - span(3), at(3) - span(5)), (at(2), Instant::ZERO));
        let (mut sum, mut rest) = (span(5), span(5));
        sum += span(2);
        rest -= span(7);
        assert_eq!((sum, rest), (span(7), Duration::ZERO));
        assert_eq!(at(u64::MAX) + span(1), at(u64::MAX));
    }
}
