//! The PDOs that a link has received, and when.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use lexican_runtime::host::{Incoming, Link, LinkError};
use lexican_runtime::{CobId, Duration, Frame, Instant};

use super::BoxedLink;

/// The last frame of each PDO on a bus, with its time. Clones share their contents.
#[derive(Clone, Debug, Default)]
pub struct Heard(Arc<Mutex<BTreeMap<CobId, (Instant, Frame)>>>);

impl Heard {
    /// Wraps a link to record every PDO from now on.
    #[must_use]
    pub fn over(link: BoxedLink) -> (BoxedLink, Heard) {
        let heard = Heard::default();
        (Box::new(Noting { link, heard: heard.clone() }), heard)
    }

    /// The last frame with a COB-ID, and when it came.
    #[must_use]
    pub fn latest(&self, id: CobId) -> Option<(Instant, Frame)> {
        self.frames().get(&id).copied()
    }

    fn frames(&self) -> MutexGuard<'_, BTreeMap<CobId, (Instant, Frame)>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A link that records the time of each PDO, so that a value's age is known when it is read.
struct Noting {
    link: BoxedLink,
    heard: Heard,
}

impl Noting {
    fn note(&self, received: Result<Option<Incoming>, LinkError>) -> Result<Option<Incoming>, LinkError> {
        if let Ok(Some(Incoming::Frame(frame))) = &received
            && (0x180..0x580).contains(&frame.id().raw())
            && !frame.is_remote()
        {
            self.heard.frames().insert(frame.id(), (self.link.now(), *frame));
        }
        received
    }
}

impl Link for Noting {
    fn now(&self) -> Instant {
        self.link.now()
    }
    fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        self.link.send(frame)
    }
    fn try_send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        self.link.try_send(frame)
    }
    fn receive(&mut self, until: Instant) -> Result<Option<Incoming>, LinkError> {
        let received = self.link.receive(until);
        self.note(received)
    }
    fn receive_at(&mut self, now: Instant, until: Instant) -> Result<Option<Incoming>, LinkError> {
        let received = self.link.receive_at(now, until);
        self.note(received)
    }
    fn is_drained(&self) -> bool {
        self.link.is_drained()
    }
    #[cfg(unix)]
    fn descriptor(&self) -> Option<lexican_runtime::host::Descriptor> {
        self.link.descriptor()
    }
    fn is_real_time(&self) -> bool {
        self.link.is_real_time()
    }
    fn latency(&self) -> Duration {
        self.link.latency()
    }
    fn listen_to(&mut self, ids: &[CobId]) -> Result<(), LinkError> {
        self.link.listen_to(ids)
    }
}
