//! For tests: a bus on which there is always a frame.

use lexican_runtime::host::{Incoming, Link, LinkError};
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};

/// A link that has a frame of node 9 at every look, 10 a millisecond.
pub(crate) struct Flood {
    now: Instant,
    frame: Frame,
    pub(crate) sent: usize,
}

impl Flood {
    /// A flood of heartbeats, so that the node is known to be there.
    pub(crate) fn of_heartbeats() -> Self {
        Flood { now: Instant::ZERO, frame: Frame::from_array(CobId::of_node(0x700, NodeId::literal(9)), [4]), sent: 0 }
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
        assert!(self.now < Instant::from_micros(60_000_000), "nothing is ever over");
        Ok(Some(Incoming::Frame(self.frame)))
    }
}
