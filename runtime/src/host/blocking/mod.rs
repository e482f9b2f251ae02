//! The blocking shell: a [`Manager`] over a [`Link`], one operation at a time.
//!
//! While a call waits for an answer, other frames are handled and deadlines are kept. Events of the manager are stored
//! for [`Network::next_event`] meanwhile: the last 1024, and the number of older ones that were dropped.
//!
//! ```no_run
//! use lexican_runtime::host::BusUrl;
//! use lexican_runtime::host::blocking::Network;
//! use lexican_runtime::object::{Object, Ro};
//! use lexican_runtime::wire::nmt::NmtCommand;
//! use lexican_runtime::{Duration, NodeId};
//!
//! // Generated from the data sheet: `od::DEVICE_TYPE`.
//! const DEVICE_TYPE: Object<u32, Ro> = Object::new(0x1000, 0);
//!
//! let node = NodeId::literal(5);
//! let mut network = Network::new("can0".parse::<BusUrl>()?.open()?);
//! println!("{:#X}", network.read(node, DEVICE_TYPE)?);
//! network.command(NmtCommand::Start, Some(node))?;
//! let until = network.now() + Duration::from_secs(10);
//! while let Some(event) = network.next_event(until)? {
//!     println!("{event:?}");
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod node;
mod transfer;

use std::boxed::Box;
use std::collections::VecDeque;
use std::vec::Vec;

pub use self::node::{Named, RemoteNode};
use super::access::{AccessError, LONGEST};
use super::boot::{BootNetworkError, Kept, Plan};
use super::bytes::Bytes;
use super::filter::FrameFilter;
use super::pump::{Pump, Turn};
use super::{Link, LinkError};
use crate::frame::Frame;
use crate::id::{CobId, NodeId};
use crate::manager::{Event, MachinePlan, Manager, NetworkEvent};
use crate::object::{Address, Object, Pdo, Readable, Value, Writable};
use crate::service::sdo_client::{Payload, Scalar};
use crate::time::{Duration, Instant};
use crate::wire::nmt::NmtCommand;

/// All nodes of a bus, as a manager sees them through a link.
pub struct Network<L> {
    link: L,
    manager: Box<Manager<127>>,
    filter: FrameFilter,
    pump: Pump,
    events: VecDeque<Event>,
    missed: u64,
    lost: u64,
    kept: Option<Kept>,
    patience: Option<Duration>,
}

impl<L: Link> Network<L> {
    /// A network over `link`. Nothing is sent.
    #[must_use]
    pub fn new(link: L) -> Self {
        Network {
            filter: FrameFilter::new(&link),
            link,
            manager: Box::default(),
            pump: Pump::new(),
            events: VecDeque::new(),
            missed: 0,
            lost: 0,
            kept: None,
            patience: None,
        }
    }

    /// The manager, to configure what it monitors and produces, and to query its state.
    pub fn manager(&mut self) -> &mut Manager<127> {
        self.filter.invalidate();
        &mut self.manager
    }

    /// Boots a network, and keeps it up from now on, in place of any previous one: while any call of this shell waits,
    /// lost nodes are booted again, which [`Event::Network`] reports. `report` gets those events until the network is
    /// ready. The mandatory nodes must boot within `boot_time`; zero means no limit.
    ///
    /// ```no_run
    /// use lexican_runtime::host::BusUrl;
    /// use lexican_runtime::host::{Plan, blocking::Network};
    /// use lexican_runtime::manager::{Assignment, OnLoss};
    /// use lexican_runtime::object::{Object, Rw};
    /// use lexican_runtime::procedure::{ConciseDcf, Step};
    /// use lexican_runtime::{Duration, NodeId};
    ///
    /// // Generated from the data sheet: `od::PRODUCER_HEARTBEAT_TIME`.
    /// const PRODUCER_HEARTBEAT_TIME: Object<u16, Rw> = Object::new(0x1017, 0);
    ///
    /// let node = NodeId::literal(5);
    /// let settings = ConciseDcf::to_vec([Step::write(PRODUCER_HEARTBEAT_TIME, 100)])?;
    /// let mut plan = Plan::new(OnLoss::ResetNode);
    /// plan.assign(node, Assignment::new(node, settings).with_heartbeat(Duration::from_millis(250)))?;
    ///
    /// let mut network = Network::new("can0".parse::<BusUrl>()?.open()?);
    /// network.boot(plan, Duration::from_secs(10), |event| println!("{event:?}"))?;
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// A network that does not become ready is kept, too: a node that failed is tried again at its next boot-up
    /// message.
    pub fn boot(
        &mut self,
        plan: Plan,
        boot_time: Duration,
        mut report: impl FnMut(&NetworkEvent),
    ) -> Result<(), BootNetworkError> {
        let now = self.now();
        let kept = self.kept.insert(Kept::new(plan));
        for node in kept.network.nodes() {
            self.filter.include(node, &mut self.manager, now);
        }
        kept.network.start(now, boot_time);
        self.events.retain(|event| !matches!(event, Event::Network(_)));
        loop {
            let turn = self.turn(self.now(), Instant::MAX, &mut Scalar::default())?;
            self.store_turn(turn);
            while let Some(at) = self.events.iter().position(|event| matches!(event, Event::Network(_))) {
                let Some(Event::Network(event)) = self.events.remove(at) else { continue };
                report(&event);
                if let Some(end) = self.kept.as_mut().and_then(|kept| kept.follow(event)) {
                    return Ok(end?);
                }
            }
        }
    }

    /// Boots a machine, and keeps it up from now on as [`Network::boot`] does, with its SYNC and its heartbeat.
    ///
    /// # Panics
    ///
    /// If the machine has more than 127 nodes, which a bus cannot have.
    pub fn boot_machine<const NODES: usize>(
        &mut self,
        machine: &MachinePlan<NODES>,
        report: impl FnMut(&NetworkEvent),
    ) -> Result<(), BootNetworkError> {
        let now = self.now();
        machine.prepare(now, self.manager()).expect("there is room for all nodes");
        self.boot(machine.network().expect("there is room for all nodes"), machine.boot_time, report)
    }

    /// The network that is kept up: to query its state, and to boot nodes.
    pub fn kept(&mut self) -> Option<&mut Plan> {
        Some(&mut *self.kept.as_mut()?.network)
    }

    /// From now on, receives only frames of the manager's nodes, and those with `others`: PDOs with COB-IDs outside the
    /// predefined connection set. A link that can filter drops the rest, so that a crowded bus costs nothing. Other
    /// nodes are no longer noticed. A node that is read or written becomes one of the manager's.
    pub fn listen_to_own(&mut self, others: &[CobId]) -> Result<(), LinkError> {
        self.filter.choose(Some(others.to_vec()));
        self.filter.apply(&self.manager, &mut self.link)
    }

    /// Receives all frames, which is the default.
    pub fn listen_to_all(&mut self) -> Result<(), LinkError> {
        self.filter.choose(None);
        self.filter.apply(&self.manager, &mut self.link)
    }

    /// Limits how long each call to read or to write may take in all, before it fails with
    /// [`SdoError::TimedOut`](crate::service::sdo_client::SdoError::TimedOut). With `None`, the default, only a
    /// transfer without progress fails.
    pub fn set_patience(&mut self, patience: Option<Duration>) {
        self.patience = patience;
    }

    /// The link's time.
    #[must_use]
    pub fn now(&self) -> Instant {
        self.link.now()
    }

    /// As [`Link::latency`].
    #[must_use]
    pub fn latency(&self) -> Duration {
        self.link.latency()
    }

    /// Returns the link.
    #[must_use]
    pub fn into_link(self) -> L {
        self.link
    }

    /// Sends an NMT command to a node, or to all of them.
    pub fn command(&mut self, command: NmtCommand, node: Option<NodeId>) -> Result<(), LinkError> {
        self.transmit(&mut Scalar::default())?;
        self.manager.command(command, node).expect("the frame before has just left");
        self.transmit(&mut Scalar::default())
    }

    /// Sends a PDO with the COB-ID `id`, which a device receives.
    pub fn send_pdo<P: Pdo>(&mut self, id: CobId, pdo: P) -> Result<(), LinkError> {
        self.transmit(&mut Scalar::default())?;
        self.manager.send_pdo(id, pdo).expect("the frame before has just left");
        self.transmit(&mut Scalar::default())
    }

    /// Sends a frame unchanged.
    pub fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        self.link.send(frame)
    }

    /// Reads an object.
    pub fn read<T: Value, A: Readable, M, D>(
        &mut self,
        node: NodeId,
        object: Object<T, A, M, D>,
    ) -> Result<T, AccessError> {
        let address = object.address();
        let mut value = Scalar::room_for::<T>();
        self.transfer(node, address, &mut value, |manager, now| manager.read(now, node, address))?;
        value.get().map_err(|error| AccessError::DataSheet { node, address, error })
    }

    /// Writes an object, if the data sheet allows the value.
    pub fn write<T: Value, A: Writable, M, D>(
        &mut self,
        node: NodeId,
        object: Object<T, A, M, D>,
        value: T,
    ) -> Result<(), AccessError> {
        object.check(value)?;
        let (address, mut value) = (object.address(), Scalar::of(value));
        let len = value.len();
        self.transfer(node, address, &mut value, |manager, now| manager.write(now, node, address, len)).map(drop)
    }

    /// Reads the bytes of an entry of any type, up to 64 MiB.
    pub fn read_bytes(&mut self, node: NodeId, address: Address) -> Result<Vec<u8>, AccessError> {
        let mut data = Bytes::room_for(LONGEST);
        let len = self.read_into(node, address, &mut data)?;
        Ok(data.into_vec(len))
    }

    /// Reads an entry into `payload`, such as a file, or bytes whose progress is shown, and returns the number of
    /// bytes.
    pub fn read_into(
        &mut self,
        node: NodeId,
        address: Address,
        payload: &mut impl Payload,
    ) -> Result<u32, AccessError> {
        self.transfer(node, address, payload, |manager, now| manager.read(now, node, address))
    }

    /// Writes bytes into an entry of any type.
    ///
    /// # Panics
    ///
    /// When `data` is 4 GiB or longer, which SDO cannot transfer.
    pub fn write_bytes(&mut self, node: NodeId, address: Address, data: &[u8]) -> Result<(), AccessError> {
        let len = u32::try_from(data.len()).expect("SDO transfers less than 4 GiB");
        self.write_from(node, address, len, &mut Bytes::of(data))
    }

    /// Writes `len` bytes from `payload`, such as a file, or bytes whose progress is shown.
    pub fn write_from(
        &mut self,
        node: NodeId,
        address: Address,
        len: u32,
        payload: &mut impl Payload,
    ) -> Result<(), AccessError> {
        self.transfer(node, address, payload, |manager, now| manager.write(now, node, address, len)).map(drop)
    }

    /// The next event of the manager; waits for it until `until`.
    pub fn next_event(&mut self, until: Instant) -> Result<Option<Event>, LinkError> {
        loop {
            if let Some(event) = self.events.pop_front() {
                return Ok(Some(event));
            }
            match self.turn(self.now(), until, &mut Scalar::default())? {
                Turn::Event(event) => self.store(event),
                Turn::Over => return Ok(None),
                Turn::Bus(_) | Turn::Gap(_) | Turn::Idle => {}
            }
        }
    }

    /// Waits up to `span` for an event for which `pick` returns a value. Events before it are dropped.
    pub fn wait_for<R>(
        &mut self,
        span: Duration,
        mut pick: impl FnMut(&Event) -> Option<R>,
    ) -> Result<Option<R>, LinkError> {
        let until = self.now() + span;
        while let Some(event) = self.next_event(until)? {
            if let Some(picked) = pick(&event) {
                return Ok(Some(picked));
            }
        }
        Ok(None)
    }

    /// How many frames were lost because this machine did not read them in time: see
    /// [`Incoming::Gap`](super::Incoming::Gap).
    #[must_use]
    pub const fn lost_frames(&self) -> u64 {
        self.lost
    }

    /// How many events were dropped because more than 1024 were waiting.
    #[must_use]
    pub const fn missed_events(&self) -> u64 {
        self.missed
    }
}
