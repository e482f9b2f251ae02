//! Block transfers send up to 127 frames in a row. Meanwhile, every shell keeps its deadlines.
#![cfg(feature = "tokio")]

use crate::common::{self, NODE};
use crate::rig::{Recorder, TEXT, tampered};
use crate::shell_support::{Frames, observed};
use lexican_runtime::host::{Link, Participant, VirtualBus, VirtualLink, blocking, tokio as shell};
use lexican_runtime::manager::{Event, Manager, Remote};
use lexican_runtime::object::{Address, Object, Ro};
use lexican_runtime::service::sdo_client::SdoClient;
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};

const STATUSWORD: Object<u16, Ro> = Object::new(0x6041, 0);

/// The length of the name in bytes: 2,858 segments, which take 0.7 s.
const LONG: usize = 20_000;

/// The time to transmit a frame.
const FRAME: Duration = Duration::from_micros(250);

/// The period of SYNC and heartbeats during the burst.
const PERIOD: Duration = Duration::from_millis(5);

/// The tolerated delay: four frames, and those in progress.
const SLACK: Duration = Duration::from_millis(3);

/// A link without a queue: sending returns when the frame has been transmitted.
fn queueless(bus: &VirtualBus) -> impl Link + Send + 'static {
    let clock = bus.clone();
    let send = move |link: &mut VirtualLink, frame: &Frame| {
        link.send(frame)?;
        clock.advance(FRAME);
        Ok(())
    };
    tampered(bus.link(), send, VirtualLink::receive)
}

/// Checks that frames with `id` were on the bus, at intervals within the tolerance.
#[track_caller]
fn is_kept(frames: &Frames, id: u16, at_least: usize) {
    let frames = frames.lock().unwrap();
    let times = frames.iter().filter(|(_, frame)| frame.id() == CobId::standard(id).unwrap()).map(|(at, _)| *at);
    let times: Vec<Instant> = times.collect();
    assert!(times.len() >= at_least, "{} times", times.len());
    let longest = times.windows(2).map(|pair| pair[1].since(pair[0])).max().unwrap();
    assert!(longest <= PERIOD + SLACK, "a gap of {longest:?}");
}

/// Adds two nodes, one with a heartbeat; SDO transfers go by block; SYNC is sent.
fn prepare(manager: &mut Manager<127>, now: Instant, watched: NodeId) {
    manager.produce_sync(now, CobId::SYNC, PERIOD, 0);
    manager.add(now, Remote::new(NODE).with_sdo(SdoClient::of_node(NODE).with_block_writes_from(0))).unwrap();
    manager.add(now, Remote::new(watched).with_heartbeat(Duration::from_millis(15))).unwrap();
}

#[test]
fn a_block_download_of_the_blocking_shell_delays_neither_sync_nor_heartbeats() {
    let bus = VirtualBus::with_bit_rate(500);
    let watched = NodeId::literal(9);
    for node in [NODE, watched] {
        bus.attach(Recorder::named(node, LONG));
    }
    let frames = observed(&bus);
    let mut network = blocking::Network::new(queueless(&bus));
    let now = network.now();
    prepare(network.manager(), now, watched);
    network.write_bytes(watched, Address::new(0x1017, 0), &10_u16.to_le_bytes()).unwrap();
    network.write_bytes(NODE, TEXT, &[b'x'; LONG]).unwrap();
    is_kept(&frames, 0x080, 140);
    let now = network.now();
    while let Some(event) = network.next_event(now).unwrap() {
        assert!(!matches!(event, Event::Lost { .. }), "{event:?}");
    }
}

#[tokio::test]
async fn a_block_download_of_the_tokio_shell_delays_neither_sync_nor_other_calls() {
    let bus = VirtualBus::with_bit_rate(500);
    let other = NodeId::literal(9);
    for node in [NODE, other] {
        bus.attach(Recorder::named(node, LONG));
    }
    let frames = observed(&bus);
    let network = shell::Network::spawn(queueless(&bus)).unwrap();
    network.with_manager(move |manager, now| prepare(manager, now, other)).await.unwrap();
    let reader = tokio::spawn({
        let network = network.clone();
        async move {
            loop {
                assert_eq!(network.read(other, STATUSWORD).await.unwrap(), 0x1234);
            }
        }
    });
    network.write_bytes(NODE, TEXT, &[b'x'; LONG]).await.unwrap();
    assert!(!reader.is_finished(), "all reads were answered");
    reader.abort();
    is_kept(&frames, 0x080, 140);
    is_kept(&frames, 0x589, 140);
}

#[test]
fn a_block_upload_of_the_device_shell_does_not_delay_its_heartbeat() {
    let bus = VirtualBus::with_bit_rate(500);
    let mut other = bus.link();
    let frames = observed(&bus);
    let node = Recorder::named(NODE, LONG);
    let mut participant = Participant::new(queueless(&bus), node);
    // A heartbeat every 5 ms; blocks of 127 segments; the block is received, and the next one begins.
    let confirmations = std::iter::repeat_n("605#A27F7F0000000000", 22);
    for frame in
        ["605#2B17100005000000", "605#A00810007F000000", "605#A300000000000000"].into_iter().chain(confirmations)
    {
        other.send(&common::frame(frame)).unwrap();
        let until = participant.now() + Duration::from_millis(40);
        assert!(participant.run(until).unwrap().is_none());
    }
    let heard = std::iter::from_fn(|| other.receive_frame(bus.now()).unwrap());
    assert!(heard.filter(|frame| frame.id().raw() == 0x585).count() > 2_800, "the upload went on");
    is_kept(&frames, 0x705, 190);
}
