//! How the communication objects of the dictionary configure the services.

use super::behaviour::{Behaves as _, Behaviour};
use super::checked::consumed_heartbeat;
use super::identifiers::{self, SYNC_GENERATED, TIME_CONSUMED, TIME_PRODUCED, identifier};
use super::selection::Selection;
use super::services::{Services, Time, TpdoSlot};
use crate::cia301;
use crate::id::CobId;
use crate::object::{Address, Direction, ObjectDictionary};
use crate::service::choice::sealed::Choice;
use crate::service::guarding::Guarding;
use crate::service::heartbeat_consumer::HeartbeatConsumer;
use crate::service::mapping::Mapping;
use crate::service::objects;
use crate::service::rpdo::{self, Rpdo};
use crate::service::tpdo::{self, Tpdo};
use crate::time::{Duration, Instant};
use crate::wire::heartbeat::ErrorControl;
use crate::wire::pdo::{PdoCobId, TransmissionType};

impl<const RPDOS: usize, const TPDOS: usize, const MONITORED: usize, const MAPPED: usize, S: Selection>
    Services<RPDOS, TPDOS, MONITORED, MAPPED, S>
{
    /// Configures all services.
    pub(super) fn configure(&mut self, now: Instant, od: &mut (impl ObjectDictionary + ?Sized)) {
        self.time = S::Time::part(Time::OFF);
        self.guarding = S::Guarding::part(Guarding::new(self.nmt.node()));
        self.load_messages(now, od);
        let period = heartbeat_period(od);
        // The boot-up message stands for the first heartbeat.
        self.heartbeat.configure(now, period, period);
        for place in 0..u8::try_from(MONITORED).unwrap_or(u8::MAX) {
            self.load_consumer(place + 1, od);
        }
        self.starts_itself = starts_itself(od);
        self.load_pdos(now, od);
    }

    /// Configures what a written entry concerns.
    pub(super) fn reconfigure(&mut self, now: Instant, address: Address, od: &mut (impl ObjectDictionary + ?Sized)) {
        match address.index() {
            cia301::CONSUMER_HEARTBEAT_TIME => self.load_consumer(address.sub(), od),
            cia301::PRODUCER_HEARTBEAT_TIME => {
                self.heartbeat.configure(now, heartbeat_period(od), Duration::ZERO);
                self.load_guarding(od);
            }
            index @ cia301::RPDO_1..=cia301::RPDO_MAPPING_512 => self.load_rpdo(cia301::pdo_number(index), od),
            index @ cia301::TPDO_1..=cia301::TPDO_MAPPING_512 => self.load_tpdo(cia301::pdo_number(index), now, od),
            _ => self.load_messages(now, od),
        }
        if address.index() >= cia301::RPDO_1 {
            self.find_touched();
        }
    }

    /// What is loaded again goes on if its parameters are as they were.
    fn load_messages(&mut self, now: Instant, od: &mut (impl ObjectDictionary + ?Sized)) {
        self.load_sync(now, od);
        self.load_time(od);
        self.load_emcy(od);
        self.load_guarding(od);
    }

    /// Which TPDOs map what RPDOs write, of those for which a change is an event.
    fn find_touched(&mut self) {
        for slot in self.rpdos.iter_mut() {
            let is_touched = |(_, tpdo): &(usize, &TpdoSlot<MAPPED>)| {
                tpdo.pdo.counts_changes() && tpdo.pdo.mapping().overlaps(slot.pdo.mapping())
            };
            let touched = self.tpdos.iter().enumerate().filter(is_touched);
            slot.touched = touched.fold(0, |bits, (at, _)| bits | 1 << (at % 32));
        }
    }

    /// The identifiers of all frames for these services.
    pub(super) fn cob_ids(&self) -> impl Iterator<Item = CobId> {
        let heartbeats = self.consumers.iter().flatten().map(|consumer| ErrorControl::cob_id(consumer.node()));
        let rpdos = self.rpdos.iter().map(|slot| &slot.pdo).filter(|pdo| pdo.is_active());
        let tpdos = self.tpdos.iter().map(|slot| &slot.pdo).filter(|pdo| pdo.is_active());
        let pdos = rpdos.map(|pdo| pdo.parameters().cob_id).chain(tpdos.map(|pdo| pdo.parameters().cob_id));
        self.sync_consumer.id().into_iter().chain(self.time_id()).chain(heartbeats).chain(pdos.map(PdoCobId::id))
    }

    fn load_sync(&mut self, now: Instant, od: &mut (impl ObjectDictionary + ?Sized)) {
        let id = identifiers::sync(od);
        let generates =
            objects::read_u32(od, cia301::COB_ID_SYNC, 0).is_some_and(|cob_id| cob_id & SYNC_GENERATED != 0);
        let period_us = objects::read_u32(od, cia301::COMMUNICATION_CYCLE_PERIOD, 0)
            .filter(|_| generates && id.is_some())
            .unwrap_or(0);
        let window_us = objects::read_u32(od, cia301::SYNCHRONOUS_WINDOW_LENGTH, 0).unwrap_or(0);
        let overflow = objects::read_u8(od, cia301::SYNCHRONOUS_COUNTER_OVERFLOW, 0)
            .filter(|n| (2..=240).contains(n))
            .unwrap_or(0);
        self.sync_consumer.configure(id, overflow, Duration::from_micros(u64::from(window_us)));
        self.sync_producer.configure(
            now,
            id.unwrap_or(CobId::SYNC),
            Duration::from_micros(u64::from(period_us)),
            overflow,
        );
    }

    fn load_time(&mut self, od: &mut (impl ObjectDictionary + ?Sized)) {
        let behaviour = self.behaviour.behaviour();
        let Some(time) = &mut self.time else { return };
        time.consumer = identifiers::time(TIME_CONSUMED, od);
        time.producer = identifiers::time(TIME_PRODUCED, od).filter(|_| behaviour.produces_time);
    }

    fn load_emcy(&mut self, od: &mut (impl ObjectDictionary + ?Sized)) {
        let inhibit = objects::read_u16(od, cia301::INHIBIT_TIME_EMCY, 0).unwrap_or(0);
        let order = self.behaviour().emcy_code_order;
        self.emcy.configure(identifiers::emcy(od), Duration::from_100us(inhibit), order);
    }

    /// With a heartbeat there is no life guarding (CiA 301, 7.2.8.3.2.2), also where it had begun before.
    fn load_guarding(&mut self, od: &mut (impl ObjectDictionary + ?Sized)) {
        let Some(guarding) = &mut self.guarding else { return };
        let guarded = heartbeat_period(od).is_zero();
        let guard_time_ms = objects::read_u16(od, cia301::GUARD_TIME, 0).filter(|_| guarded).unwrap_or(0);
        let life_time_factor = objects::read_u8(od, cia301::LIFE_TIME_FACTOR, 0).unwrap_or(0);
        guarding.configure(Duration::from_millis(u64::from(guard_time_ms)), life_time_factor);
    }

    /// Entry `sub` of 1016h has the place `sub - 1`.
    fn load_consumer(&mut self, sub: u8, od: &mut (impl ObjectDictionary + ?Sized)) {
        let Some(place) = usize::from(sub).checked_sub(1).and_then(|at| self.consumers.get_mut(at)) else { return };
        let entry = objects::read_u32(od, cia301::CONSUMER_HEARTBEAT_TIME, sub).and_then(consumed_heartbeat);
        if entry.is_some() {
            self.consumed = self.consumed.max(sub);
        }
        *place = entry.map(|(node, time_ms)| HeartbeatConsumer::new(node, Duration::from_millis(u64::from(time_ms))));
    }

    /// Gives the PDOs that the dictionary has their places, and configures them.
    fn load_pdos(&mut self, now: Instant, od: &mut (impl ObjectDictionary + ?Sized)) {
        let mut last = 0;
        while let Some(number) = next_pdo(Direction::Receive, last, od)
            && let Some(slot) = self.rpdos.take_place()
        {
            slot.number = number;
            self.load_rpdo(number, od);
            last = number;
        }
        last = 0;
        while let Some(number) = next_pdo(Direction::Transmit, last, od)
            && let Some(slot) = self.tpdos.take_place()
        {
            slot.number = number;
            self.load_tpdo(number, now, od);
            last = number;
        }
        self.find_touched();
    }

    fn load_rpdo(&mut self, number: u16, od: &mut (impl ObjectDictionary + ?Sized)) {
        if let Some(slot) = self.rpdos.iter_mut().find(|slot| slot.number == number) {
            let mut pdo = rpdo_of(self.behaviour.behaviour(), number, od);
            pdo.resume(&slot.pdo);
            slot.pdo = pdo;
        }
    }

    /// In OPERATIONAL, a TPDO that is switched on starts as it does when the state is entered.
    fn load_tpdo(&mut self, number: u16, now: Instant, od: &mut (impl ObjectDictionary + ?Sized)) {
        let operational = self.is_operational();
        if let Some(slot) = self.tpdos.iter_mut().find(|slot| slot.number == number) {
            let mut pdo = tpdo_of(self.behaviour.behaviour(), number, od);
            match (operational, slot.pdo.is_active()) {
                (false, _) => {}
                (true, false) => pdo.start(now),
                (true, true) => pdo.resume(now, &slot.pdo),
            }
            slot.pdo = pdo;
        }
    }
}

fn rpdo_of<const N: usize>(behaviour: &Behaviour, number: u16, od: &mut (impl ObjectDictionary + ?Sized)) -> Rpdo<N> {
    let index = cia301::rpdo(number);
    let deadline_ms = objects::read_u16(od, index, 5).filter(|_| behaviour.rpdo_deadlines).unwrap_or(0);
    let parameters = rpdo::Parameters {
        cob_id: pdo_cob_id(behaviour, index, od),
        transmission: transmission(index, od),
        deadline: Duration::from_millis(u64::from(deadline_ms)),
    };
    Rpdo::new(parameters, Mapping::load(index + cia301::TO_MAPPING, od))
}

fn tpdo_of<const N: usize>(behaviour: &Behaviour, number: u16, od: &mut (impl ObjectDictionary + ?Sized)) -> Tpdo<N> {
    let index = cia301::tpdo(number);
    let transmission = transmission(index, od);
    let parameters = tpdo::Parameters {
        cob_id: pdo_cob_id(behaviour, index, od),
        transmission,
        inhibit: Duration::from_100us(objects::read_u16(od, index, 3).unwrap_or(0)),
        event_timer: Duration::from_millis(u64::from(objects::read_u16(od, index, 5).unwrap_or(0))),
        sync_start: objects::read_u8(od, index, 6).unwrap_or(0),
    };
    let triggers = behaviour.triggers(number, transmission);
    let mut pdo = Tpdo::new(parameters, Mapping::load(index + cia301::TO_MAPPING, od), triggers);
    pdo.set_acyclic_always(behaviour.type_0_at_every_sync);
    pdo
}

/// The COB-ID parameter, without the bits that the device ignores; switched off if no PDO may have its identifier.
fn pdo_cob_id(behaviour: &Behaviour, index: u16, od: &mut (impl ObjectDictionary + ?Sized)) -> PdoCobId {
    let Some(cob_id) = objects::read_u32(od, index, 1) else { return PdoCobId::OFF };
    let mut unknown = 0;
    if !behaviour.pdo_bit_31 {
        unknown |= 1 << 31;
    }
    if !behaviour.pdo_bit_30 {
        unknown |= 1 << 30;
    }
    let cob_id = PdoCobId(cob_id & !unknown);
    if identifier(cob_id.0).is_some() { cob_id } else { cob_id.switched_off() }
}
/// CiA 302-2, 1F80h: a device that is no manager (bit 0) enters OPERATIONAL by itself, unless bit 2 forbids it. A
/// manager first boots its network.
fn starts_itself(od: &mut (impl ObjectDictionary + ?Sized)) -> bool {
    const MANAGER: u32 = 1 << 0;
    const NOT_BY_ITSELF: u32 = 1 << 2;
    objects::read_u32(od, cia301::NMT_STARTUP, 0).is_some_and(|startup| startup & (MANAGER | NOT_BY_ITSELF) == 0)
}

fn heartbeat_period(od: &mut (impl ObjectDictionary + ?Sized)) -> Duration {
    Duration::from_millis(u64::from(objects::read_u16(od, cia301::PRODUCER_HEARTBEAT_TIME, 0).unwrap_or(0)))
}

/// The PDO with the lowest number above `last` that the dictionary has.
fn next_pdo(direction: Direction, last: u16, od: &(impl ObjectDictionary + ?Sized)) -> Option<u16> {
    (last + 1..513).find(|&number| pdo_exists(direction, number, od))
}

/// Whether the dictionary has both parameters of a PDO. Compatibility entries may have one only.
pub(super) fn pdo_exists(direction: Direction, number: u16, od: &(impl ObjectDictionary + ?Sized)) -> bool {
    let parameter = match direction {
        Direction::Receive => cia301::rpdo(number),
        Direction::Transmit => cia301::tpdo(number),
    };
    let mapping = parameter + cia301::TO_MAPPING;
    od.entry(Address::new(parameter, 1)).is_ok() && od.entry(Address::new(mapping, 0)).is_ok()
}

fn transmission(index: u16, od: &mut (impl ObjectDictionary + ?Sized)) -> TransmissionType {
    TransmissionType::from_code(objects::read_u8(od, index, 2).unwrap_or(255))
}
