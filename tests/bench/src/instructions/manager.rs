//! The manager's side: frames of all nodes in turn. Every node is watched by its heartbeat.

use std::hint::black_box;

use lexican_runtime::manager::{Assignment, Event, Manager, Network, OnLoss, Remote};
use lexican_runtime::object::Address;
use lexican_runtime::service::sdo_client::Scalar;
use lexican_runtime::wire::heartbeat::ErrorControl;
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};

/// No round lasts until then.
const HEARTBEAT: Duration = Duration::from_secs(3600);
const FRAME_TIME: Duration = Duration::from_micros(100);
const SYNC_PERIOD: Duration = Duration::from_millis(1);
const DEVICE_TYPE: Address = Address::new(0x1000, 0);

/// A manager with room for as many nodes as a shell's.
struct Bench {
    manager: Box<Manager<127>>,
    now: Instant,
    turns: Turns,
}

/// Nodes 1 to `count` in turn.
struct Turns {
    count: u8,
    last: u8,
}

impl Turns {
    fn next(&mut self) -> NodeId {
        self.last = self.last % self.count + 1;
        NodeId::literal(black_box(self.last))
    }
}

impl Bench {
    fn new(count: u8) -> Self {
        let mut manager = Box::new(Manager::new());
        for node in nodes(count) {
            manager.add(Instant::ZERO, Remote::new(node).with_heartbeat(HEARTBEAT)).expect("there is room");
            let first = ErrorControl::heartbeat(NmtState::Operational).frame(node);
            manager.handle_frame(Instant::ZERO, &first, &mut [0; 0]).expect("the node appears");
        }
        Bench { manager, now: Instant::ZERO, turns: Turns { count, last: 0 } }
    }

    fn next_node(&mut self) -> NodeId {
        self.now += FRAME_TIME;
        self.turns.next()
    }

    fn take(&mut self, frame: &Frame, payload: &mut Scalar) -> Option<Event> {
        let event = self.manager.handle_frame(self.now, black_box(frame), payload);
        self.settle(payload);
        event
    }

    /// What a shell calls before it waits.
    fn settle(&mut self, payload: &mut Scalar) -> u32 {
        let mut sent = 0;
        while black_box(self.manager.poll_transmit(self.now, payload)).is_some() {
            sent += 1;
        }
        black_box(self.manager.poll_timeout());
        sent
    }

    /// Takes one frame after the other, made by `frame` for the node whose turn it is.
    fn round(mut self, frame: fn(NodeId) -> Frame, is_expected: fn(&Option<Event>) -> bool) -> Box<dyn FnMut()> {
        Box::new(move || {
            let frame = frame(self.next_node());
            let event = self.take(&frame, &mut Scalar::default());
            assert!(is_expected(&event), "{event:?}");
        })
    }
}

fn nodes(count: u8) -> impl Iterator<Item = NodeId> {
    NodeId::all().take(count.into())
}

pub(super) fn heartbeat(count: u8) -> Box<dyn FnMut()> {
    let frame = |node| ErrorControl::heartbeat(NmtState::Operational).frame(node);
    Bench::new(count).round(frame, Option::is_none)
}

pub(super) fn pdo(count: u8) -> Box<dyn FnMut()> {
    let frame = |node| Frame::from_array(CobId::of_node(0x180, node), [0; 8]);
    Bench::new(count).round(frame, |event| matches!(event, Some(Event::Pdo { node: Some(_), .. })))
}

pub(super) fn emergency(count: u8) -> Box<dyn FnMut()> {
    let frame = |node| Frame::from_array(CobId::of_node(0x080, node), [0; 8]);
    Bench::new(count).round(frame, |event| matches!(event, Some(Event::Emergency { .. })))
}

pub(super) fn sdo_read(count: u8) -> Box<dyn FnMut()> {
    let mut bench = Bench::new(count);
    Box::new(move || {
        let node = bench.next_node();
        let mut payload = Scalar::room_for::<u32>();
        bench.manager.read(bench.now, node, DEVICE_TYPE).expect("no other transfer is under way");
        assert_eq!(bench.settle(&mut payload), 1);
        let event = bench.take(&device_type(node), &mut payload);
        assert!(matches!(event, Some(Event::Sdo { .. })), "{event:?}");
    })
}

fn device_type(node: NodeId) -> Frame {
    Frame::from_array(CobId::of_node(0x580, node), [0x43, 0x00, 0x10, 0x00, 0x92, 0x01, 0x00, 0x00])
}

pub(super) fn sync(count: u8) -> Box<dyn FnMut()> {
    let mut bench = Bench::new(count);
    bench.manager.produce_sync(Instant::ZERO, CobId::SYNC, SYNC_PERIOD, 0);
    Box::new(move || {
        bench.now += SYNC_PERIOD;
        assert_eq!(bench.manager.handle_timeout(bench.now), None);
        assert_eq!(bench.settle(&mut Scalar::default()), 1);
    })
}

pub(super) fn heartbeat_of_network(count: u8) -> Box<dyn FnMut()> {
    let mut network = booted(count);
    let (mut now, mut turns) = (Instant::ZERO, Turns { count, last: 0 });
    Box::new(move || {
        now += FRAME_TIME;
        let frame = ErrorControl::heartbeat(NmtState::Operational).frame(turns.next());
        assert_eq!(network.handle_frame(now, black_box(&frame)), None);
        assert_eq!(black_box(network.poll_transmit(now)), None);
        black_box(network.poll_timeout());
    })
}

/// A network all nodes of which have booted.
fn booted(count: u8) -> Box<Network<&'static [u8], 127>> {
    let now = Instant::ZERO;
    let mut network = Box::new(Network::new(OnLoss::ResetNode));
    for node in nodes(count) {
        network.assign(node, Assignment::new(node, &[][..]).with_heartbeat(HEARTBEAT)).expect("there is room");
    }
    network.start(now, Duration::ZERO);
    while !network.is_ready() {
        while let Some(request) = network.poll_transmit(now) {
            for node in nodes(count) {
                if request.id() == CobId::of_node(0x600, node) {
                    network.handle_frame(now, &device_type(node));
                }
            }
        }
        for node in nodes(count) {
            network.handle_frame(now, &ErrorControl::heartbeat(NmtState::Operational).frame(node));
        }
        while network.poll_timeout().is_some_and(|due| due <= now) {
            network.handle_timeout(now);
        }
    }
    while network.poll_timeout().is_some_and(|due| due <= now) {
        network.handle_timeout(now);
    }
    network
}
