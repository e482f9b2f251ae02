//! For tests: a bus that always has a frame to receive.

use lexican_runtime::host::{Incoming, Link, LinkError};
use lexican_runtime::wire::heartbeat::ErrorControl;
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{Duration, Frame, Instant, NodeId};

/// A link that returns a frame of node 9 at every call, 10 per millisecond.
pub(crate) struct Flood {
    now: Instant,
    frame: Frame,
    pub(crate) sent: usize,
}

impl Flood {
    pub(crate) fn of_heartbeats() -> Self {
        Flood {
            now: Instant::ZERO,
            frame: ErrorControl::heartbeat(NmtState::Stopped).frame(NodeId::literal(9)),
            sent: 0,
        }
    }
}

impl Link for Flood {
    fn now(&self) -> Instant {
        self.now
    }
    fn send(&mut self, _: &Frame) -> Result<(), LinkError> {
        self.sent += 1;
        Ok(())
    }
    fn receive(&mut self, _: Instant) -> Result<Option<Incoming>, LinkError> {
        self.now += Duration::from_micros(100);
        assert!(self.now < Instant::from_micros(60_000_000), "the wait does not end");
        Ok(Some(Incoming::Frame(self.frame)))
    }
}
