//! The machine's time, as the links of real interfaces tell it.

use crate::Instant;

/// The machine's monotonic clock, in microseconds since the link was made.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clock {
    origin: std::time::Instant,
}

impl Clock {
    #[expect(clippy::disallowed_methods, reason = "a link of a real interface tells the machine's time")]
    pub(super) fn new() -> Self {
        Clock { origin: std::time::Instant::now() }
    }

    pub(super) fn now(&self) -> Instant {
        Instant::ZERO + self.origin.elapsed().into()
    }
}

/// Gives the processor away for `span`: for what the operating system cannot tell when it is over.
#[expect(clippy::disallowed_methods, reason = "the wait is for a real device, in real time")]
pub(super) fn pause(span: crate::Duration) {
    std::thread::sleep(span.into());
}
