//! A small device for the tests of the shells.

use std::sync::{Arc, Mutex};

use lexican_runtime::host::{AccessError, Station, VirtualBus};
use lexican_runtime::object::{Access, Address, DataType, Dictionary, Object, PdoMapping, Ro, Row, Rw, Table};
use lexican_runtime::service::sdo_client::SdoError;
use lexican_runtime::{Frame, Instant, NodeId};

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

/// Frames that were on a bus, with their times.
pub(crate) type Frames = Arc<Mutex<Vec<(Instant, Frame)>>>;

/// The frames on a bus from now on.
pub(crate) fn observed(bus: &VirtualBus) -> Frames {
    let frames = Frames::default();
    let list = Arc::clone(&frames);
    bus.observe(move |now, frame| list.lock().unwrap().push((now, *frame)));
    frames
}

#[track_caller]
pub(crate) fn has_timed_out<T: std::fmt::Debug>(silent: NodeId, result: Result<T, AccessError>) {
    let error = result.unwrap_err();
    assert!(matches!(error, AccessError::Sdo { node, error: SdoError::TimedOut { .. } } if node == silent), "{error}");
}
