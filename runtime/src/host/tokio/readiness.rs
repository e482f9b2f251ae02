//! How the shell waits for a link: with its descriptor, and for a deadline.

use std::boxed::Box;
use std::io;
use std::os::fd::{AsRawFd, RawFd};
use std::pin::Pin;
use std::sync::Arc;

use tokio::io::Interest;
use tokio::io::unix::AsyncFd;
use tokio::time::Sleep;

use super::LOOK;
use crate::host::{Descriptor, Link};
use crate::time::{Duration, Instant};

/// How often a link is looked at all the same: its bus may be back, or gone.
const INSPECTION: Duration = Duration::from_millis(250);

/// What there is to wait for.
pub(super) struct Readiness {
    /// The operating system says when there is something to receive; `None` while the interface is gone.
    watched: Option<AsyncFd<Watched>>,
    /// The link has never had a descriptor: time on it passes while one waits in it.
    looks: bool,
    alarm: Alarm,
}

impl Readiness {
    pub(super) fn of(link: &impl Link) -> io::Result<Self> {
        let mut readiness = Readiness { watched: None, looks: true, alarm: Alarm(None) };
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
            self.looks = false;
            self.watched = descriptor.map(watch).transpose()?;
        }
        Ok(())
    }

    /// Waits until there may be something to receive, or to do: `deadline` has come.
    pub(super) async fn wait(&mut self, now: Instant, deadline: Option<Instant>) {
        if self.looks {
            return tokio::task::yield_now().await;
        }
        let alarm = self.alarm.ring(now, deadline);
        let Some(watched) = &self.watched else { return alarm.await };
        // A deadline and a frame are one to whoever waits: both are looked at.
        tokio::select! {
            readable = watched.readable() => {
                if let Ok(mut ready) = readable {
                    // Whoever waits takes all there is before waiting again.
                    ready.clear_ready();
                }
            }
            () = alarm => {}
        }
    }

    /// How long to stay in the link for what comes.
    pub(super) const fn patience(&self) -> Duration {
        if self.looks { LOOK } else { Duration::ZERO }
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

/// A timer that stays set: mostly one waits for a frame, and for its absence only in the distance.
struct Alarm(Option<(Instant, Pin<Box<Sleep>>)>);

impl Alarm {
    /// Rings at `deadline` or before, but not at once again and again.
    async fn ring(&mut self, now: Instant, deadline: Option<Instant>) {
        let latest = now + INSPECTION;
        let at = deadline.map_or(latest, |deadline| deadline.min(latest));
        if self.0.as_ref().is_none_or(|(set, _)| *set > at) {
            self.0 = Some((at, Box::pin(tokio::time::sleep(at.since(now).into()))));
        }
        if let Some((_, sleep)) = &mut self.0 {
            sleep.await;
        }
        self.0 = None;
    }
}
