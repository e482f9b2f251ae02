//! How the shell waits for its link: with the descriptor, where there is one, and for a deadline.

use std::boxed::Box;
use std::io;
use std::pin::Pin;

use tokio::time::Sleep;

use crate::host::Link;
use crate::time::{Duration, Instant};

/// How often a link without a descriptor is read, or how long that may last.
const LOOK: Duration = Duration::from_millis(1);

/// A link is read this often even though its descriptor reports nothing: the bus may have gone or come back.
const INSPECTION: Duration = Duration::from_millis(250);

pub(super) struct Wait {
    #[cfg(unix)]
    watched: Option<descriptor::Watched>,
    /// The link has, or had, a descriptor.
    has_descriptor: bool,
    /// A moment of tokio's time and of the link's, for a link in real time without a descriptor. From then on both pass
    /// alike. Without it, time on the link passes while the shell is in it.
    anchor: Option<(tokio::time::Instant, Instant)>,
    /// When a timer ends. It stays set until then, unless an earlier one is needed: most waits end with a frame.
    timer: Option<(Instant, Pin<Box<Sleep>>)>,
}

impl Wait {
    pub(super) fn new(link: &impl Link) -> io::Result<Self> {
        let mut wait = Wait {
            #[cfg(unix)]
            watched: None,
            has_descriptor: false,
            anchor: None,
            timer: None,
        };
        wait.update(link)?;
        Ok(wait)
    }

    /// Follows a link that has lost its interface, or found it again, or whose time passes in another way than before.
    pub(super) fn update(&mut self, link: &impl Link) -> io::Result<()> {
        #[cfg(unix)]
        {
            descriptor::update(&mut self.watched, link.descriptor())?;
            self.has_descriptor |= self.watched.is_some();
        }
        if self.has_descriptor || !link.is_real_time() {
            self.anchor = None;
        } else if self.anchor.is_none() {
            self.anchor = Some((tokio::time::Instant::now(), link.now()));
        }
        Ok(())
    }

    /// Waits until the link may have something, or `deadline` has come. It is `now`.
    pub(super) async fn for_link(&mut self, now: Instant, deadline: Option<Instant>) {
        let at_most = match (self.has_descriptor, self.anchor) {
            (true, _) => INSPECTION,
            (false, Some(_)) => LOOK,
            (false, None) => return tokio::task::yield_now().await,
        };
        // A deadline at the end of time never comes.
        let deadline = deadline.filter(|deadline| *deadline < Instant::MAX);
        let span = deadline.map_or(at_most, |deadline| deadline.since(now).min(at_most));
        let at = now + span;
        let timer = match &mut self.timer {
            Some((set, timer)) if *set <= at => timer,
            timer => &mut timer.insert((at, Box::pin(tokio::time::sleep(span.into())))).1,
        };
        #[cfg(unix)]
        if let Some(watched) = &self.watched {
            tokio::select! {
                biased;
                () = watched.readable() => return,
                () = timer => {}
            }
            self.timer = None;
            return;
        }
        timer.await;
        self.timer = None;
    }

    /// How long to stay in the link: until `now`, if it need not be waited in.
    pub(super) fn patience(&self, link: &impl Link) -> Instant {
        match self.anchor {
            // The descriptor reports what comes later. No link waits for a time that has passed.
            _ if self.has_descriptor => Instant::ZERO,
            Some((began, on_link)) => on_link + began.elapsed().into(),
            None => link.now() + LOOK,
        }
    }
}

#[cfg(unix)]
mod descriptor {
    use std::io;
    use std::os::fd::{AsRawFd, RawFd};
    use std::sync::Arc;

    use tokio::io::Interest;
    use tokio::io::unix::AsyncFd;

    use crate::host::Descriptor;

    /// A descriptor that tokio watches.
    pub(super) struct Watched(AsyncFd<Open>);

    impl Watched {
        /// Waits until there may be something to read. All of it must be read before the next wait.
        pub(super) async fn readable(&self) {
            if let Ok(mut ready) = self.0.readable().await {
                ready.clear_ready();
            }
        }
    }

    pub(super) fn update(watched: &mut Option<Watched>, descriptor: Option<Descriptor>) -> io::Result<()> {
        let is_same = match (&*watched, &descriptor) {
            (Some(watched), Some(descriptor)) => Arc::ptr_eq(&watched.0.get_ref().0, descriptor),
            (watched, descriptor) => watched.is_none() && descriptor.is_none(),
        };
        if !is_same {
            *watched = descriptor.map(watch).transpose()?;
        }
        Ok(())
    }

    #[expect(deprecated, reason = "unsound only for what does not own its descriptor; its successor is `unsafe`")]
    fn watch(descriptor: Descriptor) -> io::Result<Watched> {
        AsyncFd::with_interest(Open(descriptor), Interest::READABLE).map(Watched)
    }

    /// What is watched, kept open meanwhile.
    struct Open(Descriptor);

    impl AsRawFd for Open {
        fn as_raw_fd(&self) -> RawFd {
            self.0.as_raw_fd()
        }
    }
}
