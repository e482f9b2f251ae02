//! The PDOs that a link has received, with their times.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

use lexican_machine::BoxedLink;
use lexican_runtime::host::{Incoming, Link, LinkError};
use lexican_runtime::{CobId, Duration, Frame, Instant};

use crate::wait::lock;

/// The last frame of each PDO on a bus, and when it came.
pub(crate) type Heard = Arc<Mutex<BTreeMap<CobId, (Instant, Frame)>>>;

/// A link that records each PDO with the time at which it came, so that its age is known when it is read.
pub(crate) struct Noting {
    link: BoxedLink,
    heard: Heard,
}

impl Noting {
    pub(crate) fn over(link: BoxedLink) -> (BoxedLink, Heard) {
        let heard = Heard::default();
        (Box::new(Noting { link, heard: Arc::clone(&heard) }), heard)
    }

    fn note(&self, received: Result<Option<Incoming>, LinkError>) -> Result<Option<Incoming>, LinkError> {
        if let Ok(Some(Incoming::Frame(frame))) = &received
            && (0x180..0x580).contains(&frame.id().raw())
            && !frame.is_remote()
        {
            lock(&self.heard).insert(frame.id(), (self.link.now(), *frame));
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
