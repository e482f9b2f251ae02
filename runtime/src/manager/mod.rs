//! A manager: commands other nodes, watches them, reads and writes their objects, and exchanges PDOs
//! with them.
//!
//! The bytes of SDO transfers are lent to the verbs ([`Payloads`]); for one transfer at a time a
//! [`Payload`] is enough, and `&mut [0; 0]` when there is none.
//!
//! ```
//! use lexican_runtime::manager::{Event, Manager, Remote};
//! use lexican_runtime::object::Address;
//! use lexican_runtime::service::sdo_client::{self, Scalar};
//! use lexican_runtime::wire::nmt::NmtCommand;
//! use lexican_runtime::{CobId, Frame, Instant, NodeId};
//!
//! let now = Instant::ZERO;
//! let node = NodeId::literal(5);
//! let mut manager = Manager::<4>::new();
//! manager.add(now, Remote::new(node))?;
//!
//! manager.command(NmtCommand::Start, Some(node))?;
//! assert_eq!(manager.poll_transmit(now, &mut [0; 0]).unwrap().to_string(), "000#0105");
//!
//! let mut value = Scalar::room_for::<u32>();
//! manager.read(now, node, Address::new(0x1000, 0))?;
//! assert_eq!(manager.poll_transmit(now, &mut value).unwrap().to_string(), "605#4000100000000000");
//!
//! let answer = Frame::from_array(CobId::of_node(0x580, node), [0x43, 0x00, 0x10, 0x00, 0x92, 0x01, 0, 0]);
//! let event = manager.handle_frame(now, &answer, &mut value);
//! assert!(matches!(event, Some(Event::Sdo { event: sdo_client::Event::Done { len: 4, .. }, .. })));
//! assert_eq!(value.get::<u32>()?, 0x192);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod assignment;
mod error;
mod member;
mod network;
mod network_event;
mod remote;

use crate::frame::Frame;
use crate::id::{CobId, NodeId};
use crate::object::{Address, Pdo, TimeOfDay};
use crate::service::heartbeat_consumer;
use crate::service::heartbeat_producer::HeartbeatProducer;
use crate::service::nmt_manager::{Outbox, Unsent};
use crate::service::node_guard;
use crate::service::sdo_client::{self, Payload, SdoClient};
use crate::service::sync_producer::SyncProducer;
use crate::time::{Duration, Instant};
use crate::wire::emcy::{CodeOrder, Emergency};
use crate::wire::heartbeat::ErrorControl;
use crate::wire::nmt::{NmtCommand, NmtState};
use crate::wire::time;

pub use assignment::{Assignment, Guarding, OnLoss, Startup};
pub use error::{BeginError, Full};
pub use network::Network;
pub use network_event::NetworkEvent;
pub use remote::Remote;

/// A manager of up to `NODES` nodes.
#[derive(Clone, Debug)]
pub struct Manager<const NODES: usize> {
    remotes: [Option<Remote>; NODES],
    sync: SyncProducer,
    sync_id: CobId,
    heartbeat: Option<HeartbeatProducer>,
    outbox: Outbox,
    /// The place in `remotes` whose SDO frame comes first.
    turn: usize,
}

/// What a manager learned. One frame or deadline is at most one event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// A node sent its boot-up message; also one that the manager does not look after.
    BootedUp {
        /// Which node.
        node: NodeId,
    },
    /// A node's state was heard for the first time, or for the first time after it was lost.
    Appeared {
        /// Which node.
        node: NodeId,
        /// Its state.
        state: NmtState,
    },
    /// A node is in another state.
    StateChanged {
        /// Which node.
        node: NodeId,
        /// Its state.
        state: NmtState,
    },
    /// A node's heartbeat or guarding answer is overdue.
    Lost {
        /// Which node.
        node: NodeId,
    },
    /// A node's guarding answers do not alternate.
    ToggleError {
        /// Which node.
        node: NodeId,
    },
    /// A node that the manager does not look after sends heartbeats or guarding answers.
    Stranger {
        /// Which node.
        node: NodeId,
        /// Its state.
        state: NmtState,
    },
    /// A node reports an error, or the end of one.
    Emergency {
        /// Which node.
        node: NodeId,
        /// What it reports.
        emergency: Emergency,
    },
    /// An SDO transfer ended.
    Sdo {
        /// With which node.
        node: NodeId,
        /// How.
        event: sdo_client::Event,
    },
    /// A data frame that is no other message: a PDO, to be [read](Pdo::from_data) by who knows the mapping.
    Pdo {
        /// The node that the manager looks after whose TPDO has this COB-ID in the predefined connection
        /// set. The PDOs of a network may be arranged otherwise.
        node: Option<NodeId>,
        /// The frame.
        frame: Frame,
    },
    /// Another node tells the time of day.
    Time(TimeOfDay),
    /// Something happened in the network that a shell boots and keeps. A [`Manager`] alone reports none.
    Network(NetworkEvent),
}

/// Where the bytes of the SDO transfers with the nodes are.
pub trait Payloads {
    /// The payload of the transfer with `node`.
    fn of_node(&mut self, node: NodeId) -> &mut dyn Payload;
}

/// One payload for one transfer at a time.
impl<P: Payload> Payloads for P {
    fn of_node(&mut self, _node: NodeId) -> &mut dyn Payload {
        self
    }
}

impl<const NODES: usize> Manager<NODES> {
    /// A manager that looks after nobody yet.
    #[must_use]
    pub const fn new() -> Self {
        Manager {
            remotes: [const { None }; NODES],
            sync: SyncProducer::new(),
            sync_id: CobId::SYNC,
            heartbeat: None,
            outbox: Outbox::new(),
            turn: 0,
        }
    }

    /// Looks after a node from now on; it takes the place of what was known of the same node.
    ///
    /// # Errors
    ///
    /// [`Full`] when there is no room.
    pub fn add(&mut self, now: Instant, mut remote: Remote) -> Result<(), Full> {
        let node = remote.node();
        remote.start(now);
        let known = self.remotes.iter().position(|place| place.as_ref().is_some_and(|known| known.node() == node));
        let free = || self.remotes.iter().position(Option::is_none);
        let place = known.or_else(free).and_then(|at| self.remotes.get_mut(at));
        *place.ok_or(Full { node, nodes: NODES })? = Some(remote);
        Ok(())
    }

    /// Looks after a node no longer.
    pub fn remove(&mut self, node: NodeId) -> Option<Remote> {
        self.remotes.iter_mut().find_map(|place| place.take_if(|remote| remote.node() == node))
    }

    /// What is known of a node.
    #[must_use]
    pub fn remote(&self, node: NodeId) -> Option<&Remote> {
        self.remotes().find(|remote| remote.node() == node)
    }

    /// All nodes that the manager looks after.
    pub fn remotes(&self) -> impl Iterator<Item = &Remote> {
        self.remotes.iter().flatten()
    }

    fn remote_mut(&mut self, node: NodeId) -> Option<&mut Remote> {
        self.remotes.iter_mut().flatten().find(|remote| remote.node() == node)
    }

    /// Sends a frame as it is.
    ///
    /// # Errors
    ///
    /// [`Unsent`] when the frame before was not pulled yet; as with all that follow.
    pub const fn send(&mut self, frame: Frame) -> Result<(), Unsent> {
        self.outbox.send(frame)
    }

    /// Commands a node, or all of them.
    ///
    /// # Errors
    ///
    /// [`Unsent`].
    pub const fn command(&mut self, command: NmtCommand, node: Option<NodeId>) -> Result<(), Unsent> {
        self.outbox.command(command, node)
    }

    /// Sends a PDO that a device receives under `id`.
    ///
    /// # Errors
    ///
    /// [`Unsent`].
    pub fn send_pdo<P: Pdo>(&mut self, id: CobId, pdo: P) -> Result<(), Unsent> {
        self.outbox.send(pdo.frame(id))
    }

    /// Asks for a PDO of `len` bytes that a device transmits under `id`; more than eight count as eight.
    ///
    /// # Errors
    ///
    /// [`Unsent`].
    pub fn request_pdo(&mut self, id: CobId, len: u8) -> Result<(), Unsent> {
        match Frame::remote(id, len.min(8)) {
            Some(frame) => self.outbox.send(frame),
            None => Ok(()),
        }
    }

    /// Tells everybody the time of day.
    ///
    /// # Errors
    ///
    /// [`Unsent`].
    pub fn send_time(&mut self, time_of_day: TimeOfDay) -> Result<(), Unsent> {
        self.outbox.send(time::frame(CobId::TIME, time_of_day))
    }

    /// Sends SYNC as `id` every `period`, zero for not at all; counting up to `overflow`, 0 for not counting.
    pub fn produce_sync(&mut self, now: Instant, id: CobId, period: Duration, overflow: u8) {
        self.sync_id = id;
        self.sync.configure(now, id, period, overflow);
    }

    /// Sends a heartbeat as `node` every `period`, for devices that watch their manager. Its state is
    /// OPERATIONAL.
    pub fn produce_heartbeat(&mut self, now: Instant, node: NodeId, period: Duration) {
        let mut heartbeat = HeartbeatProducer::new(node);
        heartbeat.configure(now, period, Duration::ZERO);
        self.heartbeat = Some(heartbeat);
    }

    /// The period of the manager's own heartbeat, if it produces one.
    #[must_use]
    pub fn heartbeat_period(&self) -> Option<Duration> {
        self.heartbeat.as_ref().map(HeartbeatProducer::period)
    }

    /// Begins to read an entry of a node. [`Event::Sdo`] ends it.
    ///
    /// # Errors
    ///
    /// [`BeginError`].
    pub fn read(&mut self, now: Instant, node: NodeId, address: Address) -> Result<(), BeginError> {
        Ok(self.sdo(node)?.read(now, address)?)
    }

    /// Begins to write the first `len` bytes of the payload into an entry of a node. [`Event::Sdo`] ends it.
    ///
    /// # Errors
    ///
    /// [`BeginError`].
    pub fn write(&mut self, now: Instant, node: NodeId, address: Address, len: u32) -> Result<(), BeginError> {
        Ok(self.sdo(node)?.write(now, address, len)?)
    }

    /// The SDO client of a node, for all that it can.
    ///
    /// # Errors
    ///
    /// [`BeginError::UnknownNode`].
    pub fn sdo(&mut self, node: NodeId) -> Result<&mut SdoClient, BeginError> {
        self.remote_mut(node).map(|remote| &mut remote.sdo).ok_or(BeginError::UnknownNode(node))
    }

    /// Takes a frame.
    pub fn handle_frame(&mut self, now: Instant, frame: &Frame, payloads: &mut dyn Payloads) -> Option<Event> {
        let id = frame.id();
        if let Some(node) = ErrorControl::node(id) {
            return self.handle_error_control(now, node, frame);
        }
        for remote in self.remotes.iter_mut().flatten() {
            let node = remote.node();
            if id == remote.sdo.response_id() {
                let event = remote.sdo.handle_frame(now, frame, payloads.of_node(node))?;
                return Some(Event::Sdo { node, event });
            }
            if id == remote.emcy.id() {
                let emergency = remote.emcy.handle_frame(now, frame)?;
                return Some(Event::Emergency { node, emergency });
            }
        }
        if frame.is_remote() || id == CobId::NMT || id == self.sync_id {
            return None;
        }
        if id == CobId::TIME {
            return time::parse(frame.data()).map(Event::Time);
        }
        if let Some(node) = Emergency::node(id) {
            // A node that the manager does not look after is taken to do as the standard says.
            let emergency = Emergency::parse(frame.data(), CodeOrder::LowByteFirst)?;
            return Some(Event::Emergency { node, emergency });
        }
        let node = transmitter(id).filter(|&node| self.remote(node).is_some());
        is_pdo(id).then_some(Event::Pdo { node, frame: *frame })
    }

    fn handle_error_control(&mut self, now: Instant, node: NodeId, frame: &Frame) -> Option<Event> {
        let Some(remote) = self.remote_mut(node) else { return stranger(node, frame) };
        let event = match &mut remote.guard {
            Some(guard) => guard.handle_frame(now, frame).map(|event| guarded(node, event)),
            None => remote.heartbeat.handle_frame(now, frame).map(|event| heard(node, event)),
        };
        if matches!(event, Some(Event::BootedUp { .. })) {
            remote.emcy.reset();
        }
        event
    }

    /// Does what is due. Several deadlines may be due at once: call it while `poll_timeout() <= now`.
    pub fn handle_timeout(&mut self, now: Instant) -> Option<Event> {
        self.sync.handle_timeout(now);
        if let Some(heartbeat) = &mut self.heartbeat {
            heartbeat.handle_timeout(now);
        }
        self.remotes.iter_mut().flatten().find_map(|remote| {
            let node = remote.node();
            let guard = &mut remote.guard;
            let lost = remote.heartbeat.handle_timeout(now).map(|event| heard(node, event));
            let lost = lost.or_else(|| guard.as_mut()?.handle_timeout(now).map(|event| guarded(node, event)));
            lost.or_else(|| Some(Event::Sdo { node, event: remote.sdo.handle_timeout(now)? }))
        })
    }

    /// The next frame to send: what the application sends, SYNC, guarding, heartbeat, SDO.
    pub fn poll_transmit(&mut self, now: Instant, payloads: &mut dyn Payloads) -> Option<Frame> {
        if let Some(frame) = self.outbox.poll_transmit(now) {
            return Some(frame);
        }
        if let Some((_, frame)) = self.sync.poll_transmit(now) {
            return Some(frame);
        }
        let guard = self.remotes.iter_mut().flatten().find_map(|remote| remote.poll_guard(now));
        let error_control = guard.or_else(|| self.heartbeat.as_mut()?.poll_transmit(now, NmtState::Operational));
        error_control.or_else(|| self.poll_sdo(now, payloads))
    }

    /// The nodes take turns: 127 segments for one do not hold up the others.
    fn poll_sdo(&mut self, now: Instant, payloads: &mut dyn Payloads) -> Option<Frame> {
        let (later, first) = self.remotes.split_at_mut(self.turn.min(NODES));
        let mut places = first.iter_mut().zip(self.turn..).chain(later.iter_mut().zip(0..));
        let (frame, at) = places.find_map(|(place, at)| {
            let remote = place.as_mut()?;
            Some((remote.sdo.poll_transmit(now, payloads.of_node(remote.node))?, at))
        })?;
        self.turn = at + 1;
        Some(frame)
    }

    /// When to call [`Manager::handle_timeout`]; `None` to sleep until a frame comes.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        let remotes = self.remotes().filter_map(Remote::poll_timeout);
        let heartbeat = self.heartbeat.as_ref().and_then(HeartbeatProducer::poll_timeout);
        remotes.chain(self.sync.poll_timeout()).chain(heartbeat).min()
    }
}

impl<const NODES: usize> Default for Manager<NODES> {
    fn default() -> Self {
        Self::new()
    }
}

fn stranger(node: NodeId, frame: &Frame) -> Option<Event> {
    match ErrorControl::parse(frame.data())? {
        ErrorControl { state: NmtState::Initialising, .. } => Some(Event::BootedUp { node }),
        ErrorControl { state, .. } => Some(Event::Stranger { node, state }),
    }
}

const fn heard(node: NodeId, event: heartbeat_consumer::Event) -> Event {
    match event {
        heartbeat_consumer::Event::BootedUp => Event::BootedUp { node },
        heartbeat_consumer::Event::Started(state) => Event::Appeared { node, state },
        heartbeat_consumer::Event::StateChanged(state) => Event::StateChanged { node, state },
        heartbeat_consumer::Event::Lost => Event::Lost { node },
    }
}

const fn guarded(node: NodeId, event: node_guard::Event) -> Event {
    match event {
        node_guard::Event::BootedUp => Event::BootedUp { node },
        node_guard::Event::Started(state) => Event::Appeared { node, state },
        node_guard::Event::StateChanged(state) => Event::StateChanged { node, state },
        node_guard::Event::ToggleError => Event::ToggleError { node },
        node_guard::Event::Lost => Event::Lost { node },
    }
}

/// Whether a PDO may have this COB-ID. 081h to 0FFh may too, but are taken for emergencies.
const fn is_pdo(id: CobId) -> bool {
    id.is_extended() || !id.is_restricted() && id.raw() > 0x180
}

/// Whose TPDO has this COB-ID in the predefined connection set (CiA 301, 7.3.3).
fn transmitter(id: CobId) -> Option<NodeId> {
    let base = id.raw() & 0x780;
    let is_tpdo = !id.is_extended() && matches!(base, 0x180 | 0x280 | 0x380 | 0x480);
    let node = u8::try_from(id.raw() & 0x7F).ok().and_then(NodeId::new);
    node.filter(|_| is_tpdo)
}
