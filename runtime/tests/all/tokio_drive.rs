//! Who runs the network of the tokio shell: calls in `block_on`, and the task in the background for all else.
#![cfg(all(feature = "tokio", unix))]

use std::future::poll_fn;
use std::os::unix::net::UnixDatagram;
use std::pin::{Pin, pin};
use std::sync::{Arc, Mutex};
use std::task::Poll;
use std::thread;

use lexican_runtime::host::tokio::{Event, Network, Runner};
use lexican_runtime::host::{Descriptor, Incoming, Link, LinkError, Node, Station};
use lexican_runtime::manager::{self, Manager};
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};

use crate::shell_support::{DEVICE_TYPE, has_timed_out, station};

const NODE: NodeId = NodeId::literal(5);
const STRANGER: NodeId = NodeId::literal(9);

/// Polls once; true when the future is ready.
async fn polled_once<F: Future>(mut future: Pin<&mut F>) -> bool {
    poll_fn(|context| Poll::Ready(future.as_mut().poll(context).is_ready())).await
}

/// What was done to the link since it was last asked.
#[derive(Default)]
struct Seen {
    /// Sends and receptions in a task, and those outside of one.
    in_task: usize,
    outside: usize,
    syncs: usize,
}

type Log = Arc<Mutex<Seen>>;

/// A link in real time with a descriptor: the device answers into a socket as soon as a request is sent.
struct Socket {
    near: Arc<UnixDatagram>,
    far: Arc<UnixDatagram>,
    device: Station<28>,
    log: Log,
    began: tokio::time::Instant,
}

impl Socket {
    /// The link, what is done to it, and the other end, which receives what is sent into it.
    fn new() -> (Self, Log, Arc<UnixDatagram>) {
        let (near, far) = UnixDatagram::pair().unwrap();
        near.set_nonblocking(true).unwrap();
        let (far, log) = (Arc::new(far), Log::default());
        let began = tokio::time::Instant::now();
        let mut device = station(NODE);
        // Its boot-up message.
        assert!(Node::poll_transmit(&mut device, Instant::ZERO).is_some());
        let socket = Socket { near: Arc::new(near), far: Arc::clone(&far), device, log: Arc::clone(&log), began };
        (socket, log, far)
    }

    fn note(&self) {
        let mut log = self.log.lock().unwrap();
        match tokio::task::try_id() {
            Some(_) => log.in_task += 1,
            None => log.outside += 1,
        }
    }
}

/// A frame as the socket carries it.
fn datagram(frame: &Frame) -> Vec<u8> {
    let id = u16::try_from(frame.id().raw()).unwrap();
    [&id.to_le_bytes(), frame.data()].concat()
}

impl Link for Socket {
    fn now(&self) -> Instant {
        Instant::ZERO + self.began.elapsed().into()
    }
    fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        self.note();
        self.log.lock().unwrap().syncs += usize::from(frame.id() == CobId::SYNC);
        self.device.handle_frame(Instant::ZERO, frame);
        while let Some(answer) = Node::poll_transmit(&mut self.device, Instant::ZERO) {
            self.far.send(&datagram(&answer))?;
        }
        Ok(())
    }
    fn receive(&mut self, _: Instant) -> Result<Option<Incoming>, LinkError> {
        self.note();
        let mut bytes = [0; 10];
        let Ok(len) = self.near.recv(&mut bytes) else { return Ok(None) };
        let [low, high, data @ ..] = &bytes[..len] else { panic!("an identifier comes first") };
        let id = CobId::standard(u16::from_le_bytes([*low, *high])).unwrap();
        Ok(Some(Incoming::Frame(Frame::new(id, data).unwrap())))
    }
    fn descriptor(&self) -> Option<Descriptor> {
        Some(self.near.clone())
    }
    fn is_real_time(&self) -> bool {
        true
    }
}

#[tokio::test]
async fn a_call_in_block_on_runs_the_network_itself_and_one_in_a_task_leaves_it_to_the_other_task() {
    let (link, log, _far) = Socket::new();
    let network = Network::spawn(link).unwrap();
    network.read(NODE, DEVICE_TYPE).await.unwrap();
    *log.lock().unwrap() = Seen::default();
    for _ in 0..10 {
        network.read(NODE, DEVICE_TYPE).await.unwrap();
    }
    let seen = std::mem::take(&mut *log.lock().unwrap());
    assert_eq!((seen.in_task, seen.outside >= 20), (0, true), "{} outside", seen.outside);
    tokio::spawn(async move { network.read(NODE, DEVICE_TYPE).await }).await.unwrap().unwrap();
    assert!(log.lock().unwrap().in_task >= 2);
}

/// How many SYNCs are sent in 500 ms in which nobody calls, and whether a frame is received then.
async fn served(log: &Log, network: &Network, far: &UnixDatagram) -> usize {
    log.lock().unwrap().syncs = 0;
    let mut events = network.events();
    far.send(&datagram(&Frame::from_array(CobId::of_node(0x700, STRANGER), [0]))).unwrap();
    tokio::time::sleep(std::time::Duration::from_millis(500)).await;
    let booted = Event::Manager(manager::Event::BootedUp { node: STRANGER });
    assert_eq!(events.try_recv().ok(), Some(booted));
    log.lock().unwrap().syncs
}

#[tokio::test(start_paused = true)]
async fn the_task_goes_on_when_a_call_has_ended_or_is_dropped_or_no_longer_polled() {
    let (link, log, far) = Socket::new();
    let network = Network::spawn(link).unwrap();
    let produce =
        |manager: &mut Manager<127>, now| manager.produce_sync(now, CobId::SYNC, Duration::from_millis(10), 0);
    network.with_manager(produce).await.unwrap();
    let is_kept = |syncs: usize| assert!((48..=52).contains(&syncs), "{syncs} in 500 ms");

    network.read(NODE, DEVICE_TYPE).await.unwrap();
    is_kept(served(&log, &network, &far).await);

    // Nobody answers as the stranger.
    let mut read = Box::pin(network.read(STRANGER, DEVICE_TYPE));
    assert!(!polled_once(read.as_mut()).await);
    drop(read);
    is_kept(served(&log, &network, &far).await);

    let mut read = pin!(network.read(STRANGER, DEVICE_TYPE));
    assert!(!polled_once(read.as_mut()).await);
    is_kept(served(&log, &network, &far).await);
    has_timed_out(STRANGER, read.await);
}

#[tokio::test(start_paused = true)]
async fn of_two_calls_in_one_future_either_runs_the_network_for_the_other() {
    let (link, _log, _far) = Socket::new();
    let network = Network::spawn(link).unwrap();
    let hasty = network.clone().with_patience(Duration::from_millis(20));
    let (lost, read) = tokio::join!(hasty.read(STRANGER, DEVICE_TYPE), network.read(NODE, DEVICE_TYPE));
    assert!(lost.is_err());
    assert_eq!(read.unwrap(), 0x0002_0192);
    // Dropped in the middle by `select!`, while the other goes on.
    for _ in 0..10 {
        let silent = network.read(STRANGER, DEVICE_TYPE);
        tokio::select! {
            biased;
            lost = silent => panic!("{lost:?}"),
            read = network.read(NODE, DEVICE_TYPE) => assert_eq!(read.unwrap(), 0x0002_0192),
        }
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn calls_in_tasks_and_in_block_on_share_a_network_of_many_threads() {
    let (link, _log, _far) = Socket::new();
    let network = Network::spawn(link).unwrap();
    let read = |network: Network| async move {
        for _ in 0..500 {
            assert_eq!(network.read(NODE, DEVICE_TYPE).await.unwrap(), 0x0002_0192);
        }
    };
    let tasks: Vec<_> = (0..4).map(|_| tokio::spawn(read(network.clone()))).collect();
    read(network).await;
    for task in tasks {
        task.await.unwrap();
    }
}

#[test]
fn threads_that_block_share_a_network() {
    let (link, _log, _far) = Socket::new();
    let (runner, network) = Runner::spawn(link).unwrap();
    thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| {
                for _ in 0..500 {
                    assert_eq!(runner.block_on(network.read(NODE, DEVICE_TYPE)).unwrap(), 0x0002_0192);
                }
            });
        }
    });
}

#[tokio::test]
async fn a_panic_in_a_turn_ends_the_network_for_all() {
    let (link, _log, _far) = Socket::new();
    let network = Network::spawn(link).unwrap();
    network.with_manager(|_, _| panic!("of a test")).await.unwrap();
    let reads = [0, 1].map(|_| {
        let network = network.clone();
        tokio::spawn(async move { network.read(NODE, DEVICE_TYPE).await.unwrap_err().to_string() })
    });
    for read in reads {
        assert_eq!(read.await.unwrap(), LinkError::Closed.to_string());
    }
}
