//! A small device for the tests of the shells.

use lexican_runtime::device::{Behaviour, Device};
use lexican_runtime::host::Node;
use lexican_runtime::object::{Access, Address, DataType, Dictionary, Entry, Object, PdoMapping, Ro, Rw, Table};
use lexican_runtime::{Frame, Instant, NodeId};

pub(crate) const DEVICE_TYPE: Object<u32, Ro> = Object::new(0x1000, 0);
pub(crate) const HEARTBEAT: Object<u16, Rw> = Object::new(0x1017, 0).with_limits(0, 1000);
pub(crate) const NAME: Address = Address::new(0x2000, 0);

const fn row(index: u16, data_type: DataType, access: Access, offset: u32, capacity: u16) -> Entry {
    let address = Address::new(index, 0);
    Entry { address, data_type, access, mapping: PdoMapping::None, offset, capacity, limit: 0 }
}

static TABLE: Table = Table {
    entries: &[
        row(0x1000, DataType::Unsigned32, Access::Ro, 0, 4),
        row(0x1017, DataType::Unsigned16, Access::Rw, 4, 2),
        row(0x2000, DataType::VisibleString, Access::Rw, 8, 20),
    ],
    limits: &[],
    image: &[0x92, 1, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0],
    node_relative: &[],
};

/// A device with its dictionary, for the bus.
pub(crate) struct Station(Device, Dictionary<28>);

impl Station {
    /// A device that has just been switched on.
    pub(crate) fn new(node: NodeId) -> Self {
        let mut station = Station(Device::new(node, Behaviour::CIA_301), Dictionary::new(&TABLE, node));
        station.0.restart(Instant::ZERO, &mut station.1);
        station
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
