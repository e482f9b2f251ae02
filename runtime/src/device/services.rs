//! Everything of a device but its SDO servers: what is due, in which order it is sent, and when time passes.

use core::ops::{Deref, DerefMut};

use super::behaviour::{Behaves as _, Behaviour};
use super::event::Event;
use super::selection::Selection;
use crate::cia301;
use crate::frame::Frame;
use crate::id::{CobId, NodeId};
use crate::object::{Address, ObjectDictionary, TimeOfDay};
use crate::service::choice::sealed;
use crate::service::emcy_producer::EmcyProducer;
use crate::service::guarding::Guarding;
use crate::service::heartbeat_consumer::HeartbeatConsumer;
use crate::service::heartbeat_producer::HeartbeatProducer;
use crate::service::mapping::Mapping;
use crate::service::nmt::Nmt;
use crate::service::objects;
use crate::service::rpdo::{self, Rpdo};
use crate::service::sync_consumer::SyncConsumer;
use crate::service::sync_producer::SyncProducer;
use crate::service::tpdo::{self, Tpdo, Triggers};
use crate::time::{Instant, earliest, expire};
use crate::wire::emcy::{ErrorCode, ErrorRegister};
use crate::wire::nmt::NmtState;
use crate::wire::pdo::{PdoCobId, TransmissionType};
use crate::wire::sync::Sync;
use crate::wire::time;

/// The services, as [`Device`](super::Device) configures them from the dictionary.
#[derive(Clone, Debug)]
pub(super) struct Services<
    const RPDOS: usize,
    const TPDOS: usize,
    const MONITORED: usize,
    const MAPPED: usize,
    S: Selection,
> {
    pub(super) behaviour: S::Behaviour,
    pub(super) nmt: Nmt,
    pub(super) sync_consumer: SyncConsumer,
    pub(super) sync_producer: SyncProducer,
    /// The SYNC that the device itself has sent last: it concerns its own PDOs too.
    own_sync: Sync,
    /// TIME and guarding are there from the first [`Services::configure`] on, unless the device leaves them out.
    pub(super) time: Option<Part<S::Time, Time>>,
    pub(super) emcy: EmcyProducer,
    pub(super) heartbeat: HeartbeatProducer,
    pub(super) guarding: Option<Part<S::Guarding, Guarding>>,
    pub(super) consumers: [Option<HeartbeatConsumer>; MONITORED],
    /// How many of the first places are in use. No others are looked at for the next deadline, which is asked for often.
    pub(super) consumed: u8,
    pub(super) rpdos: Slots<RpdoSlot<MAPPED>, RPDOS>,
    pub(super) tpdos: Slots<TpdoSlot<MAPPED>, TPDOS>,
    /// The error register shows an error of communication that the device has noticed itself.
    pub(super) communication_error: bool,
    /// What the application has set in the error register.
    pub(super) application_errors: ErrorRegister,
    /// The device enters OPERATIONAL by itself after its boot-up (1F80h).
    pub(super) starts_itself: bool,
    pub(super) timers: Timers,
}

/// A part of a service that may be left out.
type Part<C, T> = <C as sealed::Choice>::Part<T>;

/// TIME, consumed and produced.
#[derive(Clone, Copy, Debug)]
pub(super) struct Time {
    /// It is consumed under this identifier.
    pub(super) consumer: Option<CobId>,
    /// It is produced under this identifier.
    pub(super) producer: Option<CobId>,
    /// The time to send.
    pub(super) pending: Option<TimeOfDay>,
}

impl Time {
    pub(super) const OFF: Time = Time { consumer: None, producer: None, pending: None };

    fn poll_transmit(&mut self) -> Option<Frame> {
        let (id, time) = self.producer.zip(self.pending.take())?;
        Some(time::frame(id, time))
    }
}

/// The PDOs that the dictionary has, in the first of the device's places. Of many places only these are walked over, so that
/// a SYNC costs what the dictionary has, and not what the device has room for. A few are walked over whole: on a
/// microcontroller a free place costs less than to know where they begin.
#[derive(Clone, Debug)]
pub(super) struct Slots<T, const PLACES: usize> {
    places: [T; PLACES],
    used: u16,
}

impl<T, const PLACES: usize> Slots<T, PLACES> {
    const ARE_FEW: bool = PLACES <= 8;

    const fn new(free: [T; PLACES]) -> Self {
        Slots { places: free, used: 0 }
    }

    /// Takes the next place, if there is one left.
    pub(super) fn take_place(&mut self) -> Option<&mut T> {
        let place = self.places.get_mut(usize::from(self.used))?;
        self.used += 1;
        Some(place)
    }
}

impl<T, const PLACES: usize> Deref for Slots<T, PLACES> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        if Self::ARE_FEW { &self.places } else { &self.places[..usize::from(self.used)] }
    }
}

impl<T, const PLACES: usize> DerefMut for Slots<T, PLACES> {
    fn deref_mut(&mut self) -> &mut [T] {
        if Self::ARE_FEW { &mut self.places } else { &mut self.places[..usize::from(self.used)] }
    }
}

/// What a free place has. No PDO can have this identifier, and there is none without objects.
const NO_ID: PdoCobId = PdoCobId::valid(CobId::NMT);
const NO_TYPE: TransmissionType = TransmissionType::SynchronousAcyclic;

/// An RPDO and its number; number 0 is free.
#[derive(Clone, Copy, Debug)]
pub(super) struct RpdoSlot<const MAPPED: usize> {
    pub(super) number: u16,
    pub(super) pdo: Rpdo<MAPPED>,
    /// Which TPDOs map an object that it writes, and are sent when it changes: bit n for those in places n, n + 32, and so on.
    pub(super) touched: u32,
}

/// A TPDO and its number; number 0 is free.
#[derive(Clone, Copy, Debug)]
pub(super) struct TpdoSlot<const MAPPED: usize> {
    pub(super) number: u16,
    pub(super) pdo: Tpdo<MAPPED>,
}

impl<const MAPPED: usize> RpdoSlot<MAPPED> {
    // All of its bytes are zero, so that places are cleared, and not copied from flash (tests/size).
    const FREE: Self = {
        let parameters = rpdo::Parameters { cob_id: NO_ID, transmission: NO_TYPE, ..rpdo::Parameters::OFF };
        RpdoSlot { number: 0, pdo: Rpdo::new(parameters, Mapping::EMPTY), touched: 0 }
    };

    pub(super) const fn parameter_index(&self) -> u16 {
        cia301::rpdo(self.number)
    }
}

impl<const MAPPED: usize> TpdoSlot<MAPPED> {
    // As with RPDOs.
    const FREE: Self = {
        let parameters = tpdo::Parameters { cob_id: NO_ID, transmission: NO_TYPE, ..tpdo::Parameters::OFF };
        TpdoSlot { number: 0, pdo: Tpdo::new(parameters, Mapping::EMPTY, Triggers::NONE) }
    };

    pub(super) const fn parameter_index(&self) -> u16 {
        cia301::tpdo(self.number)
    }

    /// Looks for a change of the bits that the device's masks let through, if it has masks.
    pub(super) fn compare(&mut self, masks: Option<u16>, od: &mut (impl ObjectDictionary + ?Sized)) {
        let mask = masks.map_or(u64::MAX, |first| {
            let mut half = |sub| objects::read_u32(od, first + self.number - 1, sub).map_or(u32::MAX.into(), u64::from);
            half(1) | half(2) << 32
        });
        self.pdo.compare_masked(mask, od);
    }
}

/// What the device does by itself at a given time. Services have deadlines of their own.
#[derive(Clone, Copy, Debug)]
pub(super) enum Timer {
    /// It enters OPERATIONAL (1F80h).
    Start,
    /// The error behaviour (1029h).
    Reaction,
    /// The SYNC that it has sent takes effect on its own PDOs.
    OwnSync,
}

/// When each [`Timer`] runs out.
#[derive(Clone, Copy, Debug)]
pub(super) struct Timers([Option<Instant>; Timers::ALL.len()]);

impl Timers {
    const ALL: [Timer; 3] = [Timer::Start, Timer::Reaction, Timer::OwnSync];
    const NONE: Timers = Timers([None; Timers::ALL.len()]);

    pub(super) const fn set(&mut self, timer: Timer, at: Option<Instant>) {
        self.0[timer as usize] = at;
    }

    /// The first timer that has run out, which is stopped.
    fn expire(&mut self, now: Instant) -> Option<Timer> {
        let mut timers = Timers::ALL.into_iter().zip(&mut self.0);
        timers.find_map(|(timer, at)| expire(at, now).then_some(timer))
    }
}

impl<const RPDOS: usize, const TPDOS: usize, const MONITORED: usize, const MAPPED: usize, S: Selection>
    Services<RPDOS, TPDOS, MONITORED, MAPPED, S>
{
    pub(super) const fn new(node: NodeId, behaviour: S::Behaviour) -> Self {
        Services {
            behaviour,
            nmt: Nmt::new(node),
            sync_consumer: SyncConsumer::new(),
            sync_producer: SyncProducer::new(),
            own_sync: Sync { counter: None },
            time: None,
            emcy: EmcyProducer::new(),
            heartbeat: HeartbeatProducer::new(node),
            guarding: None,
            consumers: [const { None }; MONITORED],
            consumed: 0,
            rpdos: Slots::new([RpdoSlot::FREE; RPDOS]),
            tpdos: Slots::new([TpdoSlot::FREE; TPDOS]),
            communication_error: false,
            application_errors: ErrorRegister::NONE,
            starts_itself: false,
            timers: Timers::NONE,
        }
    }

    pub(super) fn behaviour(&self) -> &Behaviour {
        self.behaviour.behaviour()
    }

    /// Changes the NMT state by local control.
    pub(super) fn enter(&mut self, now: Instant, state: NmtState) -> Option<Event> {
        let event = self.nmt.enter(state)?;
        Some(self.follow_nmt(now, event))
    }

    pub(super) fn is_operational(&self) -> bool {
        self.nmt.state() == NmtState::Operational
    }

    /// Whether a TPDO maps an object.
    pub(super) fn maps(&self, address: Address) -> bool {
        self.tpdos.iter().any(|slot| slot.pdo.mapping().maps(address))
    }

    /// An object changed.
    pub(super) fn changed(&mut self, address: Address) {
        if self.is_operational() && self.behaviour().tpdo_masks.is_none() {
            self.tpdos.iter_mut().for_each(|slot| slot.pdo.changed(address));
        }
    }

    /// Objects from `first` to `last` may have changed.
    pub(super) fn compare(&mut self, first: Address, last: Address, od: &mut (impl ObjectDictionary + ?Sized)) {
        if self.is_operational() {
            let masks = self.behaviour().tpdo_masks;
            let concerned = self.tpdos.iter_mut().filter(|slot| slot.pdo.mapping().maps_between(first, last));
            concerned.for_each(|slot| slot.compare(masks, od));
        }
    }

    /// Does what is due, up to the first event.
    pub(super) fn handle_timeout(&mut self, now: Instant, od: &mut (impl ObjectDictionary + ?Sized)) -> Option<Event> {
        self.heartbeat.handle_timeout(now);
        self.sync_producer.handle_timeout(now);
        self.emcy.handle_timeout(now);
        self.tpdos.iter_mut().for_each(|slot| slot.pdo.handle_timeout(now));
        if self.sync_consumer.handle_timeout(now) {
            self.tpdos.iter_mut().for_each(|slot| slot.pdo.close_window());
        }
        let mut event = None;
        while event.is_none()
            && let Some(timer) = self.timers.expire(now)
        {
            event = self.handle_timer(timer, now, od);
        }
        event.or_else(|| self.handle_lost_peers(now, od)).or_else(|| self.handle_late_pdos(now, od))
    }

    fn handle_timer(&mut self, timer: Timer, now: Instant, od: &mut (impl ObjectDictionary + ?Sized)) -> Option<Event> {
        match timer {
            Timer::Start => self.enter(now, NmtState::Operational),
            // CiA 301, 7.5.2.31.
            Timer::Reaction => match objects::read_u8(od, cia301::ERROR_BEHAVIOUR, 1).unwrap_or(0) {
                0 if self.is_operational() => self.enter(now, NmtState::PreOperational),
                2 => self.enter(now, NmtState::Stopped),
                _ => None,
            },
            Timer::OwnSync => Some(self.handle_sync(self.own_sync, od).0),
        }
    }

    /// The identifier under which TIME is consumed.
    pub(super) fn time_id(&self) -> Option<CobId> {
        self.time.as_ref()?.consumer
    }

    fn handle_lost_peers(&mut self, now: Instant, od: &mut (impl ObjectDictionary + ?Sized)) -> Option<Event> {
        let lost = self
            .consumers
            .iter_mut()
            .flatten()
            .find_map(|consumer| Some((consumer.node(), consumer.handle_timeout(now)?)))
            .map(|(node, event)| Event::Heartbeat { node, event })
            .or_else(|| self.guarding.as_mut()?.handle_timeout(now).map(Event::LifeGuarding))?;
        self.raise_communication_error(ErrorCode::LIFE_GUARD, od);
        self.timers.set(Timer::Reaction, Some(now));
        Some(lost)
    }

    fn handle_late_pdos(&mut self, now: Instant, od: &mut (impl ObjectDictionary + ?Sized)) -> Option<Event> {
        let number = self.rpdos.iter_mut().find_map(|slot| slot.pdo.handle_timeout(now).map(|_| slot.number))?;
        self.raise_communication_error(ErrorCode::RPDO_TIMEOUT, od);
        Some(Event::RpdoTimedOut { number })
    }

    /// The next frame, the most important one first.
    fn poll_transmit(&mut self, now: Instant, od: &mut (impl ObjectDictionary + ?Sized)) -> Option<Frame> {
        self.end_communication_error(od);
        if let Some(boot_up) = self.nmt.poll_transmit(now) {
            self.timers.set(Timer::Start, self.starts_itself.then_some(now));
            return Some(boot_up);
        }
        let state = self.nmt.state();
        if state.allows_messages()
            && let Some(message) = self.poll_messages(now, od)
        {
            return Some(message);
        }
        if let Some(heartbeat) = self.heartbeat.poll_transmit(now, state) {
            return Some(heartbeat);
        }
        self.guarding.as_mut()?.poll_transmit(now, state)
    }

    fn poll_messages(&mut self, now: Instant, od: &mut (impl ObjectDictionary + ?Sized)) -> Option<Frame> {
        if let Some((sync, frame)) = self.sync_producer.poll_transmit(now) {
            self.sync_consumer.open_window(now);
            self.own_sync = sync;
            self.timers.set(Timer::OwnSync, Some(now));
            return Some(frame);
        }
        if let Some(frame) = self.emcy.poll_transmit(now) {
            return Some(frame);
        }
        if let Some(frame) = self.time.as_mut().and_then(|time| time.poll_transmit()) {
            return Some(frame);
        }
        self.poll_tpdos(now, od)
    }

    fn poll_tpdos(&mut self, now: Instant, od: &mut (impl ObjectDictionary + ?Sized)) -> Option<Frame> {
        // Outside OPERATIONAL none is due: they are suspended.
        self.tpdos.iter_mut().find_map(|slot| slot.pdo.poll_transmit(now, od))
    }

    /// When anything is due.
    fn poll_timeout(&self) -> Option<Instant> {
        let single = [
            self.heartbeat.poll_timeout(),
            self.sync_producer.poll_timeout(),
            self.sync_consumer.poll_timeout(),
            self.emcy.poll_timeout(),
            self.guarding.as_ref().and_then(|guarding| guarding.poll_timeout()),
        ];
        let consumers = self.consumers.iter().take(self.consumed.into());
        let consumers = consumers.flatten().map(HeartbeatConsumer::poll_timeout);
        let rpdos = self.rpdos.iter().map(|slot| slot.pdo.poll_timeout());
        let tpdos = self.tpdos.iter().map(|slot| slot.pdo.poll_timeout());
        earliest(single.into_iter().chain(self.timers.0).chain(consumers).chain(rpdos).chain(tpdos))
    }
}

/// What the services may have to send since they were asked last.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Due {
    Nothing,
    /// So many TPDOs that a SYNC has sampled, which have no timers.
    Sampled(u16),
    Anything,
}

/// Services, with a note of what they may have to send. Lending them mutably notes anything, so no code that makes a frame due has
/// to. This keeps the cost of an SDO transfer (`tests/bench/sdo.md`: u32 read, whole device) and of an RPDO independent
/// of the number of PDOs.
#[derive(Clone, Debug)]
pub(super) struct Polled<
    const RPDOS: usize,
    const TPDOS: usize,
    const MONITORED: usize,
    const MAPPED: usize,
    S: Selection,
> {
    services: Services<RPDOS, TPDOS, MONITORED, MAPPED, S>,
    due: Due,
    /// The next deadline, unless anything may be due.
    deadline: Option<Instant>,
}

impl<const RPDOS: usize, const TPDOS: usize, const MONITORED: usize, const MAPPED: usize, S: Selection>
    Polled<RPDOS, TPDOS, MONITORED, MAPPED, S>
{
    pub(super) const fn new(services: Services<RPDOS, TPDOS, MONITORED, MAPPED, S>) -> Self {
        Polled { services, due: Due::Anything, deadline: None }
    }

    pub(super) const fn get(&self) -> &Services<RPDOS, TPDOS, MONITORED, MAPPED, S> {
        &self.services
    }

    pub(super) const fn get_mut(&mut self) -> &mut Services<RPDOS, TPDOS, MONITORED, MAPPED, S> {
        self.due = Due::Anything;
        &mut self.services
    }

    pub(super) fn poll_transmit(&mut self, now: Instant, od: &mut (impl ObjectDictionary + ?Sized)) -> Option<Frame> {
        if self.due == Due::Nothing { None } else { self.ask(now, od) }
    }

    /// A frame that is no request to a server.
    pub(super) fn dispatch(
        &mut self,
        now: Instant,
        frame: &Frame,
        od: &mut (impl ObjectDictionary + ?Sized),
    ) -> Option<Event> {
        let (event, due) = self.services.dispatch(now, frame, od);
        self.due = match (self.due, due) {
            (before, Due::Nothing) => before,
            (Due::Nothing, due) => due,
            _ => Due::Anything,
        };
        event
    }

    /// Out of line, so that only the look at `due` is inlined.
    #[inline(never)]
    fn ask(&mut self, now: Instant, od: &mut (impl ObjectDictionary + ?Sized)) -> Option<Frame> {
        if let Due::Sampled(count) = self.due
            && self.deadline.is_none_or(|deadline| deadline > now)
        {
            self.due = if count > 1 { Due::Sampled(count - 1) } else { Due::Nothing };
            return self.services.poll_tpdos(now, od);
        }
        let frame = self.services.poll_transmit(now, od);
        if frame.is_none() {
            (self.due, self.deadline) = (Due::Nothing, self.services.poll_timeout());
        }
        frame
    }

    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        if self.due == Due::Anything { self.services.poll_timeout() } else { self.deadline }
    }
}
