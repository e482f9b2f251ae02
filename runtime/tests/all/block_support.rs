//! A device with a name that is long enough for block transfers, for the tests of the shells.

use crate::common::FULL;
use crate::common::testing::TestOd;
use lexican_runtime::device::{Behaviour, Device};
use lexican_runtime::host::Node;
use lexican_runtime::object::Address;
use lexican_runtime::{Frame, Instant, NodeId};

/// The name, which can be written.
pub(crate) const TEXT: Address = Address::new(0x1008, 0);

pub(crate) struct Station(Device<3, 3, 2, 3>, TestOd);

impl Station {
    /// A device that has just been switched on, with a name of `len` bytes.
    pub(crate) fn new(node: NodeId, len: usize) -> Self {
        let mut device = Device::new(node, Behaviour::CIA_301);
        let mut od = TestOd::new(FULL).without(0x1200).with(&format!("1008:00 text rw - {}", "n".repeat(len)));
        device.restart(Instant::ZERO, &mut od);
        Station(device, od)
    }
}

impl Node for Station {
    fn handle_frame(&mut self, now: Instant, frame: &Frame) {
        self.0.handle_frame(now, frame, &mut self.1);
    }
    fn handle_timeout(&mut self, now: Instant) {
        self.0.handle_timeout(now, &mut self.1);
    }
    fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        self.0.poll_transmit(now, &mut self.1)
    }
    fn poll_timeout(&self) -> Option<Instant> {
        self.0.poll_timeout()
    }
}
