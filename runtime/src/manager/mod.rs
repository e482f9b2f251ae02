//! A manager commands other nodes, monitors them, reads and writes their objects, and exchanges PDOs with them.
//!
//! The bytes of SDO transfers are lent to the verbs ([`Payloads`]). For one transfer at a time, a [`Payload`] is
//! enough; without a transfer, `&mut [0; 0]`.
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
mod deadlines;
mod error;
mod event;
mod machine;
mod member;
mod network;
mod pace;
mod places;
mod remote;
mod table;
mod watch;

use self::places::Place;
use self::table::{Entry as _, Table};
use crate::cia301::connection;
use crate::frame::Frame;
use crate::id::{CobId, NodeId};
use crate::object::{Address, Pdo, TimeOfDay};
use crate::service::heartbeat_producer::HeartbeatProducer;
use crate::service::nmt_manager::{Outbox, Unsent};
use crate::service::node_guard;
use crate::service::sdo_client::{Payload, SdoClient};
use crate::service::sync_producer::SyncProducer;
use crate::time::{Duration, Instant, earliest};
use crate::wire::emcy::{CodeOrder, Emergency};
use crate::wire::heartbeat::ErrorControl;
use crate::wire::nmt::{NmtCommand, NmtState};
use crate::wire::time;

pub use assignment::{Assignment, Guarding, OnLoss, Startup};
pub use error::{BeginError, Full};
pub use event::{Event, NetworkEvent};
pub use machine::{MachinePdo, MachinePlan, Shell};
pub use network::Network;
pub use pace::Pace;
pub use remote::Remote;

/// A manager of up to `NODES` nodes.
#[derive(Clone, Debug)]
pub struct Manager<const NODES: usize> {
    remotes: Table<Remote, NODES>,
    /// The node whose SDO client is lent to the application until the next call.
    lent: Option<Place>,
    sync: SyncProducer,
    sync_id: CobId,
    heartbeat: Option<HeartbeatProducer>,
    outbox: Outbox,
    /// The place whose SDO frame comes first.
    turn: Place,
}

/// The bytes of the SDO transfers, by node.
pub trait Payloads {
    /// The payload of the transfer with `node`.
    fn of_node(&mut self, node: NodeId) -> &mut dyn Payload;
}

/// A single payload serves one transfer at a time.
impl<P: Payload> Payloads for P {
    fn of_node(&mut self, _node: NodeId) -> &mut dyn Payload {
        self
    }
}

impl<const NODES: usize> Manager<NODES> {
    /// A manager without nodes.
    #[must_use]
    pub const fn new() -> Self {
        Manager {
            remotes: Table::new(),
            lent: None,
            sync: SyncProducer::new(),
            sync_id: CobId::SYNC,
            heartbeat: None,
            outbox: Outbox::new(),
            turn: Place::FIRST,
        }
    }

    /// Monitors a node from now on, in place of an earlier entry for the same node.
    pub fn add(&mut self, now: Instant, mut remote: Remote) -> Result<(), Full> {
        self.take_back();
        remote.watch.start(now);
        self.remotes.insert(remote)
    }

    /// Stops monitoring a node.
    pub fn remove(&mut self, node: NodeId) -> Option<Remote> {
        self.take_back();
        self.remotes.remove(node)
    }

    /// A node of the manager.
    #[must_use]
    pub fn remote(&self, node: NodeId) -> Option<&Remote> {
        self.remotes.get(node)
    }

    /// All nodes of the manager.
    pub fn remotes(&self) -> impl Iterator<Item = &Remote> {
        self.remotes.iter()
    }

    /// Sends a frame unchanged.
    pub const fn send(&mut self, frame: Frame) -> Result<(), Unsent> {
        self.outbox.send(frame)
    }

    /// Sends an NMT command to a node, or to all of them.
    pub const fn command(&mut self, command: NmtCommand, node: Option<NodeId>) -> Result<(), Unsent> {
        self.outbox.command(command, node)
    }

    /// Sends a PDO with the COB-ID `id`, which a device receives.
    pub fn send_pdo<P: Pdo>(&mut self, id: CobId, pdo: P) -> Result<(), Unsent> {
        self.outbox.send(pdo.frame(id))
    }

    /// Requests a PDO of `len` bytes with the COB-ID `id`, which a device transmits; more than eight count as eight.
    pub fn request_pdo(&mut self, id: CobId, len: u8) -> Result<(), Unsent> {
        match Frame::remote(id, len.min(8)) {
            Some(frame) => self.outbox.send(frame),
            None => Ok(()),
        }
    }

    /// Sends the time of day to all nodes.
    pub fn send_time(&mut self, time_of_day: TimeOfDay) -> Result<(), Unsent> {
        self.outbox.send(time::frame(CobId::TIME, time_of_day))
    }

    /// Sends SYNC as `id` every `period`, or not if that is zero, with a counter up to `overflow`, or without one if
    /// that is 0. SYNC of other nodes is recognised by the same `id`.
    pub fn produce_sync(&mut self, now: Instant, id: CobId, period: Duration, overflow: u8) {
        self.sync_id = id;
        self.sync.configure(now, id, period, overflow);
    }

    /// Sends a heartbeat as `node` every `period`, with the state OPERATIONAL, for devices that monitor their manager.
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
    pub fn read(&mut self, now: Instant, node: NodeId, address: Address) -> Result<(), BeginError> {
        Ok(self.sdo(node)?.read(now, address)?)
    }

    /// Begins to write the first `len` bytes of the payload into an entry of a node. [`Event::Sdo`] ends it.
    pub fn write(&mut self, now: Instant, node: NodeId, address: Address, len: u32) -> Result<(), BeginError> {
        Ok(self.sdo(node)?.write(now, address, len)?)
    }

    /// The SDO client of a node, for all its functions.
    pub fn sdo(&mut self, node: NodeId) -> Result<&mut SdoClient, BeginError> {
        self.take_back();
        self.lent = self.remotes.place(node);
        let remote = self.lent.and_then(|place| self.remotes.lend(place));
        remote.map(|remote| &mut remote.sdo).ok_or(BeginError::UnknownNode(node))
    }

    /// Takes the lent client back: the application may have begun or aborted a transfer.
    fn take_back(&mut self) {
        if let Some(place) = self.lent.take() {
            self.remotes.take_back(place);
        }
    }

    /// Takes a frame.
    pub fn handle_frame(&mut self, now: Instant, frame: &Frame, payloads: &mut dyn Payloads) -> Option<Event> {
        self.take_back();
        let id = frame.id();
        if let Some(node) = ErrorControl::node(id) {
            return self.handle_error_control(now, node, frame);
        }
        if let Some((place, which)) = self.remotes.find(id) {
            return self.remotes.change(place, |remote| {
                let node = remote.node;
                if which == remote::SDO_RESPONSE {
                    let event = remote.sdo.handle_frame(now, frame, payloads.of_node(node))?;
                    return Some(Event::Sdo { node, event });
                }
                let emergency = remote.emcy.handle_frame(now, frame)?;
                Some(Event::Emergency { node, emergency })
            })?;
        }
        if frame.is_remote() || id == CobId::NMT {
            return None;
        }
        if id == self.sync_id {
            return Some(Event::Sync(*frame));
        }
        if id == CobId::TIME {
            return time::parse(frame.data()).map(Event::Time);
        }
        if let Some(node) = Emergency::node(id) {
            // For a node that the manager does not have, CiA 301 is assumed.
            let emergency = Emergency::parse(frame.data(), CodeOrder::LowByteFirst)?;
            return Some(Event::Emergency { node, emergency });
        }
        let node = transmitter(id).filter(|&node| self.remotes.place(node).is_some());
        is_pdo(id).then_some(Event::Pdo { node, frame: *frame })
    }

    fn handle_error_control(&mut self, now: Instant, node: NodeId, frame: &Frame) -> Option<Event> {
        let Some(place) = self.remotes.place(node) else { return stranger(node, frame) };
        self.remotes.change(place, |remote| {
            let event = remote.watch.handle_frame(now, frame)?;
            if event == node_guard::Event::BootedUp {
                remote.emcy.reset();
            }
            Some(Event::of_watch(node, event))
        })?
    }

    /// Handles a deadline that has come. Several may be due at once: call it while `poll_timeout() <= now`.
    pub fn handle_timeout(&mut self, now: Instant) -> Option<Event> {
        self.take_back();
        self.sync.handle_timeout(now);
        if let Some(heartbeat) = &mut self.heartbeat {
            heartbeat.handle_timeout(now);
        }
        self.remotes.handle_timeout(now, |remote| {
            let node = remote.node;
            let lost = remote.watch.handle_timeout(now).map(|event| Event::of_watch(node, event));
            lost.or_else(|| Some(Event::Sdo { node, event: remote.sdo.handle_timeout(now)? }))
        })
    }

    /// The next frame to send, in this order: frames of the application, SYNC, guarding, heartbeat, SDO.
    pub fn poll_transmit(&mut self, now: Instant, payloads: &mut dyn Payloads) -> Option<Frame> {
        self.take_back();
        if let Some(frame) = self.outbox.poll_transmit(now) {
            return Some(frame);
        }
        if let Some((_, frame)) = self.sync.poll_transmit(now) {
            return Some(frame);
        }
        let mut guarding = self.remotes.marked(remote::GUARDING).from(Place::FIRST);
        let request =
            guarding.find_map(|place| self.remotes.change(place, |remote| remote.watch.poll_transmit(now))?);
        let error_control = request.or_else(|| self.heartbeat.as_mut()?.poll_transmit(now, NmtState::Operational));
        error_control.or_else(|| self.poll_sdo(now, payloads))
    }

    /// The nodes take turns, so that 127 segments for one do not delay the others.
    fn poll_sdo(&mut self, now: Instant, payloads: &mut dyn Payloads) -> Option<Frame> {
        self.remotes.marked(remote::SDO).from(self.turn).find_map(|place| {
            self.turn = place.next();
            self.remotes.change(place, |remote| remote.sdo.poll_transmit(now, payloads.of_node(remote.node)))?
        })
    }

    /// When to call [`Manager::handle_timeout`]; `None` if it need not be called before the next frame.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        let lent = self.lent.and_then(|place| self.remotes.at(place)?.poll_timeout());
        let heartbeat = self.heartbeat.as_ref().and_then(HeartbeatProducer::poll_timeout);
        earliest([self.remotes.poll_timeout(), lent, self.sync.poll_timeout(), heartbeat])
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

/// Whether a frame with this COB-ID is taken for a PDO. CiA 301 also allows 080h to 100h for PDOs, but these are taken
/// for SYNC, TIME and emergencies.
fn is_pdo(id: CobId) -> bool {
    id.is_extended() || !id.is_restricted() && id.raw() > connection::TPDO_1.into()
}

/// The node whose TPDO has this COB-ID in the predefined connection set (CiA 301, 7.3.3).
fn transmitter(id: CobId) -> Option<NodeId> {
    let base = id.raw() & 0x780;
    let is_tpdo = !id.is_extended() && connection::TPDOS.map(u32::from).contains(&base);
    let node = u8::try_from(id.raw() & 0x7F).ok().and_then(NodeId::new);
    node.filter(|_| is_tpdo)
}
