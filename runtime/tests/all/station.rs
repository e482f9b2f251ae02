//! A device that consists only of its dictionary, and several of them behind one link.
#![cfg(feature = "std")]

use crate::shell_support::observed;
use lexican_runtime::device::Event;
use lexican_runtime::host::blocking::Network;
use lexican_runtime::host::{Node, Station, VirtualBus, VirtualLink};
use lexican_runtime::object::{Access, DataType, Dictionary, Object, PdoMapping, Ro, Row, Rw, Table};
use lexican_runtime::wire::nmt::NmtCommand;
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};

const HEARTBEAT: Object<u16, Rw> = Object::new(0x1017, 0);
const TARGET: Object<u16, Rw> = Object::new(0x2000, 0);
const ACTUAL: Object<u16, Ro> = Object::new(0x2001, 0);
const STARTS: Object<u16, Ro> = Object::new(0x2002, 0);

const fn row(index: u16, access: Access, offset: u32) -> Row {
    Row::new(index, 0, DataType::Unsigned16, access, PdoMapping::None).at(offset, 2)
}

static TABLE: Table = Table {
    rows: &[
        row(0x1017, Access::Rw, 0),
        row(0x2000, Access::Rw, 2),
        row(0x2001, Access::Ro, 4),
        row(0x2002, Access::Ro, 6),
    ],
    limits: &[],
    image: &[0, 0, 10, 0, 0, 0, 0, 0],
};

const NODE: NodeId = NodeId::literal(5);

/// A device that is at its target at once, and counts its starts, including resets.
fn station(node: NodeId) -> Station<8> {
    let mut starts = 1;
    let mut station =
        Station::new(Instant::ZERO, node, Dictionary::new(&TABLE, node)).follow(move |_, _, od, event| match event {
            Event::Written(address) if address == TARGET.address() => od.set(ACTUAL, od.get(TARGET)),
            Event::Reset(_) => {
                starts += 1;
                od.set(STARTS, starts);
            }
            _ => {}
        });
    station.parts().1.set(STARTS, 1);
    station
}

fn network() -> Network<VirtualLink> {
    let bus = VirtualBus::with_bit_rate(500);
    bus.attach(station(NODE));
    let mut network = Network::new(bus.link());
    network.write(NODE, HEARTBEAT, 100).unwrap();
    network.write(NODE, TARGET, 500).unwrap();
    network
}

/// The values of HEARTBEAT, TARGET, ACTUAL and STARTS 10 ms after a command.
fn after(command: NmtCommand) -> [u16; 4] {
    let mut network = network();
    network.command(command, Some(NODE)).unwrap();
    network.wait_for(Duration::from_millis(10), |_| None::<()>).unwrap();
    [
        network.read(NODE, HEARTBEAT).unwrap(),
        network.read(NODE, TARGET).unwrap(),
        network.read(NODE, ACTUAL).unwrap(),
        network.read(NODE, STARTS).unwrap(),
    ]
}

#[test]
fn the_application_follows_what_is_written() {
    assert_eq!(after(NmtCommand::Start), [100, 500, 500, 1]);
}

#[test]
fn a_reset_of_the_communication_keeps_application_objects() {
    assert_eq!(after(NmtCommand::ResetCommunication), [0, 500, 500, 2]);
}

#[test]
fn a_reset_of_the_node_restores_the_defaults_except_what_the_application_sets() {
    assert_eq!(after(NmtCommand::ResetNode), [0, 10, 0, 2]);
}

#[test]
fn nodes_behind_one_link_have_their_own_objects_and_deadlines() {
    let other = NodeId::literal(6);
    let nodes = vec![station(NODE), station(other)];
    for id in [0x000, 0x605, 0x606] {
        assert!(nodes.concerns().contains(&CobId::standard(id).unwrap()), "{id:X} is not heard");
    }
    let bus = VirtualBus::with_bit_rate(500);
    bus.attach(nodes);
    let mut network = Network::new(bus.link());
    for (node, period) in [(NODE, 100), (other, 70)] {
        network.write(node, HEARTBEAT, period).unwrap();
        network.write(node, TARGET, period).unwrap();
    }
    assert_eq!([NODE, other].map(|node| network.read(node, ACTUAL).unwrap()), [100, 70]);
    // Each device has its own deadlines, and is called only at these.
    let frames = observed(&bus);
    network.wait_for(Duration::from_secs(7), |_| None::<()>).unwrap();
    let frames = frames.lock().unwrap();
    let heartbeats = [0x705, 0x706].map(|id| frames.iter().filter(|(_, frame)| frame.id().raw() == id).count());
    assert_eq!(heartbeats, [70, 100]);
}

#[test]
fn one_node_without_a_filter_lets_all_frames_through() {
    struct Listener;
    impl Node for Listener {
        fn handle_frame(&mut self, _: Instant, _: &Frame) {}
        fn handle_timeout(&mut self, _: Instant) {}
        fn poll_transmit(&mut self, _: Instant) -> Option<Frame> {
            None
        }
        fn poll_timeout(&self) -> Option<Instant> {
            None
        }
    }
    let nodes: Vec<Box<dyn Node>> = vec![Box::new(station(NODE)), Box::new(Listener)];
    assert_eq!(nodes.concerns(), []);
}
