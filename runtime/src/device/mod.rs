//! A CANopen device: all services behind one set of verbs.
//!
//! The device configures itself from the communication objects of the dictionary that it is lent, when
//! it boots and again when a manager writes one of them. What is not in the dictionary is not served.
//!
//! ```text
//! restart(now, od)                  power-on, and the answer to Event::Reset
//! handle_frame(now, &frame, od)     a frame came
//! handle_timeout(now, od)           while poll_timeout() <= now
//! poll_transmit(now, od)            until it gives no frame; then
//! poll_timeout()                    sleep until here, or until a frame comes
//! ```
//!
//! Frames leave in the order of their importance: boot-up, SYNC, EMCY, TIME, PDO, heartbeat, SDO. A block
//! upload of 127 segments does not hold up the heartbeat.
//!
//! ```
//! use lexican_runtime::device::{Behaviour, Device};
//! use lexican_runtime::object::{Access, Address, DataType, Dictionary, Entry, PdoMapping, Table};
//! use lexican_runtime::{CobId, Frame, Instant, NodeId};
//!
//! // What `lexican-codegen` makes of a data sheet: here 1000h, the device type, and nothing else.
//! static TABLE: Table = Table {
//!     entries: &[Entry {
//!         address: Address::new(0x1000, 0),
//!         data_type: DataType::Unsigned32,
//!         access: Access::Ro,
//!         mapping: PdoMapping::None,
//!         offset: 0,
//!         capacity: 4,
//!         limit: 0,
//!     }],
//!     limits: &[],
//!     image: &[0x92, 0x01, 0x00, 0x00],
//!     node_relative: &[],
//! };
//!
//! let node = NodeId::literal(5);
//! let mut od: Dictionary<4> = Dictionary::new(&TABLE, node);
//! let mut device: Device = Device::new(node, Behaviour::CIA_301);
//! let now = Instant::ZERO;
//!
//! device.restart(now, &mut od);
//! assert_eq!(device.poll_transmit(now, &mut od).unwrap().to_string(), "705#00");
//!
//! let read = Frame::from_array(CobId::of_node(0x600, node), [0x40, 0x00, 0x10, 0x00, 0, 0, 0, 0]);
//! device.handle_frame(now, &read, &mut od);
//! assert_eq!(device.poll_transmit(now, &mut od).unwrap().to_string(), "585#4300100092010000");
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
mod transmit;

use self::filter::Filter;
use crate::cia301;
use crate::frame::Frame;
use crate::id::{CobId, NodeId};
use crate::object::{Address, ObjectDictionary, TimeOfDay};
use crate::service::emcy_producer::EmcyProducer;
use crate::service::guarding::Guarding;
use crate::service::heartbeat_consumer::HeartbeatConsumer;
use crate::service::heartbeat_producer::HeartbeatProducer;
use crate::service::mapping::Mapping;
use crate::service::nmt::Nmt;
use crate::service::objects;
use crate::service::rpdo::{self, Rpdo};
use crate::service::sdo_server::SdoServer;
use crate::service::sync_consumer::SyncConsumer;
use crate::service::sync_producer::SyncProducer;
use crate::service::tpdo::{self, Tpdo, Triggers};
use crate::time::Instant;
use crate::wire::emcy::{ErrorCode, ErrorRegister};
use crate::wire::nmt::NmtState;
use crate::wire::sync::Sync;

pub use behaviour::{Behaviour, ChangeRule, ErrorControlRule};
pub use event::{Event, Misconfigured};

/// A device with room for `RPDOS` and `TPDOS` PDOs, `SERVERS` SDO servers, and `MONITORED` nodes whose
/// heartbeat it consumes. PDO numbers may have gaps: only PDOs that the dictionary has take room.
#[derive(Clone, Debug)]
pub struct Device<const RPDOS: usize = 4, const TPDOS: usize = 4, const SERVERS: usize = 1, const MONITORED: usize = 4>
{
    node: NodeId,
    /// Which identifiers concern the device: a first check, which may let others through.
    filter: Filter,
    /// How often the filter was made.
    generation: u32,
    behaviour: Behaviour,
    nmt: Nmt,
    sync_consumer: SyncConsumer,
    sync_producer: SyncProducer,
    /// A SYNC that the device itself has sent, and when: it concerns its own PDOs too.
    own_sync: Option<(Instant, Sync)>,
    time_id: Option<CobId>,
    /// TIME is produced under this identifier.
    time_producer: Option<CobId>,
    /// The time to send.
    time: Option<TimeOfDay>,
    emcy: EmcyProducer,
    heartbeat: HeartbeatProducer,
    guarding: Guarding,
    consumers: [Option<HeartbeatConsumer>; MONITORED],
    servers: [Option<SdoServer>; SERVERS],
    /// The dictionary has other parameters of servers (1200h and up) than these.
    servers_changed: bool,
    rpdos: [RpdoSlot; RPDOS],
    tpdos: [TpdoSlot; TPDOS],
    /// The error register shows an error of communication that the device has noticed itself.
    communication_error: bool,
    /// What the application has set in the error register.
    application_errors: ErrorRegister,
    /// The error behaviour (1029h) is due.
    reaction: Option<Instant>,
    /// The device enters OPERATIONAL by itself after its boot-up (1F80h).
    starts_itself: bool,
    /// That is due.
    start: Option<Instant>,
    /// Nothing but answers to SDO is due. `None` after anything that may have changed that. It keeps the cost of an
    /// SDO transfer (README: SDO read of 4 bytes) apart from the number of PDOs.
    quiet: Option<Quiet>,
}

/// Until when nothing but SDO is due.
#[derive(Clone, Copy, Debug)]
struct Quiet {
    until: Option<Instant>,
}

/// An RPDO and its number; number 0 is free.
#[derive(Clone, Copy, Debug)]
struct RpdoSlot {
    number: u16,
    pdo: Rpdo,
}

/// A TPDO and its number; number 0 is free.
#[derive(Clone, Copy, Debug)]
struct TpdoSlot {
    number: u16,
    pdo: Tpdo,
}

impl RpdoSlot {
    const FREE: RpdoSlot = RpdoSlot { number: 0, pdo: Rpdo::new(rpdo::Parameters::OFF, Mapping::EMPTY) };

    const fn parameter_index(&self) -> u16 {
        cia301::rpdo(self.number)
    }
}

impl TpdoSlot {
    const FREE: TpdoSlot =
        TpdoSlot { number: 0, pdo: Tpdo::new(tpdo::Parameters::OFF, Mapping::EMPTY, Triggers::NONE) };

    const fn parameter_index(&self) -> u16 {
        cia301::tpdo(self.number)
    }
}

impl<const RPDOS: usize, const TPDOS: usize, const SERVERS: usize, const MONITORED: usize>
    Device<RPDOS, TPDOS, SERVERS, MONITORED>
{
    /// A device that is silent until [`Device::restart`] is called.
    #[must_use]
    pub const fn new(node: NodeId, behaviour: Behaviour) -> Self {
        Device {
            node,
            filter: Filter::NOTHING,
            generation: 0,
            behaviour,
            nmt: Nmt::new(node),
            sync_consumer: SyncConsumer::new(),
            sync_producer: SyncProducer::new(),
            own_sync: None,
            time_id: None,
            time_producer: None,
            time: None,
            emcy: EmcyProducer::new(behaviour.emcy_code_order),
            heartbeat: HeartbeatProducer::new(node),
            guarding: Guarding::new(node),
            consumers: [const { None }; MONITORED],
            servers: [const { None }; SERVERS],
            servers_changed: false,
            rpdos: [RpdoSlot::FREE; RPDOS],
            tpdos: [TpdoSlot::FREE; TPDOS],
            communication_error: false,
            application_errors: ErrorRegister::NONE,
            reaction: None,
            starts_itself: false,
            start: None,
            quiet: None,
        }
    }

    /// The node-ID.
    #[must_use]
    pub const fn node(&self) -> NodeId {
        self.node
    }

    /// The NMT state.
    #[must_use]
    pub const fn nmt_state(&self) -> NmtState {
        self.nmt.state()
    }

    /// What distinguishes the device.
    #[must_use]
    pub const fn behaviour(&self) -> &Behaviour {
        &self.behaviour
    }

    /// The error register (1001h).
    #[must_use]
    pub const fn error_register(&self) -> ErrorRegister {
        self.emcy.register()
    }

    /// Power-on, or the end of a reset: configures everything from the dictionary anew. The boot-up
    /// message is the next frame; PRE-OPERATIONAL follows it. [`Device::misconfigured`] lists what of
    /// the dictionary is not served.
    pub fn restart(&mut self, now: Instant, od: &mut dyn ObjectDictionary) {
        *self = Device { generation: self.generation, ..Device::new(self.node, self.behaviour) };
        objects::write(od, cia301::ERROR_REGISTER, 0, 0);
        self.configure(now, od);
        self.nmt.boot();
    }

    /// The same under another node-ID, as LSS may give one.
    pub fn restart_as(&mut self, node: NodeId, now: Instant, od: &mut dyn ObjectDictionary) {
        self.node = node;
        self.restart(now, od);
    }

    /// Changes the NMT state by local control, for example to start by itself after the boot-up.
    pub fn enter(&mut self, now: Instant, state: NmtState) -> Option<Event> {
        let event = self.nmt.enter(state)?;
        self.follow_nmt(now, event)
    }

    /// An object changed: TPDOs that map it and count changes as events are sent.
    pub fn changed(&mut self, address: Address) {
        if self.nmt.state() == NmtState::Operational {
            for slot in self.tpdos.iter_mut().filter(|slot| slot.pdo.mapping().maps(address)) {
                slot.pdo.changed(address);
                self.quiet = None;
            }
        }
    }

    /// Finds out which TPDOs carry other data than they did last, for an application that does not keep
    /// an account of [what changed](Device::changed).
    pub fn compare(&mut self, od: &mut dyn ObjectDictionary) {
        if self.nmt.state() == NmtState::Operational {
            self.quiet = None;
            self.tpdos.iter_mut().for_each(|slot| slot.pdo.compare(od));
        }
    }

    /// Sends a TPDO of type 254 or 255 now, one of type 0 with the next SYNC.
    pub fn request_tpdo(&mut self, number: u16) {
        if self.nmt.state() == NmtState::Operational {
            self.quiet = None;
            self.tpdos.iter_mut().filter(|slot| slot.number == number).for_each(|slot| slot.pdo.request());
        }
    }

    /// Sends the time of day, if the device produces TIME (1012h, bit 30) and is not stopped. It replaces a time
    /// that has not been sent yet.
    pub fn send_time(&mut self, time: TimeOfDay) {
        self.time = Some(time).filter(|_| self.time_producer.is_some() && self.nmt.state().allows_messages());
        self.quiet = None;
    }

    /// An RPDO that the dictionary has.
    #[must_use]
    pub fn rpdo(&self, number: u16) -> Option<&Rpdo> {
        let slot = self.rpdos.iter().find(|slot| slot.number == number && number != 0)?;
        Some(&slot.pdo)
    }

    /// The RPDOs that took effect with the last SYNC, by number: [`rpdo::Event::Received`], or
    /// [`rpdo::Event::Refused`] where the dictionary did not take all of it.
    pub fn applied(&self) -> impl Iterator<Item = (u16, rpdo::Event)> {
        self.rpdos.iter().filter_map(|slot| Some((slot.number, slot.pdo.applied()?)))
    }

    /// A TPDO that the dictionary has.
    #[must_use]
    pub fn tpdo(&self, number: u16) -> Option<&Tpdo> {
        let slot = self.tpdos.iter().find(|slot| slot.number == number && number != 0)?;
        Some(&slot.pdo)
    }

    /// Takes a frame. Frames that are not for this device cost little and do nothing.
    #[inline]
    pub fn handle_frame(&mut self, now: Instant, frame: &Frame, od: &mut dyn ObjectDictionary) -> Option<Event> {
        if self.filter.may_contain(frame.id()) { self.take_frame(now, frame, od) } else { None }
    }

    /// Out of line, so that only the check of the filter is inlined.
    #[inline(never)]
    fn take_frame(&mut self, now: Instant, frame: &Frame, od: &mut dyn ObjectDictionary) -> Option<Event> {
        // The application may have changed the state since, and a request may ask for the error register.
        self.end_communication_error(od);
        if !self.is_sync_or_time(frame.id())
            && let Some(at) = self.server_of(frame.id())
        {
            let event = self.handle_request(at, now, frame, od);
            return self.follow_sdo(now, event, od);
        }
        self.quiet = None;
        let event = self.dispatch(now, frame, od);
        self.end_communication_error(od);
        event
    }

    /// Does what is due. Several deadlines may be due at once: call it while `poll_timeout() <= now`.
    pub fn handle_timeout(&mut self, now: Instant, od: &mut dyn ObjectDictionary) -> Option<Event> {
        if self.nmt.state() == NmtState::Initialising {
            return None;
        }
        self.quiet = None;
        self.heartbeat.handle_timeout(now);
        self.sync_producer.handle_timeout(now);
        self.emcy.handle_timeout(now);
        self.tpdos.iter_mut().for_each(|slot| slot.pdo.handle_timeout(now));
        if self.sync_consumer.handle_timeout(now) {
            self.tpdos.iter_mut().for_each(|slot| slot.pdo.close_window());
        }
        let event = self
            .handle_start(now)
            .or_else(|| self.handle_reaction(now, od))
            .or_else(|| self.handle_own_sync(now, od))
            .or_else(|| self.handle_lost_peers(now, od))
            .or_else(|| self.handle_late_pdos(now, od))
            .or_else(|| {
                let event = self.servers.iter_mut().flatten().find_map(|server| server.handle_timeout(now));
                self.follow_sdo(now, event, od)
            });
        self.end_communication_error(od);
        event
    }

    fn handle_start(&mut self, now: Instant) -> Option<Event> {
        self.start.take_if(|due| *due <= now)?;
        self.enter(now, NmtState::Operational)
    }

    /// The error behaviour of CiA 301, 7.5.2.31 (1029h:01).
    fn handle_reaction(&mut self, now: Instant, od: &mut dyn ObjectDictionary) -> Option<Event> {
        self.reaction.take_if(|due| *due <= now)?;
        match objects::read_u8(od, cia301::ERROR_BEHAVIOUR, 1).unwrap_or(0) {
            0 if self.nmt.state() == NmtState::Operational => self.enter(now, NmtState::PreOperational),
            2 => self.enter(now, NmtState::Stopped),
            _ => None,
        }
    }

    fn handle_own_sync(&mut self, now: Instant, od: &mut dyn ObjectDictionary) -> Option<Event> {
        let (_, sync) = self.own_sync.take_if(|(sent, _)| *sent <= now)?;
        Some(self.handle_sync(sync, od))
    }

    fn handle_lost_peers(&mut self, now: Instant, od: &mut dyn ObjectDictionary) -> Option<Event> {
        let lost = self
            .consumers
            .iter_mut()
            .flatten()
            .find_map(|consumer| Some((consumer.node(), consumer.handle_timeout(now)?)))
            .map(|(node, event)| Event::Heartbeat { node, event })
            .or_else(|| self.guarding.handle_timeout(now).map(Event::LifeGuarding))?;
        self.raise_communication_error(ErrorCode::LIFE_GUARD, od);
        self.reaction = Some(now);
        Some(lost)
    }

    fn handle_late_pdos(&mut self, now: Instant, od: &mut dyn ObjectDictionary) -> Option<Event> {
        let late = self.rpdos.iter_mut().find_map(|slot| {
            slot.pdo.handle_timeout(now)?;
            Some(slot.number)
        });
        let number = late?;
        self.raise_communication_error(ErrorCode::RPDO_TIMEOUT, od);
        Some(Event::RpdoTimedOut { number })
    }
}
