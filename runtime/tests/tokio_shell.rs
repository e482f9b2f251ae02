//! The tokio shell, over the virtual bus.
#![cfg(feature = "tokio")]

mod shell_support;

#[cfg(unix)]
use std::os::{fd::AsFd, unix::net::UnixDatagram};

use lexican_runtime::host::tokio::{Event, Network};
use lexican_runtime::host::{AccessError, Incoming, Link, LinkError, VirtualBus};
use lexican_runtime::manager::Remote;
use lexican_runtime::service::sdo_client::SdoError;
use lexican_runtime::wire::nmt::{NmtCommand, NmtState};
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId, manager};
use shell_support::{DEVICE_TYPE, HEARTBEAT, NAME, Station};

const SILENT: NodeId = NodeId::literal(100);

/// A bus with the devices 1 to 8, and a network over it.
fn network() -> (VirtualBus, Network) {
    let bus = VirtualBus::with_bit_rate(500);
    for node in NodeId::all().take(8) {
        bus.attach(Station::new(node));
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
async fn a_silent_node_holds_up_nobody_else() {
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
    let error = silent.await.unwrap().unwrap_err();
    assert!(matches!(error, AccessError::Sdo { node: SILENT, error: SdoError::TimedOut { .. } }), "{error}");
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

/// Polls once and lets others run; true when the future is ready.
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
async fn a_transfer_survives_that_its_node_is_added_anew() {
    let (_, network) = network();
    let reader = tokio::spawn({
        let network = network.clone();
        async move { network.read(SILENT, DEVICE_TYPE).await }
    });
    tokio::task::yield_now().await;
    let watched = Remote::new(SILENT).with_heartbeat(Duration::from_millis(500));
    network.tell(move |manager, now| manager.add(now, watched).unwrap()).await.unwrap();
    let error = reader.await.unwrap().unwrap_err();
    assert!(matches!(error, AccessError::Sdo { error: SdoError::TimedOut { .. }, .. }), "{error}");
}

#[tokio::test]
async fn a_read_of_the_applications_own_is_not_taken_for_one_of_a_handle() {
    let (_, network) = network();
    let node = NodeId::literal(1);
    network.read(node, DEVICE_TYPE).await.unwrap();
    network.tell(move |manager, now| manager.read(now, node, HEARTBEAT.address()).unwrap()).await.unwrap();
    assert_eq!(network.read(node, DEVICE_TYPE).await.unwrap(), 0x0002_0192);
}

#[test]
fn a_frame_handed_over_is_sent_though_the_runtime_shuts_down() {
    let bus = VirtualBus::new();
    let mut witness = bus.link();
    let frame = Frame::from_array(CobId::NMT, [2, 0]);
    let runtime = tokio::runtime::Builder::new_current_thread().build().unwrap();
    runtime.block_on(async { Network::spawn(bus.link()).unwrap().post(frame).unwrap() });
    drop(runtime);
    assert_eq!(witness.receive_frame(Instant::from_micros(1000)).unwrap(), Some(frame));
}

/// A link over sockets, of which it takes the second when told to: a link that reconnects.
#[cfg(unix)]
struct Reconnecting {
    sockets: [UnixDatagram; 2],
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
    fn descriptor(&self) -> Option<std::os::fd::BorrowedFd<'_>> {
        Some(self.sockets[self.at].as_fd())
    }
}

#[cfg(unix)]
#[tokio::test]
async fn a_link_that_has_reconnected_is_waited_for() {
    let (first, first_end) = UnixDatagram::pair().unwrap();
    let (second, second_end) = UnixDatagram::pair().unwrap();
    first.set_nonblocking(true).unwrap();
    second.set_nonblocking(true).unwrap();
    let network = Network::spawn(Reconnecting { sockets: [first, second], at: 0 }).unwrap();
    let mut events = network.events();
    first_end.send(&[5]).unwrap();
    events.recv().await.unwrap();
    first_end.send(b"r").unwrap();
    // Were the old socket still the one that is waited for, each frame would wait for the next inspection:
    // ten seconds in all.
    let heard = async {
        for state in [127, 5].repeat(20) {
            second_end.send(&[state]).unwrap();
            events.recv().await.unwrap();
        }
    };
    tokio::time::timeout(std::time::Duration::from_secs(5), heard).await.expect("frames are heard when they come");
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
