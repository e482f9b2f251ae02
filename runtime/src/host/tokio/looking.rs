//! How the shell waits for a link where there are no descriptors.

use std::io;

use super::alarm::Alarm;
use super::looks::Looks;
use crate::host::Link;
use crate::time::Instant;

/// What there is to wait for: time.
#[derive(Default)]
pub(super) struct Readiness {
    looks: Looks,
    alarm: Alarm,
}

impl Readiness {
    pub(super) fn of(link: &impl Link) -> io::Result<Self> {
        let mut readiness = Readiness::default();
        readiness.follow(link)?;
        Ok(readiness)
    }

    pub(super) fn follow(&mut self, link: &impl Link) -> io::Result<()> {
        self.looks.follow(link);
        Ok(())
    }

    pub(super) async fn wait(&mut self, now: Instant, deadline: Option<Instant>) {
        self.looks.wait(&mut self.alarm, now, deadline).await;
    }

    /// Until when to stay in the link for what comes.
    pub(super) fn until(&self, now: Instant) -> Instant {
        self.looks.until(now)
    }
}
