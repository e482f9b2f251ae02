//! How old what is shown is.

use lexican_runtime::{Duration, Instant, Measured};

use crate::view;

/// How often state, position and velocity of a drive are read.
pub(crate) const DRIVE: Duration = Duration::from_millis(250);

/// How long the SDO client waits for an answer on a link without latency.
const ANSWER: Duration = Duration::from_secs(1);

/// After how long a value is old that is read every so often over a link of this latency: one reading has failed, and the next one
/// was not answered in time.
pub(crate) fn old_after(every: Duration, latency: Duration) -> Duration {
    (every + latency).times(2) + ANSWER
}

/// When something was as it is shown.
pub(crate) fn shown<T>(seen: &Measured<T>, now: Instant, limit: Duration) -> view::Seen {
    view::Seen { at: seconds(seen.at), is_old: seen.fresh(now, limit).is_none() }
}

/// The time that is so many seconds since the beginning.
pub(crate) fn time(seconds: f64) -> Instant {
    Instant::ZERO + Duration::from_micros((seconds.max(0.0) * 1e6) as u64)
}

/// A time of the model in seconds.
pub(crate) fn seconds(at: Instant) -> f64 {
    at.since(Instant::ZERO).as_secs_f64()
}
