//! Stops a change-over before all drives are in position.

use std::sync::{Arc, Mutex, MutexGuard};

use lexican_runtime::Instant;
use tokio::sync::Notify;

/// Stops the change-over. The first reason counts. Clones belong to the same change-over.
#[derive(Clone, Default)]
pub(crate) struct Stop(Arc<(Mutex<Option<Reason>>, Notify)>);

/// Why all drives are stopped.
#[derive(Clone, Debug)]
pub(crate) enum Reason {
    /// SIGINT or SIGTERM.
    Signal,
    /// This drive has not reached its target.
    Drive { name: String, outcome: &'static str, why: String, at: Instant },
}

impl Stop {
    pub(crate) fn order(&self, reason: Reason) {
        self.first().get_or_insert(reason);
        self.0.1.notify_waiters();
    }

    pub(crate) fn reason(&self) -> Option<Reason> {
        self.first().clone()
    }

    pub(crate) async fn ordered(&self) {
        // From here on, no order is missed.
        let notified = self.0.1.notified();
        if self.reason().is_none() {
            notified.await;
        }
    }

    fn first(&self) -> MutexGuard<'_, Option<Reason>> {
        self.0.0.lock().expect("nothing panics with it")
    }
}
