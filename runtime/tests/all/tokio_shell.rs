//! The tokio shell, over the virtual bus.
#![cfg(feature = "tokio")]

#[cfg(unix)]
use std::os::unix::net::UnixDatagram;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::shell_support::{DEVICE_TYPE, HEARTBEAT, NAME, has_timed_out, observed, station};
use lexican_runtime::host::tokio::{Event, Network};
use lexican_runtime::host::{AccessError, Incoming, Link, LinkError, VirtualBus};
#[cfg(unix)]
use lexican_runtime::host::{BusState, Descriptor};
use lexican_runtime::manager::Remote;
use lexican_runtime::wire::nmt::{NmtCommand, NmtState};
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId, manager};

const SILENT: NodeId = NodeId::literal(100);

/// A bus with the devices 1 to 8, and a network over it.
fn network() -> (VirtualBus, Network) {
    let bus = VirtualBus::with_bit_rate(500);
    for node in NodeId::all().take(8) {
        bus.attach(station(node));
    }
    let network = Network::spawn(bus.link()).expect("a virtual link needs nothing to be waited for");
    (bus, network)
}

#[tokio::test]
async fn objects_are_read_and_written() {
    let (_, network) = network();
    let node = NodeId::literal(3);
    assert_eq!(network.read(node, DEVICE_TYPE).await.unwrap(), 0x0002_0192);
    network.write(node, HEARTBEAT, 100).await.unwrap();
    assert_eq!(network.read(node, HEARTBEAT).await.unwrap(), 100);
    assert!(matches!(network.write(node, HEARTBEAT, 1001).await, Err(AccessError::OutOfRange(_))));
    network.write_bytes(node, NAME, b"a drive of mine").await.unwrap();
    assert_eq!(network.read_bytes(node, NAME).await.unwrap(), b"a drive of mine");
}

#[tokio::test]
async fn events_reach_every_listener() {
    let (_, network) = network();
    let node = NodeId::literal(3);
    let (mut one, mut other) = (network.events(), network.events());
    network.write(node, HEARTBEAT, 10).await.unwrap();
    network.command(NmtCommand::Start, Some(node)).await.unwrap();
    let operational = Event::Manager(manager::Event::StateChanged { node, state: NmtState::Operational });
    while one.recv().await.unwrap() != operational {}
    while other.recv().await.unwrap() != operational {}
}

#[tokio::test]
async fn a_silent_node_does_not_delay_other_nodes() {
    let (bus, network) = network();
    let silent = tokio::spawn({
        let network = network.clone();
        async move { network.read(SILENT, DEVICE_TYPE).await }
    });
    let busy = NodeId::all().take(8).map(|node| {
        let network = network.clone();
        tokio::spawn(async move {
            for _ in 0..50 {
                network.read(node, DEVICE_TYPE).await.unwrap();
            }
        })
    });
    for task in busy.collect::<Vec<_>>() {
        task.await.unwrap();
    }
    // 400 reads of two frames at 222 us each fill 178 ms of the bus; waiting for the silent node takes 1 s.
    assert!(bus.now() < Instant::from_micros(500_000), "{}", bus.now());
    has_timed_out(SILENT, silent.await.unwrap());
}

#[tokio::test]
async fn a_call_may_be_dropped_at_any_point() {
    let (_, network) = network();
    let node = NodeId::literal(1);
    for polls in 0..20 {
        let mut read = Box::pin(network.read(node, DEVICE_TYPE));
        for _ in 0..polls {
            if futures_poll(read.as_mut()).await {
                break;
            }
        }
        drop(read);
        assert_eq!(network.read(node, HEARTBEAT).await.unwrap(), 0, "after {polls} polls");
    }
}

/// Polls a future once, and lets other tasks run. Returns whether the future is ready.
async fn futures_poll<F: Future>(mut future: std::pin::Pin<&mut F>) -> bool {
    let ready = std::future::poll_fn(|context| std::task::Poll::Ready(future.as_mut().poll(context).is_ready())).await;
    tokio::task::yield_now().await;
    ready
}

#[tokio::test]
async fn the_task_ends_with_the_last_handle() {
    let (_, network) = network();
    let mut events = network.events();
    drop(network);
    while events.recv().await.is_ok() {}
}

#[tokio::test]
async fn a_transfer_survives_when_its_node_is_added_again() {
    let (_, network) = network();
    let reader = tokio::spawn({
        let network = network.clone();
        async move { network.read(SILENT, DEVICE_TYPE).await }
    });
    tokio::task::yield_now().await;
    let watched = Remote::new(SILENT).with_heartbeat(Duration::from_millis(500));
    network.with_manager(move |manager, now| manager.add(now, watched).unwrap()).await.unwrap();
    has_timed_out(SILENT, reader.await.unwrap());
}

#[tokio::test]
async fn a_read_through_the_manager_is_not_mistaken_for_one_of_a_handle() {
    let (_, network) = network();
    let node = NodeId::literal(1);
    network.read(node, DEVICE_TYPE).await.unwrap();
    network.with_manager(move |manager, now| manager.read(now, node, HEARTBEAT.address()).unwrap()).await.unwrap();
    assert_eq!(network.read(node, DEVICE_TYPE).await.unwrap(), 0x0002_0192);
    network.with_manager(move |manager, now| manager.read(now, node, HEARTBEAT.address()).unwrap()).await.unwrap();
    network.write(node, HEARTBEAT, 100).await.unwrap();
    assert_eq!(network.read(node, HEARTBEAT).await.unwrap(), 100);
}

#[tokio::test]
async fn tasks_wait_by_the_time_of_the_link() {
    let (_, network) = network();
    let begin = network.now().await.unwrap();
    let [first, second] = [10, 20].map(|ms| begin + Duration::from_millis(ms));
    // A dropped call does not disturb the others.
    let mut dropped = Box::pin(network.sleep_until(begin + Duration::from_millis(5)));
    assert!(!futures_poll(dropped.as_mut()).await);
    drop(dropped);
    let (later, sooner) = tokio::join!(network.sleep_until(second), network.sleep_until(first));
    assert_eq!((sooner.unwrap(), later.unwrap()), (first, second));
    assert!(network.sleep_until(begin).await.unwrap() >= second, "it has passed");
}

#[tokio::test]
async fn deadlines_are_kept_while_time_passes_in_the_link() {
    let bus = VirtualBus::new();
    let sent = observed(&bus);
    let network = Network::spawn(bus.link()).unwrap();
    let produce = |manager: &mut manager::Manager<127>, now| {
        manager.produce_sync(now, CobId::SYNC, Duration::from_micros(1_500), 0);
    };
    network.with_manager(produce).await.unwrap();
    while sent.lock().unwrap().len() < 10 {
        tokio::task::yield_now().await;
    }
    let spans: Vec<_> = sent.lock().unwrap().windows(2).map(|pair| pair[1].0.since(pair[0].0)).collect();
    assert!(spans.iter().all(|span| *span == Duration::from_micros(1_500)), "{spans:?}");
}

#[test]
fn a_posted_frame_is_sent_even_if_the_runtime_shuts_down() {
    let bus = VirtualBus::new();
    let mut witness = bus.link();
    let frame = Frame::from_array(CobId::NMT, [2, 0]);
    let runtime = tokio::runtime::Builder::new_current_thread().build().unwrap();
    runtime.block_on(async { Network::spawn(bus.link()).unwrap().post(frame).unwrap() });
    drop(runtime);
    assert_eq!(witness.receive_frame(Instant::from_micros(1000)).unwrap(), Some(frame));
}

/// A link that never has room for a frame, and counts the waits for room.
struct Jammed(Arc<AtomicUsize>);

impl Link for Jammed {
    fn now(&self) -> Instant {
        Instant::ZERO
    }
    fn send(&mut self, _: &Frame) -> Result<(), LinkError> {
        self.0.fetch_add(1, Ordering::Relaxed);
        Err(LinkError::Full)
    }
    fn try_send(&mut self, _: &Frame) -> Result<(), LinkError> {
        Err(LinkError::Full)
    }
    fn receive(&mut self, _: Instant) -> Result<Option<Incoming>, LinkError> {
        Ok(None)
    }
}

#[test]
fn a_link_without_room_delays_the_end_of_the_runtime_once_and_not_for_each_frame() {
    let waits = Arc::new(AtomicUsize::new(0));
    let runtime = tokio::runtime::Builder::new_current_thread().build().unwrap();
    runtime.block_on(async {
        let network = Network::spawn(Jammed(Arc::clone(&waits))).unwrap();
        (0..10).for_each(|node| network.post(Frame::from_array(CobId::NMT, [2, node])).unwrap());
    });
    drop(runtime);
    assert_eq!(waits.load(Ordering::Relaxed), 1);
}

/// A link over two sockets that reconnects: it changes to the second one when it reads an `r`.
#[cfg(unix)]
struct Reconnecting {
    sockets: [Arc<UnixDatagram>; 2],
    at: usize,
}

#[cfg(unix)]
impl Link for Reconnecting {
    fn now(&self) -> Instant {
        Instant::ZERO
    }
    fn send(&mut self, _: &Frame) -> Result<(), LinkError> {
        Ok(())
    }
    fn receive(&mut self, _: Instant) -> Result<Option<Incoming>, LinkError> {
        let mut byte = [0];
        match self.sockets[self.at].recv(&mut byte) {
            Ok(_) if byte == *b"r" => {
                self.at = 1;
                Ok(None)
            }
            Ok(_) => Ok(Some(Incoming::Frame(Frame::from_array(CobId::of_node(0x700, SILENT), byte)))),
            Err(_) => Ok(None),
        }
    }
    fn descriptor(&self) -> Option<Descriptor> {
        Some(self.sockets[self.at].clone())
    }
}

#[cfg(unix)]
#[tokio::test]
async fn a_link_that_has_reconnected_is_waited_for() {
    let (first, first_end) = UnixDatagram::pair().unwrap();
    let (second, second_end) = UnixDatagram::pair().unwrap();
    first.set_nonblocking(true).unwrap();
    second.set_nonblocking(true).unwrap();
    let network = Network::spawn(Reconnecting { sockets: [first, second].map(Arc::new), at: 0 }).unwrap();
    let mut events = network.events();
    first_end.send(&[5]).unwrap();
    events.recv().await.unwrap();
    first_end.send(b"r").unwrap();
    // If the shell still waited for the old socket, each frame would wait for the next periodic check: ten seconds in
    // all.
    let heard = async {
        for state in [127, 5].repeat(20) {
            second_end.send(&[state]).unwrap();
            events.recv().await.unwrap();
        }
    };
    tokio::time::timeout(std::time::Duration::from_secs(5), heard).await.expect("frames are received when they come");
}

/// A link that refuses this many frames for lack of room.
struct Crowded<L> {
    link: L,
    refusals: Arc<AtomicUsize>,
}

impl<L: Link> Link for Crowded<L> {
    fn now(&self) -> Instant {
        self.link.now()
    }
    fn send(&mut self, _: &Frame) -> Result<(), LinkError> {
        panic!("the shell does not wait in its link")
    }
    fn try_send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        let decrement = |left: usize| left.checked_sub(1);
        match self.refusals.fetch_update(Ordering::Relaxed, Ordering::Relaxed, decrement) {
            Ok(_) => Err(LinkError::Full),
            Err(_) => self.link.send(frame),
        }
    }
    fn receive(&mut self, until: Instant) -> Result<Option<Incoming>, LinkError> {
        self.link.receive(until)
    }
}

/// A network with device 1 behind a link that refuses this many frames, and the frames on its bus.
fn crowded(refusals: usize) -> (VirtualBus, Network, impl Fn() -> Vec<String>) {
    let bus = VirtualBus::with_bit_rate(500);
    let frames = observed(&bus);
    let heard = move || frames.lock().unwrap().iter().map(|(_, frame)| frame.to_string()).collect();
    bus.attach(station(NodeId::literal(1)));
    let refusals = Arc::new(AtomicUsize::new(refusals));
    let network = Network::spawn(Crowded { link: bus.link(), refusals }).unwrap();
    (bus, network, heard)
}

#[tokio::test]
async fn a_frame_without_room_waits_and_nothing_overtakes_it() {
    let (_, network, heard) = crowded(30);
    let mut events = network.events();
    let [first, second] = [1, 2].map(|byte| Frame::from_array(CobId::standard(0x200).unwrap(), [byte]));
    network.post(first).unwrap();
    let read = network.read(NodeId::literal(1), DEVICE_TYPE);
    network.post(second).unwrap();
    // Meanwhile frames are received: the device boots.
    assert_eq!(events.recv().await.unwrap(), Event::Manager(manager::Event::BootedUp { node: NodeId::literal(1) }));
    assert!(heard().iter().all(|frame| frame == "701#00"), "{:?}", heard());
    assert_eq!(read.await.unwrap(), 0x0002_0192);
    let answer = "581#4300100092010200";
    assert_eq!(heard(), ["701#00", "200#01", "200#02", "601#4000100000000000", answer]);
}

#[tokio::test]
async fn a_frame_that_has_waited_for_100_ms_is_lost_and_its_call_fails() {
    let (bus, network, heard) = crowded(usize::MAX);
    let refused = network.command(NmtCommand::Start, None).await;
    assert!(matches!(refused, Err(LinkError::Full)), "{refused:?}");
    let waited = bus.now().since(Instant::ZERO);
    assert!(waited >= Duration::from_millis(100) && waited < Duration::from_millis(110), "{waited:?}");
    has_timed_out(NodeId::literal(1), network.read(NodeId::literal(1), DEVICE_TYPE).await);
    assert_eq!(heard(), ["701#00"]);
}

#[tokio::test]
async fn a_filter_leaves_out_other_nodes_until_they_are_read() {
    let (_, network) = network();
    let (own, other) = (NodeId::literal(3), NodeId::literal(4));
    let mut events = network.events();
    network.listen_to_own(&[]).await.unwrap();
    for node in [own, other] {
        assert_eq!(network.read(node, DEVICE_TYPE).await.unwrap(), 0x0002_0192);
        network.write(node, HEARTBEAT, 10).await.unwrap();
    }
    network.with_manager(move |manager, _| _ = manager.remove(other)).await.unwrap();
    let operational = |node| Event::Manager(manager::Event::StateChanged { node, state: NmtState::Operational });
    let mut heard = Vec::new();
    network.command(NmtCommand::Start, None).await.unwrap();
    while heard.last() != Some(&operational(own)) {
        heard.push(events.recv().await.unwrap());
    }
    network.listen_to_all().await.unwrap();
    let stranger = Event::Manager(manager::Event::Stranger { node: other, state: NmtState::Operational });
    assert!(!heard.contains(&stranger) && !heard.contains(&operational(other)), "{heard:?}");
    while events.recv().await.unwrap() != stranger {}
}

/// A link whose interface is removed at the first sent frame. It counts how often it is read.
#[cfg(unix)]
struct Leaving {
    socket: Option<Arc<UnixDatagram>>,
    state: Option<BusState>,
    asked: Arc<AtomicUsize>,
    started: tokio::time::Instant,
}

#[cfg(unix)]
impl Link for Leaving {
    fn now(&self) -> Instant {
        Instant::ZERO + self.started.elapsed().into()
    }
    fn send(&mut self, _: &Frame) -> Result<(), LinkError> {
        self.socket = None;
        self.state = Some(BusState::Removed);
        Err(LinkError::NoBus(BusState::Removed))
    }
    fn receive(&mut self, _: Instant) -> Result<Option<Incoming>, LinkError> {
        self.asked.fetch_add(1, Ordering::Relaxed);
        Ok(self.state.take().map(Incoming::State))
    }
    fn descriptor(&self) -> Option<Descriptor> {
        self.socket.clone().map(|socket| socket as Descriptor)
    }
}

#[cfg(unix)]
#[tokio::test(start_paused = true)]
async fn neither_an_idle_bus_nor_a_lost_one_keeps_the_task_busy() {
    let (socket, _other_end) = UnixDatagram::pair().unwrap();
    let asked = Arc::new(AtomicUsize::new(0));
    let link = Leaving {
        socket: Some(Arc::new(socket)),
        state: None,
        asked: Arc::clone(&asked),
        started: tokio::time::Instant::now(),
    };
    let network = Network::spawn(link).unwrap();
    let mut events = network.events();
    // Tokio's time is virtual here. The link is read four times a second.
    tokio::time::sleep(std::time::Duration::from_secs(10)).await;
    let idle = asked.swap(0, Ordering::Relaxed);
    assert!((30..50).contains(&idle), "an idle bus: {idle} times in 10 s");
    assert!(network.command(NmtCommand::Start, None).await.is_err());
    assert_eq!(events.recv().await.unwrap(), Event::Bus(BusState::Removed));
    tokio::time::sleep(std::time::Duration::from_secs(10)).await;
    let lost = asked.load(Ordering::Relaxed);
    assert!((30..50).contains(&lost), "a lost bus: {lost} times in 10 s");
}

/// A link that already has a frame when the shell gets it, so its socket is not readable.
#[cfg(unix)]
struct Prepared(Arc<UnixDatagram>, Option<Frame>);

#[cfg(unix)]
impl Link for Prepared {
    fn now(&self) -> Instant {
        Instant::ZERO
    }
    fn send(&mut self, _: &Frame) -> Result<(), LinkError> {
        Ok(())
    }
    fn receive(&mut self, _: Instant) -> Result<Option<Incoming>, LinkError> {
        Ok(self.1.take().map(Incoming::Frame))
    }
    fn descriptor(&self) -> Option<Descriptor> {
        Some(self.0.clone())
    }
}

#[cfg(unix)]
#[tokio::test(start_paused = true)]
async fn a_frame_that_a_link_has_read_before_is_reported_at_once() {
    let (socket, _other_end) = UnixDatagram::pair().unwrap();
    let boot_up = Frame::from_array(CobId::of_node(0x700, SILENT), [0]);
    let started = tokio::time::Instant::now();
    let network = Network::spawn(Prepared(Arc::new(socket), Some(boot_up))).unwrap();
    let event = network.events().recv().await.unwrap();
    assert_eq!(event, Event::Manager(manager::Event::BootedUp { node: SILENT }));
    assert!(started.elapsed() < std::time::Duration::from_millis(10), "{:?}", started.elapsed());
}

#[test]
fn handles_and_calls_can_move_between_threads() {
    fn is_send<T: Send>(_: &T) {}
    let check = |network: Network| {
        is_send(&network);
        is_send(&network.read(SILENT, DEVICE_TYPE));
        is_send(&network.write(SILENT, HEARTBEAT, 0));
    };
    let _ = check;
}
