//! The blocking shell, over the virtual bus.
#![cfg(feature = "std")]

use std::cell::Cell;
use std::rc::Rc;

use crate::rig::tampered;
use crate::shell_support::{DEVICE_TYPE, HEARTBEAT, NAME, has_timed_out, station};
use lexican_runtime::host::blocking::Network;
use lexican_runtime::host::{AccessError, Link, LinkError, VirtualBus, VirtualLink};
use lexican_runtime::manager::Event;
use lexican_runtime::object::{Address, Object, Ro};
use lexican_runtime::service::sdo_client::SdoError;
use lexican_runtime::wire::nmt::{NmtCommand, NmtState};
use lexican_runtime::{AbortCode, Duration, Frame, NodeId};

const NODE: NodeId = NodeId::literal(5);

fn network() -> Network<VirtualLink> {
    let bus = VirtualBus::with_bit_rate(500);
    bus.attach(station(NODE));
    Network::new(bus.link())
}

#[test]
fn objects_are_read_and_written_while_events_wait() {
    let mut network = network();
    assert_eq!(network.read(NODE, DEVICE_TYPE).unwrap(), 0x0002_0192);
    network.write(NODE, HEARTBEAT, 100).unwrap();
    network.command(NmtCommand::Start, Some(NODE)).unwrap();
    network.write_bytes(NODE, NAME, b"a drive of mine").unwrap();
    assert_eq!(network.read_bytes(NODE, NAME).unwrap(), b"a drive of mine");

    let soon = network.now() + Duration::from_millis(150);
    assert_eq!(network.next_event(soon).unwrap(), Some(Event::BootedUp { node: NODE }));
    let started = Event::StateChanged { node: NODE, state: NmtState::Operational };
    let heard = network.wait_for(Duration::from_millis(150), |event| (*event == started).then_some(()));
    assert_eq!(heard.unwrap(), Some(()));
}

#[test]
fn errors_name_node_and_address() {
    let mut network = network();
    let error = network.write(NODE, HEARTBEAT, 1001).unwrap_err();
    assert!(matches!(error, AccessError::OutOfRange(_)), "{error}");
    let error = network.read(NODE, Object::<u8, Ro>::new(0x3000, 1)).unwrap_err();
    let code = AbortCode::NO_SUCH_OBJECT;
    let expected = SdoError::Aborted { address: Address::new(0x3000, 1), code };
    assert!(matches!(error, AccessError::Sdo { error, .. } if error == expected), "{error}");
    let error = network.read(NodeId::literal(6), DEVICE_TYPE).unwrap_err();
    assert_eq!(format!("{error}"), "node 6: 1000:00: no answer of the device in time");
}

#[test]
fn a_transfer_that_the_link_refused_does_not_block_the_next_one() {
    let ails = Rc::new(Cell::new(true));
    let is_ill = Rc::clone(&ails);
    let send =
        move |link: &mut VirtualLink, frame: &Frame| if is_ill.get() { Err(LinkError::Full) } else { link.send(frame) };
    let mut network = Network::new(tampered(network().into_link(), send, VirtualLink::receive));
    assert!(matches!(network.read(NODE, DEVICE_TYPE), Err(AccessError::Link(LinkError::Full))));
    assert!(matches!(network.read(NODE, DEVICE_TYPE), Err(AccessError::Link(LinkError::Full))));
    ails.set(false);
    assert_eq!(network.read(NODE, DEVICE_TYPE).unwrap(), 0x0002_0192);
}

#[test]
fn a_read_through_the_manager_is_not_mistaken_for_one_of_the_shell() {
    let other = NodeId::literal(6);
    let bus = VirtualBus::with_bit_rate(500);
    bus.attach(station(NODE));
    bus.attach(station(other));
    let mut network = Network::new(bus.link());
    for node in [NODE, other] {
        assert_eq!(network.read(node, DEVICE_TYPE).unwrap(), 0x0002_0192);
    }
    for node in [NODE, other] {
        let now = network.now();
        network.manager().read(now, NODE, HEARTBEAT.address()).unwrap();
        assert_eq!(network.read(node, DEVICE_TYPE).unwrap(), 0x0002_0192);
    }
}

#[test]
fn a_filter_leaves_out_other_nodes_until_it_is_removed() {
    let other = NodeId::literal(6);
    let bus = VirtualBus::with_bit_rate(500);
    bus.attach(station(NODE));
    bus.attach(station(other));
    let mut network = Network::new(bus.link());
    network.listen_to_own(&[]).unwrap();
    assert_eq!(network.read(NODE, DEVICE_TYPE).unwrap(), 0x0002_0192);
    let soon = network.now() + Duration::from_millis(10);
    assert_eq!(network.next_event(soon).unwrap(), Some(Event::BootedUp { node: NODE }));
    assert_eq!(network.next_event(soon).unwrap(), None, "the boot-up message of the other node is left out");
    // The filter admits a node once it has been read.
    assert_eq!(network.read(other, DEVICE_TYPE).unwrap(), 0x0002_0192);
    network.write(other, HEARTBEAT, 5).unwrap();
    let soon = network.now() + Duration::from_millis(8);
    assert!(matches!(network.next_event(soon).unwrap(), Some(Event::Appeared { .. })));
    network.manager().remove(other);
    let soon = network.now() + Duration::from_millis(8);
    assert_eq!(network.next_event(soon).unwrap(), None);
    network.listen_to_all().unwrap();
    let soon = network.now() + Duration::from_millis(8);
    assert!(matches!(network.next_event(soon).unwrap(), Some(Event::Stranger { .. })));
}

#[test]
fn a_call_takes_no_longer_than_its_patience() {
    let mut network = network();
    network.set_patience(Some(Duration::from_millis(30)));
    let began = network.now();
    has_timed_out(NodeId::literal(6), network.read(NodeId::literal(6), DEVICE_TYPE));
    assert_eq!(network.now().since(began), Duration::from_millis(30));
    assert_eq!(network.read(NODE, DEVICE_TYPE).unwrap(), 0x0002_0192);
    network.set_patience(None);
    assert!(network.read(NodeId::literal(6), DEVICE_TYPE).is_err());
    assert!(network.now().since(began) > Duration::from_secs(1));
}
