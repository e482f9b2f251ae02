//! How the shell waits for a link without a descriptor: it looks.

use super::alarm::Alarm;
use crate::host::Link;
use crate::time::{Duration, Instant};

/// How often it looks, or how long a look may last.
const LOOK: Duration = Duration::from_millis(1);

/// Looks at a link.
#[derive(Default)]
pub(super) struct Looks {
    /// A moment of tokio's time and of the link's. From then on both have passed alike; without it, time on the link
    /// passes while one waits in it.
    anchor: Option<(tokio::time::Instant, Instant)>,
}

impl Looks {
    /// Follows a link whose time may pass in another way than before.
    pub(super) fn follow(&mut self, link: &impl Link) {
        if !link.is_real_time() {
            self.anchor = None;
        } else if self.anchor.is_none() {
            self.anchor = Some((tokio::time::Instant::now(), link.now()));
        }
    }

    /// Waits outside of the link, if time passes there.
    pub(super) async fn wait(&self, alarm: &mut Alarm, now: Instant, deadline: Option<Instant>) {
        match self.anchor {
            Some(_) => alarm.ring(now, deadline, LOOK).await,
            None => tokio::task::yield_now().await,
        }
    }

    /// Until when a look lasts: until now, however the link comes to know how late it is.
    pub(super) fn until(&self, now: Instant) -> Instant {
        self.anchor.map_or(now + LOOK, |(began, on_link)| on_link + began.elapsed().into())
    }
}
