//! The machine's time, as the links of real interfaces tell it.

use core::cell::Cell;

use crate::{Duration, Instant};

/// The machine's monotonic clock, in microseconds since the link was made.
#[derive(Clone, Debug)]
pub(super) struct Clock {
    origin: std::time::Instant,
    /// The time that was told last.
    told: Cell<Instant>,
}

impl Clock {
    #[expect(clippy::disallowed_methods, reason = "a link of a real interface tells the machine's time")]
    pub(super) fn new() -> Self {
        Clock { origin: std::time::Instant::now(), told: Cell::new(Instant::ZERO) }
    }

    pub(super) fn now(&self) -> Instant {
        let now = Instant::ZERO + self.origin.elapsed().into();
        self.told.set(now);
        now
    }

    /// How long it is until `until`. Shells look with the time that they have just been told: that is over, and
    /// the clock need not be read again, which takes a system call where the kernel is a guest.
    #[cfg(any(feature = "slcan", all(feature = "socketcan", target_os = "linux")))]
    pub(super) fn until(&self, until: Instant) -> Duration {
        if until <= self.told.get() { Duration::ZERO } else { until.since(self.now()) }
    }
}

/// Gives the processor away for `span`: for what the operating system cannot tell when it is over.
#[expect(clippy::disallowed_methods, reason = "the wait is for a real device, in real time")]
pub(super) fn pause(span: Duration) {
    std::thread::sleep(span.into());
}
