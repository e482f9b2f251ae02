//! How late this computer is with all that it runs: the tester, and a device that runs on it as well.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;
use std::time::Instant;

use lexican_runtime::Duration;

/// How often this computer is asked to wake somebody.
const NAP: std::time::Duration = std::time::Duration::from_millis(1);

/// By how much this computer wakes others too late, at most. A device that runs on it is as late, and not by its own fault.
#[derive(Clone, Debug, Default)]
pub struct HostLateness(Arc<AtomicU64>);

impl HostLateness {
    /// Watches this computer, as long as a clone of it is left.
    ///
    /// A thread that wants to be woken each millisecond: on a quiet computer it is late by less than that, which excuses no
    /// device.
    #[expect(clippy::disallowed_methods, reason = "how late a thread wakes is what is measured")]
    #[must_use]
    pub fn watched() -> Self {
        let lateness = Self::default();
        let most = Arc::downgrade(&lateness.0);
        let watch = move || loop {
            let begun = Instant::now();
            thread::sleep(NAP);
            let Some(most) = most.upgrade() else { break };
            HostLateness(most).saw(begun.elapsed().saturating_sub(NAP).into());
        };
        // Without the thread nothing is excused.
        let _ = thread::Builder::new().spawn(watch);
        lateness
    }

    /// Somebody was woken too late by so much.
    pub fn saw(&self, late: Duration) {
        self.0.fetch_max(late.as_micros(), Ordering::Relaxed);
    }

    /// The most since it was forgotten.
    pub(crate) fn most(&self) -> Duration {
        Duration::from_micros(self.0.load(Ordering::Relaxed))
    }

    pub(crate) fn forget(&self) {
        self.0.store(0, Ordering::Relaxed);
    }
}
