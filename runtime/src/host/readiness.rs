//! How the tokio shell waits for a link.

#[cfg(unix)]
use std::os::fd::{AsRawFd, OwnedFd, RawFd};

#[cfg(unix)]
use tokio::io::unix::AsyncFd;

use super::Link;
use crate::time::{Duration, Instant};

/// How often a link is looked at that cannot be waited for, and how long one look may last.
const LOOK: Duration = Duration::from_millis(1);

/// How often any other link is looked at all the same: its bus may be back, or gone.
const INSPECTION: Duration = Duration::from_millis(250);

/// What there is to wait for.
pub(super) enum Readiness {
    /// The operating system says when there is something to receive.
    #[cfg(unix)]
    Descriptor {
        /// Whose readiness it is: a link that reconnects has another one.
        of: RawFd,
        own: AsyncFd<OwnedFd>,
    },
    /// Nobody says: time on the link passes while one waits in it.
    Look,
}

impl Readiness {
    #[cfg_attr(
        unix,
        expect(deprecated, reason = "unsound only for what does not own its descriptor; its successor is `unsafe`")
    )]
    pub(super) fn of(link: &impl Link) -> std::io::Result<Self> {
        #[cfg(unix)]
        if let Some(descriptor) = link.descriptor() {
            let own = AsyncFd::with_interest(descriptor.try_clone_to_owned()?, tokio::io::Interest::READABLE)?;
            return Ok(Readiness::Descriptor { of: descriptor.as_raw_fd(), own });
        }
        #[cfg(not(unix))]
        let _ = link;
        Ok(Readiness::Look)
    }

    /// Sees to it that a link that has reconnected is waited for.
    pub(super) fn follow(&mut self, link: &impl Link) -> std::io::Result<()> {
        #[cfg(unix)]
        if let Readiness::Descriptor { of, .. } = self
            && link.descriptor().is_none_or(|descriptor| descriptor.as_raw_fd() != *of)
        {
            *self = Readiness::of(link)?;
        }
        #[cfg(not(unix))]
        let _ = link;
        Ok(())
    }

    /// Waits until there may be something to receive, or to do: `deadline` has come.
    pub(super) async fn wait(&self, now: Instant, deadline: Option<Instant>) {
        match self {
            #[cfg(unix)]
            Readiness::Descriptor { own: descriptor, .. } => {
                let left = deadline.map_or(INSPECTION, |deadline| deadline.since(now).min(INSPECTION));
                let readable = async {
                    if let Ok(mut ready) = descriptor.readable().await {
                        // Whoever waits takes all there is before waiting again.
                        ready.clear_ready();
                    }
                };
                // A deadline and a frame are one to whoever waits: both are looked at.
                let _ = tokio::time::timeout(left.into(), readable).await;
            }
            Readiness::Look => tokio::task::yield_now().await,
        }
    }

    /// How long to stay in the link for what comes.
    pub(super) fn patience(&self) -> Duration {
        match self {
            #[cfg(unix)]
            Readiness::Descriptor { .. } => Duration::ZERO,
            Readiness::Look => LOOK,
        }
    }
}
