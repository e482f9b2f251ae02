//! The tokio shell when nodes are silent, links fail, or time ends.
#![cfg(feature = "tokio")]

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

use crate::rig::tampered;
use crate::shell_support::{DEVICE_TYPE, HEARTBEAT, NAME, has_timed_out, station};
use lexican_runtime::host::tokio::Network;
use lexican_runtime::host::{Incoming, Link, LinkError, Pace, VirtualBus, VirtualLink};
use lexican_runtime::manager::Remote;
use lexican_runtime::wire::nmt::NmtCommand;
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};

const NODE: NodeId = NodeId::literal(1);
const SILENT: NodeId = NodeId::literal(100);

fn network() -> (VirtualBus, Network) {
    let bus = VirtualBus::with_bit_rate(500);
    bus.attach(station(NODE));
    let network = Network::spawn(bus.link()).unwrap();
    (bus, network)
}

#[tokio::test]
async fn a_thousand_reads_of_a_silent_node_end_together() {
    let (bus, network) = network();
    let read = |network: Network| tokio::spawn(async move { network.read(SILENT, DEVICE_TYPE).await });
    let reads: Vec<_> = (0..1000).map(|_| read(network.clone())).collect();
    for read in reads {
        has_timed_out(SILENT, read.await.unwrap());
    }
    assert!(bus.now() < Instant::from_micros(2_100_000), "{}", bus.now());
    // A later call is tried.
    let began = bus.now();
    has_timed_out(SILENT, network.read(SILENT, DEVICE_TYPE).await);
    assert!(bus.now().since(began) >= Duration::from_secs(1));
}

#[tokio::test]
async fn a_call_takes_no_longer_than_its_patience() {
    let (bus, network) = network();
    let hasty = network.clone().with_patience(Duration::from_millis(30));
    let patient = tokio::spawn({
        let network = network.clone();
        async move { network.read(SILENT, DEVICE_TYPE).await }
    });
    tokio::task::yield_now().await;
    // The first call waits behind the other one; the second one is in progress itself.
    for _ in 0..2 {
        let began = bus.now();
        has_timed_out(SILENT, hasty.read(SILENT, DEVICE_TYPE).await);
        let took = bus.now().since(began);
        assert!(took >= Duration::from_millis(30) && took < Duration::from_millis(40), "{took:?}");
        while !patient.is_finished() {
            tokio::task::yield_now().await;
        }
    }
    has_timed_out(SILENT, patient.await.unwrap());
    assert_eq!(hasty.read(NODE, DEVICE_TYPE).await.unwrap(), 0x0002_0192);
}

#[tokio::test]
async fn every_call_reports_why_the_link_has_failed() {
    let bus = VirtualBus::with_bit_rate(500);
    // The link fails once a frame has been sent.
    let has_failed = Arc::new(AtomicBool::new(false));
    let fails = Arc::clone(&has_failed);
    let send = move |_: &mut VirtualLink, _: &Frame| {
        fails.store(true, Ordering::Relaxed);
        Ok(())
    };
    let receive = move |link: &mut VirtualLink, until| {
        if has_failed.load(Ordering::Relaxed) {
            return Err(LinkError::Io(std::io::Error::other("the adapter burns")));
        }
        link.receive(until)
    };
    let network = Network::spawn(tampered(bus.link(), send, receive)).unwrap();
    let mut events = network.events();
    let reads = [NODE, SILENT].map(|node| {
        let network = network.clone();
        tokio::spawn(async move { network.read(node, DEVICE_TYPE).await.unwrap_err().to_string() })
    });
    let words = "the link to the bus failed: the adapter burns";
    for read in reads {
        assert_eq!(read.await.unwrap(), words);
    }
    while events.recv().await.is_ok() {}
    assert_eq!(network.command(NmtCommand::Stop, None).await.unwrap_err().to_string(), words);
    assert_eq!(network.write(NODE, HEARTBEAT, 1).await.unwrap_err().to_string(), words);
    assert_eq!(network.with_manager(|_, _| {}).await.unwrap_err().to_string(), words);
    assert_eq!(network.now().await.unwrap_err().to_string(), words);
    assert!(network.events().recv().await.is_err(), "there will be no event");
}

/// A link in real time without a descriptor. It counts reads; no read may wait.
struct Port(tokio::time::Instant, Arc<AtomicUsize>);

impl Link for Port {
    fn now(&self) -> Instant {
        Instant::ZERO + self.0.elapsed().into()
    }
    fn send(&mut self, _: &Frame) -> Result<(), LinkError> {
        Ok(())
    }
    fn receive(&mut self, until: Instant) -> Result<Option<Incoming>, LinkError> {
        assert!(until <= self.now(), "the task would be blocked");
        self.1.fetch_add(1, Ordering::Relaxed);
        Ok(None)
    }
    fn is_real_time(&self) -> bool {
        true
    }
}

#[tokio::test(start_paused = true)]
async fn a_link_without_descriptor_does_not_block_the_task() {
    let looks = Arc::new(AtomicUsize::new(0));
    let network = Network::spawn(Port(tokio::time::Instant::now(), Arc::clone(&looks))).unwrap();
    has_timed_out(SILENT, network.read(SILENT, DEVICE_TYPE).await);
    let looks = looks.load(Ordering::Relaxed);
    assert!((400..1100).contains(&looks), "{looks} looks in a second");
}

#[tokio::test]
async fn the_virtual_bus_in_real_time_does_not_block_the_task() {
    let (bus, network) = network();
    bus.set_pace(Pace::RealTime);
    let read = network.read(NODE, DEVICE_TYPE);
    assert_eq!(tokio::time::timeout(std::time::Duration::from_secs(10), read).await.unwrap().unwrap(), 0x0002_0192);
}

/// A link at the end of time.
struct Last(Arc<AtomicUsize>);

impl Link for Last {
    fn now(&self) -> Instant {
        Instant::MAX
    }
    fn send(&mut self, _: &Frame) -> Result<(), LinkError> {
        self.0.fetch_add(1, Ordering::Relaxed);
        Ok(())
    }
    fn receive(&mut self, _: Instant) -> Result<Option<Incoming>, LinkError> {
        Ok(None)
    }
    fn is_real_time(&self) -> bool {
        true
    }
}

#[tokio::test(start_paused = true)]
async fn at_the_end_of_time_no_loop_is_endless() {
    let sent = Arc::new(AtomicUsize::new(0));
    let network = Network::spawn(Last(Arc::clone(&sent))).unwrap();
    let watch = |manager: &mut lexican_runtime::manager::Manager<127>, now| {
        manager.produce_sync(now, CobId::SYNC, Duration::from_millis(1), 0);
        manager.add(now, Remote::new(NODE).with_guarding(Duration::from_millis(1), 3)).unwrap();
    };
    network.with_manager(watch).await.unwrap();
    tokio::time::sleep(std::time::Duration::from_secs(1)).await;
    assert_eq!(network.now().await.unwrap(), Instant::MAX);
    assert!(sent.load(Ordering::Relaxed) < 10, "{sent:?}");
}

#[tokio::test]
async fn a_frame_that_is_posted_is_the_next_one_to_be_sent() {
    let bus = VirtualBus::with_bit_rate(500);
    bus.attach(station(NODE));
    let sent = Arc::new(Mutex::new(Vec::new()));
    let list = Arc::clone(&sent);
    let send = move |link: &mut VirtualLink, frame: &Frame| {
        list.lock().unwrap().push(*frame);
        link.send(frame)
    };
    let network = Network::spawn(tampered(bus.link(), send, VirtualLink::receive)).unwrap();
    let writer = tokio::spawn({
        let network = network.clone();
        async move {
            loop {
                network.write_bytes(NODE, NAME, b"in many segments").await.unwrap();
            }
        }
    });
    let commands: Vec<_> = (0..50)
        .map(|_| {
            let network = network.clone();
            tokio::spawn(async move { network.command(NmtCommand::Start, None).await })
        })
        .collect();
    for byte in 0..100 {
        tokio::task::yield_now().await;
        let (before, stop) = (sent.lock().unwrap().len(), Frame::from_array(CobId::of_node(0x200, NODE), [byte]));
        network.post(stop).unwrap();
        while sent.lock().unwrap().len() == before {
            tokio::task::yield_now().await;
        }
        assert_eq!(sent.lock().unwrap()[before], stop);
    }
    writer.abort();
    drop(commands);
}
