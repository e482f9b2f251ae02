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
//! Frames leave in the order of their importance: boot-up, SYNC, EMCY, PDO, heartbeat, SDO. A block
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
mod event;
mod filter;
mod receive;

use self::checked::Checked;
use self::filter::Filter;
use crate::frame::Frame;
use crate::id::{CobId, NodeId};
use crate::object::{Address, ObjectDictionary};
use crate::service::emcy_producer::EmcyProducer;
use crate::service::guarding::Guarding;
use crate::service::heartbeat_consumer::{Heartbeat, HeartbeatConsumer};
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
pub use event::{Event, PdoSet};

/// A device with room for `RPDOS` and `TPDOS` PDOs, `SERVERS` SDO servers, and `MONITORED` nodes whose
/// heartbeat it consumes. PDO numbers may have gaps: only PDOs that the dictionary has take room.
#[derive(Clone, Debug)]
pub struct Device<const RPDOS: usize = 4, const TPDOS: usize = 4, const SERVERS: usize = 1, const MONITORED: usize = 4>
{
    node: NodeId,
    /// Which identifiers concern the device.
    filter: Filter,
    behaviour: Behaviour,
    nmt: Nmt,
    sync_consumer: SyncConsumer,
    sync_producer: SyncProducer,
    /// A SYNC that the device itself has sent, and when: it concerns its own PDOs too.
    own_sync: Option<(Instant, Sync)>,
    time_id: Option<CobId>,
    emcy: EmcyProducer,
    heartbeat: HeartbeatProducer,
    guarding: Guarding,
    consumers: [Option<HeartbeatConsumer>; MONITORED],
    servers: [Option<SdoServer>; SERVERS],
    rpdos: [RpdoSlot; RPDOS],
    tpdos: [TpdoSlot; TPDOS],
    /// The error register shows an error of communication that the device has noticed itself.
    communication_error: bool,
    /// What the application has set in the error register.
    application_errors: ErrorRegister,
    /// The error behaviour (1029h) is due.
    reaction: Option<Instant>,
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
        0x13FF + self.number
    }
}

impl TpdoSlot {
    const FREE: TpdoSlot =
        TpdoSlot { number: 0, pdo: Tpdo::new(tpdo::Parameters::OFF, Mapping::EMPTY, Triggers::NONE) };

    const fn parameter_index(&self) -> u16 {
        0x17FF + self.number
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
            behaviour,
            nmt: Nmt::new(node),
            sync_consumer: SyncConsumer::new(),
            sync_producer: SyncProducer::new(),
            own_sync: None,
            time_id: None,
            emcy: EmcyProducer::new(behaviour.emcy_code_order),
            heartbeat: HeartbeatProducer::new(node),
            guarding: Guarding::new(node),
            consumers: [const { None }; MONITORED],
            servers: [const { None }; SERVERS],
            rpdos: [RpdoSlot::FREE; RPDOS],
            tpdos: [TpdoSlot::FREE; TPDOS],
            communication_error: false,
            application_errors: ErrorRegister::NONE,
            reaction: None,
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
    /// message is the next frame; PRE-OPERATIONAL follows it.
    pub fn restart(&mut self, now: Instant, od: &mut dyn ObjectDictionary) {
        *self = Device::new(self.node, self.behaviour);
        objects::write(od, 0x1001, 0, 0);
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

    /// An error occurred: `register` is set in the error register, the code goes into the history
    /// (1003h), and an EMCY is sent.
    pub fn emergency(
        &mut self,
        code: ErrorCode,
        register: ErrorRegister,
        vendor: [u8; 5],
        od: &mut dyn ObjectDictionary,
    ) {
        self.raise(code, register, vendor, true, od);
    }

    /// The same without an entry in the history.
    pub fn emergency_unrecorded(
        &mut self,
        code: ErrorCode,
        register: ErrorRegister,
        vendor: [u8; 5],
        od: &mut dyn ObjectDictionary,
    ) {
        self.raise(code, register, vendor, false, od);
    }

    fn raise(
        &mut self,
        code: ErrorCode,
        register: ErrorRegister,
        vendor: [u8; 5],
        record: bool,
        od: &mut dyn ObjectDictionary,
    ) {
        // The generic bit is an error of its own only where it stands alone.
        let specific = register & !ErrorRegister::GENERIC;
        let errors = if specific.is_empty() { ErrorRegister::GENERIC } else { specific };
        self.application_errors = self.application_errors | errors;
        self.emcy.raise(code, self.errors(), vendor, record, od);
    }

    /// What the error register has to show: the errors of the application and those that the device has
    /// noticed itself. The generic bit is set with any of them.
    fn errors(&self) -> ErrorRegister {
        let own = if self.communication_error { ErrorRegister::COMMUNICATION } else { ErrorRegister::NONE };
        let errors = self.application_errors | own;
        if errors.is_empty() { errors } else { errors | ErrorRegister::GENERIC }
    }

    /// Errors are over: `register` is reset in the error register, and an EMCY with the code 0000h is
    /// sent when the application had set any of its bits. `ErrorRegister(0xFF)` ends all errors of the application.
    pub fn clear(&mut self, register: ErrorRegister, od: &mut dyn ObjectDictionary) {
        let ended = self.application_errors & register;
        self.application_errors = self.application_errors & !register;
        // Of what the device has noticed itself, nothing ends by this.
        let still_there = if self.communication_error { ErrorRegister::COMMUNICATION } else { ErrorRegister::NONE };
        if !(ended & !still_there).is_empty() {
            self.emcy.clear(self.errors(), [0; 5], od);
        }
    }

    /// The bus failed (bus-off): the error behaviour (1029h) follows. Losing a heartbeat or life guarding
    /// is noticed without this.
    pub const fn communication_failed(&mut self, now: Instant) {
        self.reaction = Some(now);
    }

    /// An object changed: TPDOs that map it and count changes as events are sent.
    pub fn changed(&mut self, address: Address) {
        if self.nmt.state() == NmtState::Operational {
            self.tpdos.iter_mut().for_each(|slot| slot.pdo.changed(address));
        }
    }

    /// Finds out which TPDOs carry other data than they did last, for an application that does not keep
    /// an account of [what changed](Device::changed).
    pub fn compare(&mut self, od: &mut dyn ObjectDictionary) {
        if self.nmt.state() == NmtState::Operational {
            self.tpdos.iter_mut().for_each(|slot| slot.pdo.compare(od));
        }
    }

    /// Sends a TPDO of type 254 or 255 now, one of type 0 with the next SYNC.
    pub fn request_tpdo(&mut self, number: u16) {
        if self.nmt.state() == NmtState::Operational {
            self.tpdos.iter_mut().filter(|slot| slot.number == number).for_each(|slot| slot.pdo.request());
        }
    }

    /// An RPDO that the dictionary has.
    #[must_use]
    pub fn rpdo(&self, number: u16) -> Option<&Rpdo> {
        let slot = self.rpdos.iter().find(|slot| slot.number == number && number != 0)?;
        Some(&slot.pdo)
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
        if !self.filter.may_contain(frame.id()) {
            return None;
        }
        let event = self.dispatch(now, frame, od);
        self.end_communication_error(od);
        event
    }

    /// Does what is due. Several deadlines may be due at once: call it while `poll_timeout() <= now`.
    pub fn handle_timeout(&mut self, now: Instant, od: &mut dyn ObjectDictionary) -> Option<Event> {
        if self.nmt.state() == NmtState::Initialising {
            return None;
        }
        self.heartbeat.handle_timeout(now);
        self.sync_producer.handle_timeout(now);
        self.emcy.handle_timeout(now);
        self.tpdos.iter_mut().for_each(|slot| slot.pdo.handle_timeout(now));
        if self.sync_consumer.handle_timeout(now) {
            self.tpdos.iter_mut().for_each(|slot| slot.pdo.close_window());
        }
        self.handle_reaction(now, od)
            .or_else(|| self.handle_own_sync(now, od))
            .or_else(|| self.handle_lost_peers(now, od))
            .or_else(|| self.handle_late_pdos(now, od))
            .or_else(|| {
                let event = self.servers.iter_mut().flatten().find_map(|server| server.handle_timeout(now))?;
                self.follow_sdo(now, event, od)
            })
    }

    /// The error behaviour of CiA 301, 7.5.2.31 (1029h:01).
    fn handle_reaction(&mut self, now: Instant, od: &mut dyn ObjectDictionary) -> Option<Event> {
        self.reaction.take_if(|due| *due <= now)?;
        match objects::read_u8(od, 0x1029, 1).unwrap_or(0) {
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

    /// The next frame to send, the most important one first.
    pub fn poll_transmit(&mut self, now: Instant, od: &mut dyn ObjectDictionary) -> Option<Frame> {
        if let Some(boot_up) = self.nmt.poll_transmit(now) {
            return Some(boot_up);
        }
        let state = self.nmt.state();
        if state.allows_messages()
            && let Some(message) = self.poll_messages(now, od)
        {
            return Some(message);
        }
        let guarding = &mut self.guarding;
        let error_control = self.heartbeat.poll_transmit(now, state).or_else(|| guarding.poll_transmit(now, state));
        if error_control.is_some() || !state.allows_messages() {
            return error_control;
        }
        self.poll_sdo(now, od)
    }

    fn poll_messages(&mut self, now: Instant, od: &mut dyn ObjectDictionary) -> Option<Frame> {
        if let Some((sync, frame)) = self.sync_producer.poll_transmit(now) {
            self.sync_consumer.open_window(now);
            self.own_sync = Some((now, sync));
            return Some(frame);
        }
        if let Some(frame) = self.emcy.poll_transmit(now) {
            return Some(frame);
        }
        // Outside OPERATIONAL no TPDO is due: they are suspended.
        self.tpdos.iter_mut().find_map(|slot| slot.pdo.poll_transmit(now, od))
    }

    fn poll_sdo(&mut self, now: Instant, od: &mut dyn ObjectDictionary) -> Option<Frame> {
        let mut checked = Checked {
            od,
            state: self.nmt.state(),
            behaviour: &self.behaviour,
            rpdos: &self.rpdos,
            tpdos: &self.tpdos,
            monitored: MONITORED,
        };
        self.servers.iter_mut().flatten().find_map(|server| server.poll_transmit(now, &mut checked))
    }

    /// When to call [`Device::handle_timeout`]; `None` to sleep until a frame comes.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        if self.nmt.state() == NmtState::Initialising {
            return None;
        }
        let own = [
            self.heartbeat.poll_timeout(),
            self.sync_producer.poll_timeout(),
            self.sync_consumer.poll_timeout(),
            self.own_sync.map(|(sent, _)| sent),
            self.emcy.poll_timeout(),
            self.guarding.poll_timeout(),
            self.reaction,
        ];
        let consumers = self.consumers.iter().flatten().filter_map(HeartbeatConsumer::poll_timeout);
        let servers = self.servers.iter().flatten().filter_map(SdoServer::poll_timeout);
        let rpdos = self.rpdos.iter().filter_map(|slot| slot.pdo.poll_timeout());
        let tpdos = self.tpdos.iter().filter_map(|slot| slot.pdo.poll_timeout());
        own.into_iter().flatten().chain(consumers).chain(servers).chain(rpdos).chain(tpdos).min()
    }

    /// An error of communication that the device has noticed itself.
    fn raise_communication_error(&mut self, code: ErrorCode, od: &mut dyn ObjectDictionary) {
        if self.behaviour.unreported.contains(&code) {
            return;
        }
        self.communication_error = true;
        let record = self.behaviour.records_communication_errors;
        self.emcy.raise(code, self.errors(), [0; 5], record, od);
    }

    /// Resets the error of communication in the register when none is left. Where the application has
    /// errors, the device is not free of errors, and sends no message that may be read as that.
    fn end_communication_error(&mut self, od: &mut dyn ObjectDictionary) {
        if !self.communication_error || self.has_communication_error() {
            return;
        }
        self.communication_error = false;
        let left = self.errors();
        if left.is_empty() {
            self.emcy.clear(left, [0; 5], od);
        } else {
            self.emcy.set_register(left, od);
        }
    }

    fn has_communication_error(&self) -> bool {
        self.sync_consumer.has_length_error()
            || self.guarding.is_lost()
            || self.consumers.iter().flatten().any(|consumer| consumer.heartbeat() == Heartbeat::Lost)
            || self.rpdos.iter().any(|slot| slot.pdo.length_error().is_some() || slot.pdo.has_timed_out())
    }
}
