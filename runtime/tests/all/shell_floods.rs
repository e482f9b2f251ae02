//! A link that always has a frame delays neither deadlines, nor the end of a wait, nor transmission.
#![cfg(feature = "tokio")]

use crate::rig::tampered;
use crate::shell_support::{DEVICE_TYPE, Frames, HEARTBEAT, NAME, has_timed_out, observed, station};
use lexican_runtime::host::{Incoming, Link, Notice, Participant, VirtualBus, VirtualLink, blocking, tokio as shell};
use lexican_runtime::manager::{Event, Remote};
use lexican_runtime::wire::nmt::NmtCommand;
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};

const NODE: NodeId = NodeId::literal(5);
const SILENT: NodeId = NodeId::literal(100);

/// The time that a read of the link takes.
const LOOK: Duration = Duration::from_micros(50);

/// A link that always has a frame; every other one is from the bus behind it.
fn flooded(bus: &VirtualBus, frame: Frame) -> impl Link + Send + 'static {
    let (clock, mut is_others) = (bus.clone(), false);
    let receive = move |link: &mut VirtualLink, _| {
        clock.advance(LOOK);
        assert!(clock.now() < Instant::ZERO + Duration::from_secs(60), "a wait does not end");
        is_others = !is_others;
        let others = if is_others { link.receive(clock.now())? } else { None };
        Ok(Some(others.unwrap_or(Incoming::Frame(frame))))
    };
    tampered(bus.link(), VirtualLink::send, receive)
}

fn flood_of_pdos(bus: &VirtualBus) -> impl Link + Send + 'static {
    flooded(bus, Frame::from_array(CobId::of_node(0x180, NodeId::literal(9)), [1, 2]))
}

/// A bus with a device, and the frames on it.
fn bus() -> (VirtualBus, Frames) {
    let bus = VirtualBus::with_bit_rate(500);
    bus.attach(station(NODE));
    let frames = observed(&bus);
    (bus, frames)
}

#[track_caller]
fn has_syncs(frames: &Frames) {
    let syncs = frames.lock().unwrap().iter().filter(|(_, frame)| frame.id() == CobId::SYNC).count();
    assert!(syncs > 70, "{syncs}");
}

#[test]
fn the_blocking_shell_reads_and_notices_silence_and_loss() {
    let (bus, frames) = bus();
    let mut network = blocking::Network::new(flood_of_pdos(&bus));
    let now = network.now();
    network.manager().produce_sync(now, CobId::SYNC, Duration::from_millis(10), 0);
    network.manager().add(now, Remote::new(NODE).with_heartbeat(Duration::from_millis(100))).unwrap();
    assert_eq!(network.read(NODE, DEVICE_TYPE).unwrap(), 0x0002_0192);
    network.write(NODE, HEARTBEAT, 20).unwrap();
    network.write_bytes(NODE, NAME, b"in many segments").unwrap();
    has_timed_out(SILENT, network.read(SILENT, DEVICE_TYPE));
    has_syncs(&frames);
    network.write(NODE, HEARTBEAT, 0).unwrap();
    let lost = network.wait_for(Duration::from_secs(1), |event| matches!(event, Event::Lost { .. }).then_some(()));
    assert_eq!(lost.unwrap(), Some(()));
}

#[test]
fn the_blocking_shell_ends_its_waits() {
    let (bus, _) = bus();
    let mut network = blocking::Network::new(flood_of_pdos(&bus));
    let until = network.now() + Duration::from_secs(1);
    while network.next_event(until).unwrap().is_some() {}
    assert!(network.now() < until + Duration::from_millis(300), "{}", network.now());
    assert_eq!(network.wait_for(Duration::from_secs(1), |_| None::<()>).unwrap(), None);
}

#[test]
fn the_device_shell_sends_its_heartbeat_and_ends() {
    let bus = VirtualBus::new();
    let mut witness = bus.link();
    let beat = Frame::from_array(CobId::of_node(0x600, NODE), [0x2B, 0x17, 0x10, 0, 10, 0, 0, 0]);
    // A flood of requests, all of which the device answers.
    let question = Frame::from_array(CobId::of_node(0x600, NODE), [0x40, 0, 0x10, 0, 0, 0, 0, 0]);
    let mut participant = Participant::new(flooded(&bus, question), station(NODE));
    witness.send(&beat).unwrap();
    for ms in [500, 1000] {
        let until = Instant::ZERO + Duration::from_millis(ms);
        assert!(participant.run(until).unwrap().is_none());
        assert!(bus.now() < until + Duration::from_millis(300), "{}", bus.now());
    }
    let heard: Vec<Frame> = std::iter::from_fn(|| witness.receive_frame(bus.now()).unwrap()).collect();
    let of = |base| heard.iter().filter(|frame| frame.id() == CobId::of_node(base, NODE)).count();
    assert!(of(0x700) > 70 && of(0x580) > 1000, "{} heartbeats, {} answers", of(0x700), of(0x580));
}

#[tokio::test]
async fn the_tokio_shell_reads_and_notices_silence_and_loss() {
    let (bus, frames) = bus();
    // Frames that are no events: a listener keeps only the last 1024 of those that are.
    let flood = Frame::from_array(CobId::NMT, [1, 9]);
    let network = shell::Network::spawn(flooded(&bus, flood)).unwrap();
    network
        .with_manager(|manager, now| {
            manager.produce_sync(now, CobId::SYNC, Duration::from_millis(10), 0);
            manager.add(now, Remote::new(NODE).with_heartbeat(Duration::from_millis(100))).unwrap();
        })
        .await
        .unwrap();
    assert_eq!(network.read(NODE, DEVICE_TYPE).await.unwrap(), 0x0002_0192);
    network.write(NODE, HEARTBEAT, 20).await.unwrap();
    has_timed_out(SILENT, network.read(SILENT, DEVICE_TYPE).await);
    has_syncs(&frames);
    network.command(NmtCommand::Start, Some(NODE)).await.unwrap();
    let mut events = network.events();
    network.write(NODE, HEARTBEAT, 0).await.unwrap();
    while events.recv().await.unwrap() != shell::Event::Manager(Event::Lost { node: NODE }) {}
}

/// A link that has once lost seven frames.
fn lossy(bus: &VirtualBus) -> impl Link + Send + 'static {
    let mut lost = Some(Incoming::Gap(7));
    let receive = move |link: &mut VirtualLink, until| match lost.take() {
        None => link.receive(until),
        lost => Ok(lost),
    };
    tampered(bus.link(), VirtualLink::send, receive)
}

#[tokio::test]
async fn every_shell_reports_that_frames_are_missing() {
    let (bus, _) = bus();
    let mut network = blocking::Network::new(lossy(&bus));
    assert_eq!(network.read(NODE, DEVICE_TYPE).unwrap(), 0x0002_0192);
    assert_eq!(network.lost_frames(), 7);
    let mut participant = Participant::new(lossy(&bus), station(SILENT));
    let until = participant.now() + Duration::from_millis(1);
    assert!(matches!(participant.run(until), Ok(Some(Notice::Gap(7)))));
    assert!(matches!(participant.run(until), Ok(None)));
    let network = shell::Network::spawn(lossy(&bus)).unwrap();
    assert_eq!(network.events().recv().await.unwrap(), shell::Event::Gap(7));
}
