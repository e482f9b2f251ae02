//! How the shell waits for a link: with its descriptor, and for a deadline.

use std::io;
use std::os::fd::{AsRawFd, RawFd};
use std::sync::Arc;

use tokio::io::Interest;
use tokio::io::unix::AsyncFd;

use super::alarm::Alarm;
use super::looks::Looks;
use crate::host::{Descriptor, Link};
use crate::time::{Duration, Instant};

/// How often a link is looked at all the same: its bus may be back, or gone.
const INSPECTION: Duration = Duration::from_millis(250);

/// What there is to wait for.
pub(super) struct Readiness {
    /// The operating system says when there is something to receive; `None` while the interface is gone.
    watched: Option<AsyncFd<Watched>>,
    /// The link has never had a descriptor: it is looked at.
    looks: Option<Looks>,
    alarm: Alarm,
}

impl Readiness {
    pub(super) fn of(link: &impl Link) -> io::Result<Self> {
        let mut readiness = Readiness { watched: None, looks: Some(Looks::default()), alarm: Alarm::default() };
        readiness.follow(link)?;
        Ok(readiness)
    }

    /// Sees to it that a link that has lost its interface, or found it again, is waited for.
    pub(super) fn follow(&mut self, link: &impl Link) -> io::Result<()> {
        let descriptor = link.descriptor();
        let is_same = match (&self.watched, &descriptor) {
            (Some(watched), Some(descriptor)) => Arc::ptr_eq(&watched.get_ref().0, descriptor),
            (watched, descriptor) => watched.is_none() && descriptor.is_none(),
        };
        if !is_same {
            self.looks = None;
            self.watched = descriptor.map(watch).transpose()?;
        }
        if let Some(looks) = &mut self.looks {
            looks.follow(link);
        }
        Ok(())
    }

    /// Waits until there may be something to receive, or to do: `deadline` has come.
    pub(super) async fn wait(&mut self, now: Instant, deadline: Option<Instant>) {
        if let Some(looks) = &self.looks {
            return looks.wait(&mut self.alarm, now, deadline).await;
        }
        let alarm = self.alarm.ring(now, deadline, INSPECTION);
        let Some(watched) = &self.watched else { return alarm.await };
        // Both are looked at after either.
        tokio::select! {
            readable = watched.readable() => {
                if let Ok(mut ready) = readable {
                    // All there is is taken before the next wait.
                    ready.clear_ready();
                }
            }
            () = alarm => {}
        }
    }

    /// Until when to stay in the link for what comes.
    pub(super) fn until(&self, now: Instant) -> Instant {
        self.looks.as_ref().map_or(now, |looks| looks.until(now))
    }
}

#[expect(deprecated, reason = "unsound only for what does not own its descriptor; its successor is `unsafe`")]
fn watch(descriptor: Descriptor) -> io::Result<AsyncFd<Watched>> {
    AsyncFd::with_interest(Watched(descriptor), Interest::READABLE)
}

/// What is waited for, kept open meanwhile.
struct Watched(Descriptor);

impl AsRawFd for Watched {
    fn as_raw_fd(&self) -> RawFd {
        self.0.as_raw_fd()
    }
}
