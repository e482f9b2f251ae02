//! The age of values that are shown.

use lexican_runtime::{Duration, Instant, Measured};

use crate::view;

/// The interval of reading state, position and velocity of a drive.
pub(crate) const DRIVE: Duration = Duration::from_millis(250);

/// The timeout of the SDO client on a link without latency.
const ANSWER: Duration = Duration::from_secs(1);

/// The age at which a value that is read at intervals counts as old, over a link with this latency: one reading has
/// failed, and the next one has timed out.
pub(crate) fn old_after(every: Duration, latency: Duration) -> Duration {
    (every + latency).times(2) + ANSWER
}

/// When a value was seen, and whether it is old.
pub(crate) fn shown<T>(seen: &Measured<T>, now: Instant, limit: Duration) -> view::Seen {
    view::Seen { at: seconds(seen.at), is_old: seen.fresh(now, limit).is_none() }
}

/// The time this many seconds after the beginning.
pub(crate) fn time(seconds: f64) -> Instant {
    Instant::ZERO + Duration::from_micros((seconds.max(0.0) * 1e6) as u64)
}

/// Seconds since the beginning.
pub(crate) fn seconds(at: Instant) -> f64 {
    at.since(Instant::ZERO).as_secs_f64()
}
