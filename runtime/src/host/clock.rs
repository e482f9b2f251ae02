//! The machine's time, for the links of real interfaces.

use crate::{Duration, Instant};

/// The machine's monotonic clock, in microseconds since the link was made.
#[derive(Clone, Debug)]
pub(super) struct Clock {
    origin: std::time::Instant,
}

impl Clock {
    #[expect(clippy::disallowed_methods, reason = "a link of a real interface has the machine's time")]
    pub(super) fn new() -> Self {
        Clock { origin: std::time::Instant::now() }
    }

    pub(super) fn now(&self) -> Instant {
        Instant::ZERO + self.origin.elapsed().into()
    }
}

/// Sleeps for `span`, if the operating system offers nothing to wait for.
#[expect(clippy::disallowed_methods, reason = "the wait is for a real device, in real time")]
pub(super) fn pause(span: Duration) {
    std::thread::sleep(span.into());
}
