//! Both shells boot a network in one call, and keep it up.
#![cfg(feature = "tokio")]

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::shell_support::{DEVICE_TYPE, HEARTBEAT, NAME, station};
use lexican_runtime::host::tokio as shell;
use lexican_runtime::host::{BootNetworkError, Fate, Plan, VirtualBus, blocking};
use lexican_runtime::manager::{Assignment, Event, NetworkEvent, OnLoss};
use lexican_runtime::procedure::{BootError, ConciseDcf, Step};
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{Duration, NodeId};

const FIVE: NodeId = NodeId::literal(5);
const SIX: NodeId = NodeId::literal(6);
const BOOT_TIME: Duration = Duration::from_secs(60);

/// Nodes 5 and 6, which have a heartbeat of 100 ms once configured. Frames of node 5 are lost while it
/// is unplugged.
fn bus() -> (VirtualBus, Arc<AtomicBool>) {
    let (bus, unplugged) = (VirtualBus::with_bit_rate(500), Arc::new(AtomicBool::new(false)));
    for node in [FIVE, SIX] {
        bus.attach(station(node));
    }
    let is_unplugged = Arc::clone(&unplugged);
    bus.set_fate(move |_, frame| {
        let is_lost = is_unplugged.load(Ordering::Relaxed) && frame.id().raw() & 0x7F == 5;
        if is_lost { Fate::Lose } else { Fate::Deliver }
    });
    (bus, unplugged)
}

fn plan(device_type: u32) -> Plan {
    let mut plan = Plan::new(OnLoss::ResetNode);
    for node in [FIVE, SIX] {
        let settings = ConciseDcf::to_vec([Step::write(HEARTBEAT, 100)]).unwrap();
        let mut assignment = Assignment::new(node, settings).with_heartbeat(Duration::from_millis(250));
        assignment.plan.device_type = Some(device_type);
        plan.assign(node, assignment).unwrap();
    }
    plan
}

const READY: [NetworkEvent; 3] = [NetworkEvent::Booted(FIVE), NetworkEvent::Booted(SIX), NetworkEvent::Ready];

/// The events after node 5 is unplugged and plugged in again.
fn back() -> Vec<NetworkEvent> {
    vec![NetworkEvent::Lost { node: FIVE, mandatory: true }, NetworkEvent::Booted(FIVE), NetworkEvent::Ready]
}

#[test]
fn the_blocking_shell_boots_a_network_and_keeps_it_up() {
    let (bus, unplugged) = bus();
    let mut network = blocking::Network::new(bus.link());
    let mut events = Vec::new();
    network.boot(plan(0x0002_0192), BOOT_TIME, |event| events.push(*event)).unwrap();
    assert_eq!(events, READY);
    assert_eq!(network.read(SIX, HEARTBEAT).unwrap(), 100);
    assert_eq!(network.manager().remote(FIVE).unwrap().state(), Some(NmtState::Operational));

    let mut events = Vec::new();
    let mut listen = |network: &mut blocking::Network<_>, ms| {
        let until = network.now() + Duration::from_millis(ms);
        while let Some(event) = network.next_event(until).unwrap() {
            if let Event::Network(event) = event {
                events.push(event);
            }
        }
    };
    unplugged.store(true, Ordering::Relaxed);
    listen(&mut network, 500);
    unplugged.store(false, Ordering::Relaxed);
    listen(&mut network, 2000);
    assert_eq!(events, back());
}

#[test]
fn a_transfer_waits_while_its_node_is_booted() {
    let (bus, unplugged) = bus();
    let mut network = blocking::Network::new(bus.link());
    network.boot(plan(0x0002_0192), BOOT_TIME, |_| {}).unwrap();
    unplugged.store(true, Ordering::Relaxed);
    let lost = Event::Network(back()[0]);
    network.wait_for(Duration::from_secs(1), |event| (*event == lost).then_some(())).unwrap().unwrap();
    unplugged.store(false, Ordering::Relaxed);
    // The read uses the SDO channel of the boot, and so comes after it.
    assert_eq!(network.read(FIVE, HEARTBEAT).unwrap(), 100);
    assert!(network.kept().unwrap().has_booted(FIVE));
}

#[test]
fn a_network_that_does_not_get_ready_names_each_node_and_why() {
    let (bus, unplugged) = bus();
    let mut network = blocking::Network::new(bus.link());
    let error = network.boot(plan(0x191), BOOT_TIME, |_| {}).unwrap_err();
    assert_eq!(
        error.to_string(),
        "node 5 has not booted: the device type (1000h) is 00020192h, and not 00000191h; \
         node 6 has not booted: the device type (1000h) is 00020192h, and not 00000191h"
    );
    unplugged.store(true, Ordering::Relaxed);
    let BootNetworkError::NotReady(error) = network.boot(plan(0x0002_0192), BOOT_TIME, |_| {}).unwrap_err() else {
        panic!("the link is well")
    };
    assert!(matches!(error.nodes[..], [(FIVE, Some(BootError::NoDeviceType(_)))]), "{error}");
    let error = network.boot(plan(0x0002_0192), Duration::from_millis(500), |_| {}).unwrap_err();
    assert_eq!(error.to_string(), "node 5 has not booted in time");
}

#[tokio::test]
async fn the_tokio_shell_boots_a_network_and_keeps_it_up() {
    let (bus, unplugged) = bus();
    let network = shell::Network::spawn(bus.link()).unwrap();
    let error = network.boot(plan(0x191), BOOT_TIME, |_| {}).await.unwrap_err();
    let begin = "node 5 has not booted: the device type (1000h) is 00020192h, and not 00000191h; node 6";
    assert!(error.to_string().starts_with(begin), "{error}");
    let mut events = Vec::new();
    network.boot(plan(0x0002_0192), BOOT_TIME, |event| events.push(*event)).await.unwrap();
    assert_eq!(events, READY);

    let mut listener = network.events();
    let mut next = async || loop {
        if let shell::Event::Manager(Event::Network(event)) = listener.recv().await.unwrap() {
            return event;
        }
    };
    unplugged.store(true, Ordering::Relaxed);
    assert_eq!(next().await, back()[0]);
    unplugged.store(false, Ordering::Relaxed);
    // The node is being booted: the transfer waits for its end.
    assert_eq!(network.read(FIVE, DEVICE_TYPE).await.unwrap(), 0x0002_0192);
    assert_eq!(network.read_bytes(FIVE, NAME).await.unwrap(), b"");
    assert_eq!([next().await, next().await], back()[1..]);
}
