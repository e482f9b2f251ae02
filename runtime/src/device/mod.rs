//! A CANopen device: all services behind one set of verbs.
//!
//! The device configures itself from the communication objects of the dictionary that it is lent, when
//! it boots and again when a manager writes one of them. What is not in the dictionary is not served.
//!
//! ```text
//! restart(now, od)                  power-on, and the answer to Event::Reset
//! handle_frame(now, &frame, od)     a frame came
//! handle_timeout(now, od)           while poll_timeout() <= now
//! poll_transmit(now, od)            until it gives no frame, also after setting objects; then
//! poll_timeout()                    sleep until here, or until a frame comes
//! ```
//!
//! Frames leave in the order of their importance: boot-up, SYNC, EMCY, TIME, PDO, heartbeat, SDO. A block
//! upload of 127 segments does not hold up the heartbeat.
//!
//! What the application sets in the dictionary goes out by itself: a TPDO of type 254 or 255 with the next
//! `poll_transmit`, one of type 0 with the next SYNC.
//!
//! ```
//! use lexican_runtime::cia301::connection;
//! use lexican_runtime::device::{Behaviour, Device};
//! use lexican_runtime::object::{Access, DataType, Dictionary, Object, PdoMapping, Ro, Row, Table, Tpdo};
//! use lexican_runtime::{CobId, Frame, Instant, NodeId};
//!
//! // What `lexican-codegen` makes of a data sheet: here the device type, a TPDO, and the inputs that it maps.
//! const INPUTS: Object<u8, Ro, Tpdo> = Object::new(0x6000, 1);
//! static TABLE: Table = Table {
//!     rows: &[
//!         Row::new(0x1000, 0, DataType::Unsigned32, Access::Ro, PdoMapping::None).at(0, 4),
//!         Row::new(0x1800, 1, DataType::Unsigned32, Access::Rw, PdoMapping::None).at(4, 4).plus_node(),
//!         Row::new(0x1800, 2, DataType::Unsigned8, Access::Rw, PdoMapping::None).at(8, 1),
//!         Row::new(0x1A00, 0, DataType::Unsigned8, Access::Const, PdoMapping::None).at(9, 1),
//!         Row::new(0x1A00, 1, DataType::Unsigned32, Access::Const, PdoMapping::None).at(10, 4),
//!         Row::new(0x6000, 1, DataType::Unsigned8, Access::Ro, PdoMapping::Tpdo).at(14, 1),
//!     ],
//!     limits: &[],
//!     image: &[0x92, 0x01, 0, 0, 0x80, 0x01, 0, 0, 255, 1, 0x08, 0x01, 0x00, 0x60, 0],
//! };
//!
//! let node = NodeId::literal(5);
//! let mut od: Dictionary<15> = Dictionary::new(&TABLE, node);
//! let mut device: Device = Device::new(node, Behaviour::CIA_301);
//! let now = Instant::ZERO;
//!
//! device.restart(now, &mut od);
//! assert_eq!(device.poll_transmit(now, &mut od).unwrap().to_string(), "705#00");
//!
//! let read = Frame::from_array(CobId::of_node(connection::SDO_REQUEST, node), [0x40, 0x00, 0x10, 0x00, 0, 0, 0, 0]);
//! device.handle_frame(now, &read, &mut od);
//! assert_eq!(device.poll_transmit(now, &mut od).unwrap().to_string(), "585#4300100092010000");
//!
//! let start = Frame::from_array(CobId::NMT, [0x01, 0x05]);
//! device.handle_frame(now, &start, &mut od);
//! assert_eq!(device.poll_transmit(now, &mut od).unwrap().to_string(), "185#00");
//! od.set(INPUTS, 0x2A);
//! assert_eq!(device.poll_transmit(now, &mut od).unwrap().to_string(), "185#2A");
//! assert_eq!(device.poll_transmit(now, &mut od), None);
//! ```

mod behaviour;
mod checked;
mod configure;
mod defaults;
mod errors;
mod event;
mod filter;
mod identifiers;
mod receive;
mod sdo;
mod selection;
mod services;

use self::filter::Filter;
use self::services::{Polled, Services};
use crate::cia301;
use crate::frame::Frame;
use crate::id::{CobId, NodeId};
use crate::object::{Address, ObjectDictionary, TimeOfDay};
use crate::service::objects;
use crate::service::rpdo::{self, Rpdo};
use crate::service::sdo_server::SdoServer;
use crate::service::tpdo::Tpdo;
use crate::time::{Instant, sooner};
use crate::wire::emcy::ErrorRegister;
use crate::wire::heartbeat::ErrorControl;
use crate::wire::nmt::NmtState;

pub use crate::service::choice::{Choice, With, Without};
pub use behaviour::{Behaves, Behaviour, ChangeRule, Cia301, ErrorControlRule};
pub use event::{Event, Misconfigured};
pub use selection::{Everything, Selection};

/// A device with room for `RPDOS` and `TPDOS` PDOs, `SERVERS` SDO servers, `MONITORED` nodes whose
/// heartbeat it consumes, and `MAPPED` objects in each PDO. PDO numbers may have gaps: only PDOs that the dictionary
/// has take room. `S` says which services it has.
#[derive(Clone, Debug)]
pub struct Device<
    const RPDOS: usize = 4,
    const TPDOS: usize = 4,
    const SERVERS: usize = 1,
    const MONITORED: usize = 4,
    const MAPPED: usize = 64,
    S: Selection = Everything,
> {
    /// Which identifiers concern the device: a first check, which may let others through.
    filter: Filter,
    /// How often the filter was made.
    generation: u32,
    servers: [Option<SdoServer<S::Blocks>>; SERVERS],
    /// The dictionary has other parameters of servers (1200h and up) than these.
    servers_changed: bool,
    services: Polled<RPDOS, TPDOS, MONITORED, MAPPED, S>,
}

impl<
    const RPDOS: usize,
    const TPDOS: usize,
    const SERVERS: usize,
    const MONITORED: usize,
    const MAPPED: usize,
    S: Selection,
> Device<RPDOS, TPDOS, SERVERS, MONITORED, MAPPED, S>
{
    /// A device that is silent until [`Device::restart`] is called.
    #[must_use]
    pub const fn new(node: NodeId, behaviour: S::Behaviour) -> Self {
        Device {
            filter: Filter::NOTHING,
            generation: 0,
            servers: [const { None }; SERVERS],
            servers_changed: false,
            services: Polled::new(Services::new(node, behaviour)),
        }
    }

    /// The node-ID.
    #[must_use]
    pub const fn node(&self) -> NodeId {
        self.services.get().nmt.node()
    }

    /// The NMT state.
    #[must_use]
    pub const fn nmt_state(&self) -> NmtState {
        self.services.get().nmt.state()
    }

    /// How the device deviates from CiA 301.
    #[must_use]
    pub fn behaviour(&self) -> &Behaviour {
        self.services.get().behaviour()
    }

    /// The error register (1001h).
    #[must_use]
    pub const fn error_register(&self) -> ErrorRegister {
        self.services.get().emcy.register()
    }

    /// How many emergencies were not sent because newer ones have taken their place: the device keeps
    /// [`EmcyProducer::PENDING`](crate::service::emcy_producer::EmcyProducer::PENDING) until they can be sent.
    #[must_use]
    pub const fn replaced_emergencies(&self) -> u16 {
        self.services.get().emcy.replaced()
    }

    /// Power-on, or the end of a reset: configures everything from the dictionary anew. The boot-up
    /// message is the next frame; PRE-OPERATIONAL follows it. [`Device::misconfigured`] lists the
    /// parameters that are not served.
    pub fn restart(&mut self, now: Instant, od: &mut (impl ObjectDictionary + ?Sized)) {
        self.restart_as(self.node(), now, od);
    }

    /// The same under another node-ID, as LSS may give one.
    pub fn restart_as(&mut self, node: NodeId, now: Instant, od: &mut (impl ObjectDictionary + ?Sized)) {
        // A whole new device would be on the stack for a moment.
        let behaviour = self.services.get().behaviour;
        self.filter = Filter::NOTHING;
        self.servers.iter_mut().for_each(|server| *server = None);
        *self.services.get_mut() = Services::new(node, behaviour);
        objects::write(od, cia301::ERROR_REGISTER, 0, 0);
        let services = self.services.get_mut();
        services.configure(now, od);
        services.nmt.boot();
        self.load_servers(od);
        self.listen();
    }

    /// Changes the NMT state by local control, for example to start by itself after the boot-up.
    pub fn enter(&mut self, now: Instant, state: NmtState) -> Option<Event> {
        let event = self.services.get_mut().enter(now, state);
        self.follow_state(event)
    }

    /// An object changed: TPDOs that map it and count changes as events are sent. What is set by
    /// [`Dictionary::set`](crate::object::Dictionary::set) need not be reported.
    pub fn changed(&mut self, address: Address) {
        if self.services.get().maps(address) {
            self.services.get_mut().changed(address);
        }
    }

    /// Finds out which TPDOs carry other data than they did last, for an application that neither sets objects by
    /// [`Dictionary::set`](crate::object::Dictionary::set) nor reports [what changed](Device::changed).
    pub fn compare(&mut self, od: &mut (impl ObjectDictionary + ?Sized)) {
        self.services.get_mut().compare(Address::new(0, 0), Address::new(0xFFFF, 0xFF), od);
    }

    /// Sends a TPDO of type 254 or 255 now, one of type 0 with the next SYNC.
    pub fn request_tpdo(&mut self, number: u16) {
        let services = self.services.get_mut();
        if services.is_operational() {
            services.tpdos.iter_mut().filter(|slot| slot.number == number).for_each(|slot| slot.pdo.request());
        }
    }

    /// Sends the time of day, if the device produces TIME (1012h, bit 30) and is not stopped. It replaces a time
    /// that has not been sent yet.
    pub fn send_time(&mut self, time: TimeOfDay) {
        let services = self.services.get_mut();
        let is_allowed = services.nmt.state().allows_messages();
        if let Some(service) = &mut services.time {
            service.pending = Some(time).filter(|_| is_allowed && service.producer.is_some());
        }
    }

    /// An RPDO that the dictionary has.
    #[must_use]
    pub fn rpdo(&self, number: u16) -> Option<&Rpdo<MAPPED>> {
        let slot = self.services.get().rpdos.iter().find(|slot| slot.number == number && number != 0)?;
        Some(&slot.pdo)
    }

    /// The RPDOs that took effect with the last SYNC, by number: [`rpdo::Event::Received`], or
    /// [`rpdo::Event::Refused`] if the dictionary refused an object.
    pub fn applied(&self) -> impl Iterator<Item = (u16, rpdo::Event)> {
        self.services.get().rpdos.iter().filter_map(|slot| Some((slot.number, slot.pdo.applied()?)))
    }

    /// A TPDO that the dictionary has.
    #[must_use]
    pub fn tpdo(&self, number: u16) -> Option<&Tpdo<MAPPED>> {
        let slot = self.services.get().tpdos.iter().find(|slot| slot.number == number && number != 0)?;
        Some(&slot.pdo)
    }

    /// The identifiers of all frames that concern the device, perhaps more than once; for links that can leave
    /// out others. They change with [`Device::generation`].
    pub fn cob_ids(&self) -> impl Iterator<Item = CobId> {
        let own = [CobId::NMT, ErrorControl::cob_id(self.node())];
        let requests = self.servers.iter().flatten().map(SdoServer::request_id);
        own.into_iter().chain(requests).chain(self.services.get().cob_ids())
    }

    /// Another number than before when the communication objects have configured the device anew, and with
    /// them perhaps [which identifiers](Device::cob_ids) concern it.
    #[must_use]
    pub const fn generation(&self) -> u32 {
        self.generation
    }

    fn listen(&mut self) {
        self.filter = self.cob_ids().collect();
        self.generation = self.generation.wrapping_add(1);
    }

    /// Takes a frame. Frames that are not for this device cost little and do nothing.
    #[inline]
    pub fn handle_frame(
        &mut self,
        now: Instant,
        frame: &Frame,
        od: &mut (impl ObjectDictionary + ?Sized),
    ) -> Option<Event> {
        if self.filter.may_contain(frame.id()) { self.take_frame(now, frame, od) } else { None }
    }

    /// Out of line, so that only the check of the filter is inlined (README: a frame of another node).
    #[inline(never)]
    fn take_frame(&mut self, now: Instant, frame: &Frame, od: &mut (impl ObjectDictionary + ?Sized)) -> Option<Event> {
        // The application may have changed the state since, and a request may ask for the error register.
        self.end_communication_error(od);
        if let Some(at) = self.server_of(frame.id()) {
            return self.handle_request(at, now, frame, od);
        }
        let event = self.services.dispatch(now, frame, od);
        self.end_communication_error(od);
        self.follow_state(event)
    }

    /// Does what is due. Several deadlines may be due at once: call it while `poll_timeout() <= now`.
    pub fn handle_timeout(&mut self, now: Instant, od: &mut (impl ObjectDictionary + ?Sized)) -> Option<Event> {
        if self.nmt_state() == NmtState::Initialising {
            return None;
        }
        let event = self.services.get_mut().handle_timeout(now, od);
        self.end_communication_error(od);
        self.follow_state(event).or_else(|| self.handle_server_timeout(now))
    }

    /// The next frame to send, the most important one first.
    pub fn poll_transmit(&mut self, now: Instant, od: &mut (impl ObjectDictionary + ?Sized)) -> Option<Frame> {
        if let Some((first, last)) = od.take_changes() {
            self.services.get_mut().compare(first, last, od);
        }
        if let Some(frame) = self.services.poll_transmit(now, od) {
            return Some(frame);
        }
        self.poll_servers(now, od)
    }

    /// When to call [`Device::handle_timeout`]; `None` to sleep until a frame comes.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        if self.nmt_state() == NmtState::Initialising {
            return None;
        }
        let mut next = self.services.poll_timeout();
        for server in self.servers.iter().flatten() {
            next = sooner(next, server.poll_timeout());
        }
        next
    }
}
