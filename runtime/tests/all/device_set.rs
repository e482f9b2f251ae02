//! What the application sets in its dictionary is sent by TPDOs without another call.

use lexican_runtime::device::{Behaviour, Device};
use lexican_runtime::object::{Access, DataType, Dictionary, Object, PdoMapping, Row, Rw, Table};
use lexican_runtime::{CobId, Frame, Instant, NodeId};

const NODE: NodeId = NodeId::literal(5);
const NOW: Instant = Instant::ZERO;
const TRANSMISSION: Object<u8, Rw> = Object::new(0x1800, 2);
const MAPPED: Object<u8, Rw> = Object::new(0x6000, 1);
const MEASURED: Object<u8, Rw> = Object::new(0x6000, 2);
const OTHER: Object<u8, Rw> = Object::new(0x6000, 3);

const fn row(index: u16, sub: u8, data_type: DataType) -> Row {
    Row::new(index, sub, data_type, Access::Rw, PdoMapping::Both)
}

/// TPDO 1 has two of three objects.
static TABLE: Table = Table {
    rows: &[
        row(0x1800, 1, DataType::Unsigned32).at(0, 4).plus_node(),
        row(0x1800, 2, DataType::Unsigned8).at(4, 1),
        row(0x1A00, 0, DataType::Unsigned8).at(5, 1),
        row(0x1A00, 1, DataType::Unsigned32).up_to(2).at(6, 4),
        row(0x6000, 1, DataType::Unsigned8).up_to(3).at(14, 1),
    ],
    limits: &[],
    image: &[0x80, 1, 0, 0, 0, 2, 8, 1, 0, 0x60, 8, 2, 0, 0x60, 0, 0, 0],
};

struct Bench {
    device: Device,
    od: Dictionary<17>,
}

impl Bench {
    /// In OPERATIONAL, with everything sent that this brings.
    fn operational(transmission: u8) -> Self {
        let mut bench = Bench { device: Device::new(NODE, Behaviour::CIA_301), od: Dictionary::new(&TABLE, NODE) };
        bench.od.set(TRANSMISSION, transmission);
        bench.device.restart(NOW, &mut bench.od);
        bench.sent();
        bench.receive(CobId::NMT, &[1, 5]);
        bench.receive(CobId::SYNC, &[]);
        bench
    }

    fn receive(&mut self, id: CobId, data: &[u8]) -> Vec<String> {
        self.device.handle_frame(NOW, &Frame::new(id, data).unwrap(), &mut self.od);
        self.sent()
    }

    fn sent(&mut self) -> Vec<String> {
        std::iter::from_fn(|| self.device.poll_transmit(NOW, &mut self.od)).map(|frame| frame.to_string()).collect()
    }
}

#[test]
fn to_set_a_mapped_object_is_the_event() {
    for transmission in [254, 255] {
        let mut bench = Bench::operational(transmission);
        bench.od.set(MAPPED, 7);
        bench.od.set(OTHER, 1);
        assert_eq!(bench.sent(), ["185#0700"]);
        bench.od.set(MAPPED, 7);
        bench.od.set(OTHER, 2);
        assert_eq!(bench.sent(), [""; 0], "no mapped object has another value");
        bench.device.changed(MAPPED.address());
        bench.od.set(MAPPED, 8);
        assert_eq!(bench.sent(), ["185#0800"], "what is reported besides is sent once");
    }
}

#[test]
fn a_synchronous_pdo_is_sent_with_the_next_sync_after_a_set_and_once() {
    let mut bench = Bench::operational(0);
    bench.od.set(MAPPED, 7);
    assert_eq!(bench.sent(), [""; 0]);
    let sent: Vec<usize> = (0..3).map(|_| bench.receive(CobId::SYNC, &[]).len()).collect();
    assert_eq!(sent, [1, 0, 0]);
    // Between the SYNC and what is sent with it, it is set again: that is the next event.
    bench.od.set(MAPPED, 8);
    bench.sent();
    bench.device.handle_frame(NOW, &Frame::new(CobId::SYNC, &[]).unwrap(), &mut bench.od);
    bench.od.set(MAPPED, 7);
    assert_eq!(bench.sent(), ["185#0800"]);
    assert_eq!(bench.receive(CobId::SYNC, &[]), ["185#0700"]);
    assert_eq!(bench.receive(CobId::SYNC, &[]), [""; 0]);
}

#[test]
fn what_is_set_quietly_waits_for_a_report() {
    let mut bench = Bench::operational(255);
    bench.od.set_quietly(MEASURED, 3);
    assert_eq!(bench.sent(), [""; 0]);
    bench.od.set(OTHER, 1);
    assert_eq!(bench.sent(), [""; 0], "another object is no report of it");
    bench.device.changed(MEASURED.address());
    assert_eq!(bench.sent(), ["185#0003"]);
}

#[test]
fn what_is_set_before_operational_is_sent_with_the_start_and_not_again() {
    let mut bench = Bench::operational(255);
    bench.receive(CobId::NMT, &[0x80, 5]);
    bench.od.set(MAPPED, 9);
    assert_eq!(bench.sent(), [""; 0]);
    assert_eq!(bench.receive(CobId::NMT, &[1, 5]), ["185#0900"]);
    assert_eq!(bench.sent(), [""; 0]);
}
