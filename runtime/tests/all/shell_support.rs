//! A small device for the tests of the shells.

use lexican_runtime::host::Station;
use lexican_runtime::object::{Access, Address, DataType, Dictionary, Object, PdoMapping, Ro, Row, Rw, Table};
use lexican_runtime::{Instant, NodeId};

pub(crate) const DEVICE_TYPE: Object<u32, Ro> = Object::new(0x1000, 0);
pub(crate) const HEARTBEAT: Object<u16, Rw> = Object::new(0x1017, 0).with_limits(0, 1000);
pub(crate) const NAME: Address = Address::new(0x2000, 0);

const fn row(index: u16, data_type: DataType, access: Access, offset: u32, capacity: u16) -> Row {
    Row::new(index, 0, data_type, access, PdoMapping::None).at(offset, capacity)
}

static TABLE: Table = Table {
    rows: &[
        row(0x1000, DataType::Unsigned32, Access::Ro, 0, 4),
        row(0x1017, DataType::Unsigned16, Access::Rw, 4, 2),
        row(0x2000, DataType::VisibleString, Access::Rw, 8, 20),
    ],
    limits: &[],
    image: &[0x92, 1, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0],
};

/// A device that has just been switched on.
pub(crate) fn station(node: NodeId) -> Station<28> {
    Station::new(Instant::ZERO, node, Dictionary::new(&TABLE, node))
}
