//! How late this computer runs its threads: the tester's, and those of a device that is simulated on it.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;
use std::time::Instant;

use lexican_runtime::Duration;

/// How often the thread that measures asks to be woken.
const NAP: std::time::Duration = std::time::Duration::from_millis(1);

/// How late this computer has woken its threads, at most. A device simulated on it is as late, which is not its fault.
#[derive(Clone, Debug, Default)]
pub struct HostLateness(Arc<AtomicU64>);

impl HostLateness {
    /// Measures this computer as long as a clone exists.
    ///
    /// A thread asks to be woken each millisecond. On a quiet computer it is late by less than that, which excuses no
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

    /// Notes that a thread was woken late by this time.
    pub fn saw(&self, late: Duration) {
        self.0.fetch_max(late.as_micros(), Ordering::Relaxed);
    }

    /// The largest delay since [`HostLateness::forget`].
    pub(crate) fn most(&self) -> Duration {
        Duration::from_micros(self.0.load(Ordering::Relaxed))
    }

    pub(crate) fn forget(&self) {
        self.0.store(0, Ordering::Relaxed);
    }
}
