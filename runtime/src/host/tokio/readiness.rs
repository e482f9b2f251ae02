//! How the tokio shell waits for a link.

#[cfg(unix)]
use std::{
    boxed::Box,
    os::fd::{AsRawFd, RawFd},
    pin::Pin,
    sync::Arc,
};

#[cfg(unix)]
use tokio::{
    io::{Interest, unix::AsyncFd},
    time::Sleep,
};

#[cfg(unix)]
use crate::host::Descriptor;
use crate::host::Link;
use crate::time::{Duration, Instant};

/// How long one look at a link may last that cannot be waited for.
const LOOK: Duration = Duration::from_millis(1);

/// How often any other link is looked at all the same: its bus may be back, or gone.
#[cfg(unix)]
const INSPECTION: Duration = Duration::from_millis(250);

/// What there is to wait for.
pub(super) struct Readiness {
    source: Source,
    #[cfg(unix)]
    alarm: Alarm,
}

enum Source {
    /// The operating system says when there is something to receive.
    #[cfg(unix)]
    Descriptor(AsyncFd<Watched>),
    /// The interface is gone. Nobody says when it is back: the link finds out when it is looked at.
    #[cfg(unix)]
    Gone,
    /// Nobody says: time on the link passes while one waits in it.
    Look,
}

impl Readiness {
    pub(super) fn of(link: &impl Link) -> std::io::Result<Self> {
        #[cfg(unix)]
        let source = link.descriptor().map_or(Ok(Source::Look), Source::watch)?;
        #[cfg(not(unix))]
        let (source, _) = (Source::Look, link);
        Ok(Readiness {
            source,
            #[cfg(unix)]
            alarm: Alarm::default(),
        })
    }

    /// Sees to it that a link that has lost its interface, or found it again, is waited for.
    pub(super) fn follow(&mut self, link: &impl Link) -> std::io::Result<()> {
        #[cfg(unix)]
        match (&self.source, link.descriptor()) {
            (Source::Descriptor(watched), Some(descriptor)) if Arc::ptr_eq(&watched.get_ref().0, &descriptor) => {}
            (Source::Look, None) => {}
            (_, Some(descriptor)) => self.source = Source::watch(descriptor)?,
            (_, None) => self.source = Source::Gone,
        }
        #[cfg(not(unix))]
        let _ = link;
        Ok(())
    }

    /// Waits until there may be something to receive, or to do: `deadline` has come.
    pub(super) async fn wait(&mut self, now: Instant, deadline: Option<Instant>) {
        #[cfg(not(unix))]
        let _ = (now, deadline);
        match &self.source {
            // A deadline and a frame are one to whoever waits: both are looked at.
            #[cfg(unix)]
            Source::Descriptor(watched) => tokio::select! {
                readable = watched.readable() => {
                    if let Ok(mut ready) = readable {
                        // Whoever waits takes all there is before waiting again.
                        ready.clear_ready();
                    }
                }
                () = self.alarm.ring(now, deadline) => {}
            },
            #[cfg(unix)]
            Source::Gone => self.alarm.ring(now, deadline).await,
            Source::Look => tokio::task::yield_now().await,
        }
    }

    /// How long to stay in the link for what comes.
    pub(super) const fn patience(&self) -> Duration {
        match self.source {
            #[cfg(unix)]
            Source::Descriptor(_) | Source::Gone => Duration::ZERO,
            Source::Look => LOOK,
        }
    }
}

#[cfg(unix)]
impl Source {
    #[expect(deprecated, reason = "unsound only for what does not own its descriptor; its successor is `unsafe`")]
    fn watch(descriptor: Descriptor) -> std::io::Result<Self> {
        Ok(Source::Descriptor(AsyncFd::with_interest(Watched(descriptor), Interest::READABLE)?))
    }
}

/// What is waited for, kept open meanwhile.
#[cfg(unix)]
struct Watched(Descriptor);

#[cfg(unix)]
impl AsRawFd for Watched {
    fn as_raw_fd(&self) -> RawFd {
        self.0.as_raw_fd()
    }
}

/// A timer that stays set: mostly one waits for a frame, and for its absence only in the distance.
#[cfg(unix)]
#[derive(Default)]
struct Alarm(Option<(Instant, Pin<Box<Sleep>>)>);

#[cfg(unix)]
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
