//! How often the shells call their link in one SDO round trip. Each call is one system call or two.
#![cfg(feature = "tokio")]

#[allow(dead_code, reason = "several tests share it")]
#[cfg(unix)]
use std::os::unix::net::UnixDatagram;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::shell_support::{DEVICE_TYPE, station};
#[cfg(unix)]
use lexican_runtime::host::{Descriptor, Node, Station};
use lexican_runtime::host::{
    Incoming, Link, LinkError, Participant, VirtualBus, VirtualLink, blocking, tokio as shell,
};
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};

const NODE: NodeId = NodeId::literal(5);
const TRIPS: usize = 100;

#[derive(Default)]
struct Calls {
    now: AtomicUsize,
    receive: AtomicUsize,
}

impl Calls {
    /// How often the clock was read and a frame received for each round trip, rounded.
    fn per_trip(&self) -> (usize, usize) {
        let rounded = |count: &AtomicUsize| (count.load(Ordering::Relaxed) + TRIPS / 2) / TRIPS;
        (rounded(&self.now), rounded(&self.receive))
    }
}

/// Counts the calls of a link that uses the time of the virtual bus, and need not read the clock to wait.
struct Counting(VirtualLink, Arc<Calls>);

impl Counting {
    fn new(bus: &VirtualBus) -> (Self, Arc<Calls>) {
        let calls = Arc::<Calls>::default();
        (Counting(bus.link(), Arc::clone(&calls)), calls)
    }
}

impl Link for Counting {
    fn now(&self) -> Instant {
        self.1.now.fetch_add(1, Ordering::Relaxed);
        self.0.now()
    }
    fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        self.0.send(frame)
    }
    fn receive(&mut self, until: Instant) -> Result<Option<Incoming>, LinkError> {
        self.1.receive.fetch_add(1, Ordering::Relaxed);
        self.0.receive(until)
    }
    fn is_drained(&self) -> bool {
        true
    }
}

fn bus() -> VirtualBus {
    let bus = VirtualBus::with_bit_rate(500);
    bus.attach(station(NODE));
    bus
}

#[test]
fn the_blocking_shell_receives_once_and_reads_the_clock_twice() {
    let (link, calls) = Counting::new(&bus());
    let mut network = blocking::Network::new(link);
    for _ in 0..TRIPS {
        network.read(NODE, DEVICE_TYPE).unwrap();
    }
    assert_eq!(calls.per_trip(), (2, 1));
}

#[test]
fn the_device_shell_receives_once_and_reads_the_clock_twice() {
    let bus = VirtualBus::with_bit_rate(500);
    let (link, calls) = Counting::new(&bus);
    let mut other = bus.link();
    let request = Frame::from_array(CobId::of_node(0x600, NODE), [0x40, 0, 0x10, 0, 0, 0, 0, 0]);
    (0..TRIPS).for_each(|_| other.send(&request).unwrap());
    let mut participant = Participant::new(link, station(NODE));
    assert!(participant.run(Instant::ZERO + Duration::from_millis(100)).unwrap().is_none());
    let answers = std::iter::from_fn(|| other.receive_frame(bus.now()).unwrap());
    assert_eq!(answers.filter(|frame| frame.id().raw() == 0x585).count(), TRIPS);
    assert_eq!(calls.per_trip(), (2, 1));
}

/// A link with a descriptor: a device that answers into a socket as soon as a request is sent.
#[cfg(unix)]
struct Socket {
    near: Arc<UnixDatagram>,
    far: UnixDatagram,
    device: Station<28>,
    calls: Arc<Calls>,
}

#[cfg(unix)]
impl Link for Socket {
    fn now(&self) -> Instant {
        self.calls.now.fetch_add(1, Ordering::Relaxed);
        Instant::ZERO
    }
    fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        self.device.handle_frame(Instant::ZERO, frame);
        while let Some(answer) = Node::poll_transmit(&mut self.device, Instant::ZERO) {
            self.far.send(answer.data())?;
        }
        Ok(())
    }
    fn receive(&mut self, _: Instant) -> Result<Option<Incoming>, LinkError> {
        self.calls.receive.fetch_add(1, Ordering::Relaxed);
        let mut data = [0; 8];
        let len = self.near.recv(&mut data).ok();
        let frame = |len| Frame::new(CobId::of_node(0x580, NODE), &data[..len]).unwrap();
        Ok(len.map(|len| Incoming::Frame(frame(len))))
    }
    fn is_drained(&self) -> bool {
        true
    }
    fn descriptor(&self) -> Option<Descriptor> {
        Some(self.near.clone())
    }
}

#[cfg(unix)]
#[tokio::test]
async fn the_tokio_shell_receives_once_and_reads_the_clock_twice() {
    let (near, far) = UnixDatagram::pair().unwrap();
    near.set_nonblocking(true).unwrap();
    let mut device = station(NODE);
    // Its boot-up message.
    assert!(Node::poll_transmit(&mut device, Instant::ZERO).is_some());
    let calls = Arc::<Calls>::default();
    let link = Socket { near: Arc::new(near), far, device, calls: Arc::clone(&calls) };
    let network = shell::Network::spawn(link).unwrap();
    for _ in 0..TRIPS {
        assert_eq!(network.read(NODE, DEVICE_TYPE).await.unwrap(), 0x0002_0192);
    }
    assert_eq!(calls.per_trip(), (2, 1));
}
