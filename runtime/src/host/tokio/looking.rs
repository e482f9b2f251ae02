//! How the shell waits for a link where there are no descriptors: it looks.

use std::io;

use super::LOOK;
use crate::host::Link;
use crate::time::{Duration, Instant};

/// What there is to wait for: nothing.
pub(super) struct Readiness;

impl Readiness {
    pub(super) const fn of(_: &impl Link) -> io::Result<Self> {
        Ok(Readiness)
    }

    pub(super) const fn follow(&mut self, _: &impl Link) -> io::Result<()> {
        Ok(())
    }

    pub(super) async fn wait(&mut self, _: Instant, _: Option<Instant>) {
        tokio::task::yield_now().await;
    }

    /// How long to stay in the link for what comes.
    pub(super) const fn patience(&self) -> Duration {
        LOOK
    }
}
