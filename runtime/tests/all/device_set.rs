//! TPDOs send what the application sets in its dictionary, without another call.

use crate::common::{self, NODE, NOTHING, Rig};
use lexican_runtime::device::Behaviour;
use lexican_runtime::object::{Access, DataType, Dictionary, Object, PdoMapping, Row, Rw, Table};

const TRANSMISSION: Object<u8, Rw> = Object::new(0x1800, 2);
const MAPPED: Object<u8, Rw> = Object::new(0x6000, 1);
const MEASURED: Object<u8, Rw> = Object::new(0x6000, 2);
const OTHER: Object<u8, Rw> = Object::new(0x6000, 3);

const fn row(index: u16, sub: u8, data_type: DataType) -> Row {
    Row::new(index, sub, data_type, Access::Rw, PdoMapping::Both)
}

/// TPDO 1 maps two of three objects.
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

/// A device in OPERATIONAL, after the TPDOs that are sent on entering.
fn operational(transmission: u8) -> Rig<Dictionary<17>> {
    let mut od = Dictionary::new(&TABLE, NODE);
    od.set(TRANSMISSION, transmission);
    let mut rig = Rig::new(od, Behaviour::CIA_301).operational();
    rig.send("080#");
    rig
}

#[test]
fn to_set_a_mapped_object_is_the_event() {
    for transmission in [254, 255] {
        let mut rig = operational(transmission);
        rig.od.set(MAPPED, 7);
        rig.od.set(OTHER, 1);
        assert_eq!(rig.sent(), ["185#0700"]);
        rig.od.set(MAPPED, 7);
        rig.od.set(OTHER, 2);
        assert_eq!(rig.sent(), NOTHING, "no mapped object has another value");
        rig.device.changed(MAPPED.address());
        rig.od.set(MAPPED, 8);
        assert_eq!(rig.sent(), ["185#0800"], "what is reported besides is sent once");
    }
}

#[test]
fn a_synchronous_pdo_is_sent_with_the_next_sync_after_a_set_and_once() {
    let mut rig = operational(0);
    rig.od.set(MAPPED, 7);
    assert_eq!(rig.sent(), NOTHING);
    let sent: Vec<usize> = (0..3).map(|_| rig.send("080#").len()).collect();
    assert_eq!(sent, [1, 0, 0]);
    // It is set again between the SYNC and the transmission: this is the next event.
    rig.od.set(MAPPED, 8);
    rig.sent();
    rig.device.handle_frame(rig.now, &common::frame("080#"), &mut rig.od);
    rig.od.set(MAPPED, 7);
    assert_eq!(rig.sent(), ["185#0800"]);
    assert_eq!(rig.send("080#"), ["185#0700"]);
    assert_eq!(rig.send("080#"), NOTHING);
}

#[test]
fn what_is_set_quietly_waits_for_a_report() {
    let mut rig = operational(255);
    rig.od.set_quietly(MEASURED, 3);
    assert_eq!(rig.sent(), NOTHING);
    rig.od.set(OTHER, 1);
    assert_eq!(rig.sent(), NOTHING, "another object is no report of it");
    rig.device.changed(MEASURED.address());
    assert_eq!(rig.sent(), ["185#0003"]);
}

#[test]
fn what_is_set_before_operational_is_sent_with_the_start_and_not_again() {
    let mut rig = operational(255);
    rig.send("000#8005");
    rig.od.set(MAPPED, 9);
    assert_eq!(rig.sent(), NOTHING);
    assert_eq!(rig.send("000#0105"), ["185#0900"]);
    assert_eq!(rig.sent(), NOTHING);
}
