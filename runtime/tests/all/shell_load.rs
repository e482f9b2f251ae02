//! What a shell must not lose on a busy network: heartbeats under back-to-back SDO, and emergencies that come in a
//! storm.
#![cfg(feature = "tokio")]

use crate::shell_support::{HEARTBEAT, station};
#[allow(dead_code, reason = "several tests share it")]
use lexican_runtime::device::Event as DeviceEvent;
use lexican_runtime::host::{Station, VirtualBus, blocking, tokio as shell};
use lexican_runtime::manager::{Event, Manager, Remote};
use lexican_runtime::object::{Access, DataType, Dictionary, Object, PdoMapping, Row, Rw, Table};
use lexican_runtime::wire::emcy::{ErrorCode, ErrorRegister};
use lexican_runtime::{Duration, Instant, NodeId};
use tokio::sync::broadcast::error::TryRecvError;

const NODE: NodeId = NodeId::literal(5);
const OTHERS: [NodeId; 3] = [NodeId::literal(4), NodeId::literal(9), NodeId::literal(127)];

/// Monitors all nodes, and produces a heartbeat.
fn watch(manager: &mut Manager<127>, now: Instant) {
    manager.produce_heartbeat(now, NodeId::literal(100), Duration::from_millis(50));
    for node in OTHERS.into_iter().chain([NODE]) {
        manager.add(now, Remote::new(node).with_heartbeat(Duration::from_millis(100))).unwrap();
    }
}

/// A bus with all nodes.
fn bus(bus: VirtualBus) -> VirtualBus {
    for node in OTHERS.into_iter().chain([NODE]) {
        bus.attach(station(node));
    }
    bus
}

fn buses() -> [VirtualBus; 2] {
    [VirtualBus::with_bit_rate(125), VirtualBus::new()].map(bus)
}

#[test]
fn a_thousand_writes_of_the_blocking_shell_leave_room_for_heartbeats() {
    for bus in buses() {
        let mut network = blocking::Network::new(bus.link());
        let now = network.now();
        watch(network.manager(), now);
        for node in OTHERS {
            network.write(node, HEARTBEAT, 50).unwrap();
        }
        for _ in 0..1000 {
            network.write(NODE, HEARTBEAT, 50).unwrap();
        }
        let now = network.now();
        while let Some(event) = network.next_event(now).unwrap() {
            assert!(!matches!(event, Event::Lost { .. }), "{event:?}");
        }
        assert_eq!(network.missed_events(), 0);
    }
}

#[tokio::test]
async fn a_thousand_writes_of_the_tokio_shell_leave_room_for_heartbeats() {
    for bus in buses() {
        let network = shell::Network::spawn(bus.link()).unwrap();
        let mut events = network.events();
        network.with_manager(watch).await.unwrap();
        for node in OTHERS {
            network.write(node, HEARTBEAT, 50).await.unwrap();
        }
        for _ in 0..1000 {
            network.write(NODE, HEARTBEAT, 50).await.unwrap();
        }
        loop {
            match events.try_recv() {
                Ok(event) => assert!(!matches!(event, shell::Event::Manager(Event::Lost { .. })), "{event:?}"),
                Err(TryRecvError::Empty) => break,
                Err(error) => panic!("{error}"),
            }
        }
    }
}

/// The number of errors that the device should have.
const ERRORS: Object<u16, Rw> = Object::new(0x2000, 0);

static TABLE: Table = Table {
    rows: &[
        Row::new(0x1014, 0, DataType::Unsigned32, Access::Rw, PdoMapping::None).at(0, 4),
        Row::new(0x2000, 0, DataType::Unsigned16, Access::Rw, PdoMapping::None).at(4, 2),
    ],
    limits: &[],
    image: &[0x85, 0, 0, 0, 0, 0],
};

/// A device with as many errors as are written to it.
fn faulty() -> Station<6> {
    let mut number = 0_u8;
    Station::new(Instant::ZERO, NODE, Dictionary::new(&TABLE, NODE)).follow(move |_, device, od, event| {
        if event == DeviceEvent::Written(ERRORS.address()) {
            for _ in 0..od.get(ERRORS) {
                number = number.wrapping_add(1);
                device.emergency(ErrorCode(0xFF00), ErrorRegister::GENERIC, [number, 0, 0, 0, 0], od);
            }
        }
    })
}

/// The number of an emergency of the device.
fn number(event: &Event) -> Option<u8> {
    match event {
        Event::Emergency { node: NODE, emergency } => Some(emergency.vendor[0]),
        _ => None,
    }
}

#[test]
fn a_storm_of_emergencies_waits_for_a_busy_application_of_the_blocking_shell() {
    for bus in [VirtualBus::with_bit_rate(125), VirtualBus::new()] {
        bus.attach(faulty());
        let mut network = blocking::Network::new(bus.link());
        for _ in 0..100 {
            network.write(NODE, ERRORS, 1).unwrap();
        }
        let mut numbers = Vec::new();
        let until = network.now() + Duration::from_millis(10);
        while let Some(event) = network.next_event(until).unwrap() {
            numbers.extend(number(&event));
        }
        assert_eq!(numbers, (1..=100).collect::<Vec<u8>>());
    }
}

#[tokio::test]
async fn a_storm_of_emergencies_waits_for_a_busy_application_of_the_tokio_shell() {
    for bus in [VirtualBus::with_bit_rate(125), VirtualBus::new()] {
        bus.attach(faulty());
        let network = shell::Network::spawn(bus.link()).unwrap();
        let mut events = network.events();
        for _ in 0..100 {
            network.write(NODE, ERRORS, 1).await.unwrap();
        }
        network.sleep_until(network.now().await.unwrap() + Duration::from_millis(10)).await.unwrap();
        let received = std::iter::from_fn(|| events.try_recv().ok());
        let numbers = received.filter_map(|event| match event {
            shell::Event::Manager(event) => number(&event),
            _ => None,
        });
        assert_eq!(numbers.collect::<Vec<u8>>(), (1..=100).collect::<Vec<u8>>());
    }
}

#[test]
fn what_the_blocking_shell_cannot_keep_is_counted() {
    let bus = VirtualBus::with_bit_rate(125);
    bus.attach(faulty());
    let link = bus.link();
    link.attachment().set_mailbox(16);
    let mut network = blocking::Network::new(link);
    network.write(NODE, ERRORS, 1).unwrap();
    let mut other = blocking::Network::new(bus.link());
    // The application is busy elsewhere, and reads no events.
    for _ in 0..40 {
        other.write(NODE, ERRORS, 1).unwrap();
    }
    let now = network.now();
    while network.next_event(now).unwrap().is_some() {}
    // Emergencies, and the requests and answers of the other client.
    assert_eq!(network.lost_frames() + 16, 3 * 40);
    // More events than the shell keeps.
    for _ in 0..1100 {
        network.write(NODE, ERRORS, 1).unwrap();
    }
    let mut kept = 0;
    while network.next_event(network.now()).unwrap().is_some() {
        kept += 1;
    }
    assert_eq!(kept + network.missed_events(), 1100);
}
