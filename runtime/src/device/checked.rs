//! The dictionary as SDO clients see it: writes to communication objects are checked before they take
//! effect, with the rules of CiA 301, 7.5.2, that no limit of a data sheet can express.

use super::behaviour::{Behaviour, ChangeRule, ErrorControlRule};
use super::identifiers::{self, SYNC_GENERATED, TIME_EXISTS, TIME_PRODUCED, identifier, is_cob_id, switched};
use super::selection::Selection;
use super::services::Services;
use crate::abort::AbortCode;
use crate::cia301;
use crate::id::{CobId, NodeId};
use crate::object::{Address, Direction, Entry, Mapped, ObjectDictionary, number};
use crate::service::choice::sealed::Choice;
use crate::service::mapping;
use crate::service::objects;
use crate::service::sdo_server::default_channel;
use crate::wire::nmt::NmtState;
use crate::wire::pdo::{PdoCobId, TransmissionType};

/// A dictionary that is lent on to an SDO server.
pub(super) struct Checked<
    'a,
    O: ?Sized,
    const RPDOS: usize,
    const TPDOS: usize,
    const MONITORED: usize,
    const MAPPED: usize,
    S: Selection,
> {
    pub(super) od: &'a mut O,
    pub(super) services: &'a Services<RPDOS, TPDOS, MONITORED, MAPPED, S>,
    /// How many servers the device has room for, the default one among them.
    pub(super) server_room: usize,
}

impl<const RPDOS: usize, const TPDOS: usize, const MONITORED: usize, const MAPPED: usize, S: Selection>
    Services<RPDOS, TPDOS, MONITORED, MAPPED, S>
{
    /// The dictionary as clients may write it, of a device with room for `server_room` servers.
    pub(super) fn checked<'a, O: ObjectDictionary + ?Sized>(
        &'a self,
        od: &'a mut O,
        server_room: usize,
    ) -> Checked<'a, O, RPDOS, TPDOS, MONITORED, MAPPED, S> {
        Checked { od, services: self, server_room }
    }
}

impl<
    O: ObjectDictionary + ?Sized,
    const RPDOS: usize,
    const TPDOS: usize,
    const MONITORED: usize,
    const MAPPED: usize,
    S: Selection,
> ObjectDictionary for Checked<'_, O, RPDOS, TPDOS, MONITORED, MAPPED, S>
{
    fn entry(&self, address: Address) -> Result<Entry, AbortCode> {
        self.od.entry(address)
    }

    fn len(&self, entry: &Entry) -> Option<u32> {
        self.od.len(entry)
    }

    fn read(&mut self, entry: &Entry, offset: u32, buffer: &mut [u8]) -> Result<usize, AbortCode> {
        let (index, sub) = (entry.address.index(), entry.address.sub());
        if index == cia301::PREDEFINED_ERROR_FIELD && sub > 0 && !self.behaviour().empty_history_is_zero {
            let errors = objects::read_u8(self.od, cia301::PREDEFINED_ERROR_FIELD, 0).unwrap_or(0);
            if sub > errors {
                return Err(AbortCode::NO_DATA);
            }
        }
        self.od.read(entry, offset, buffer)
    }

    fn write(&mut self, entry: &Entry, offset: u32, data: &[u8], last: bool) -> Result<(), AbortCode> {
        let index = entry.address.index();
        let rule = self.behaviour().writable_in.iter().find(|rule| rule.address == entry.address);
        require(rule.is_none_or(|rule| rule.allows(self.services.nmt.state())), AbortCode::DEVICE_STATE)?;
        let is_communication = cia301::COMMUNICATION.contains(&index);
        // A wrong length is refused by the dictionary.
        if is_communication && entry.data_type.size() == Some(data.len()) && !self.changes_nothing(entry, data) {
            // No object that is checked is longer than 32 bits.
            self.check(entry.address, u32::try_from(number(data)).unwrap_or(u32::MAX))?;
        }
        self.od.write(entry, offset, data, last)?;
        if index == cia301::PREDEFINED_ERROR_FIELD {
            self.erase_history();
        }
        Ok(())
    }
}

impl<
    'a,
    O: ObjectDictionary + ?Sized,
    const RPDOS: usize,
    const TPDOS: usize,
    const MONITORED: usize,
    const MAPPED: usize,
    S: Selection,
> Checked<'a, O, RPDOS, TPDOS, MONITORED, MAPPED, S>
{
    /// Whether a parameter has the value already, as with a client that writes back what it has read: CiA 301 (7.5.2) forbids
    /// to change some, not to write them. A mapping is written step by step, and no step is left out; 1003h:00 shows a number
    /// and takes an order (7.5.2.2).
    fn changes_nothing(&mut self, entry: &Entry, data: &[u8]) -> bool {
        let is_order = matches!(
            entry.address.index(),
            cia301::PREDEFINED_ERROR_FIELD
                | cia301::RPDO_MAPPING_1..=cia301::RPDO_MAPPING_512
                | cia301::TPDO_MAPPING_1..=cia301::TPDO_MAPPING_512
        );
        self.behaviour().changes == ChangeRule::WhileInvalid
            && !is_order
            && objects::read_at(self.od, entry.address) == Some(number(data))
    }

    /// Whether `value` may be written now. Out of line, so that a write of any other object has few registers to save.
    #[inline(never)]
    pub(super) fn check(&mut self, address: Address, value: u32) -> Result<(), AbortCode> {
        let (index, sub) = (address.index(), address.sub());
        require(!is_cob_id(address) || CobId::is_parameter(value), AbortCode::INVALID_VALUE)?;
        self.check_selection(index, value)?;
        match (index, sub) {
            (cia301::PREDEFINED_ERROR_FIELD, 0) => require(value == 0, AbortCode::INVALID_VALUE),
            (cia301::COB_ID_SYNC, 0) => self.check_sync_cob_id(value),
            (cia301::GUARD_TIME | cia301::LIFE_TIME_FACTOR, 0) => self.check_guarding(index, value),
            (cia301::COB_ID_TIME, 0) => self.check_time_cob_id(value),
            (cia301::COB_ID_EMCY, 0) => self.check_emcy_cob_id(value),
            (cia301::CONSUMER_HEARTBEAT_TIME, 1..) => self.check_consumed_heartbeat(sub, value),
            (cia301::PRODUCER_HEARTBEAT_TIME, 0) => self.check_heartbeat(value),
            (cia301::SYNCHRONOUS_COUNTER_OVERFLOW, 0) => self.check_sync_overflow(value),
            (cia301::EMERGENCY_CONSUMER, 1..) => self.check_consumed_emcy(address, value),
            (cia301::ERROR_BEHAVIOUR, 1..) => require(value <= 2, AbortCode::INVALID_VALUE),
            (cia301::SDO_SERVER_1, 1 | 2) => self.check_default_sdo(sub, value),
            (cia301::SDO_SERVER_2..=cia301::SDO_CLIENT_128, 1 | 2) => self.check_sdo(address, value),
            (cia301::RPDO_1..=cia301::RPDO_512, _) => self.check_parameter(Direction::Receive, address, value),
            (cia301::TPDO_1..=cia301::TPDO_512, _) => self.check_parameter(Direction::Transmit, address, value),
            (cia301::RPDO_MAPPING_1..=cia301::RPDO_MAPPING_512, _) => {
                self.check_mapping(Direction::Receive, address, value)
            }
            (cia301::TPDO_MAPPING_1..=cia301::TPDO_MAPPING_512, _) => {
                self.check_mapping(Direction::Transmit, address, value)
            }
            _ => Ok(()),
        }
    }

    /// A value that asks for a service which the device has left out is refused.
    pub(super) fn check_selection(&self, index: u16, value: u32) -> Result<(), AbortCode> {
        let is_there = match index {
            cia301::GUARD_TIME | cia301::LIFE_TIME_FACTOR if value != 0 => S::Guarding::IS_THERE,
            cia301::COB_ID_TIME if value & TIME_EXISTS != 0 => S::Time::IS_THERE,
            _ => true,
        };
        require(is_there, AbortCode::DEVICE_INCOMPATIBLE)
    }

    pub(super) fn behaviour(&self) -> &'a Behaviour {
        self.services.behaviour()
    }

    /// What is in the dictionary now; 0 for what is not there.
    pub(super) fn current(&mut self, index: u16, sub: u8) -> u32 {
        objects::read_u32(self.od, index, sub).unwrap_or(0)
    }

    /// 1003h:00 was set to 0.
    fn erase_history(&mut self) {
        for sub in 1..=0xFE {
            if self.od.entry(Address::new(cia301::PREDEFINED_ERROR_FIELD, sub)).is_err() {
                break;
            }
            objects::write(self.od, cia301::PREDEFINED_ERROR_FIELD, sub, 0);
        }
    }

    /// CiA 301, 7.5.2.5: bits 0 to 29 stay while the device produces SYNC (bit 30).
    fn check_sync_cob_id(&mut self, new: u32) -> Result<(), AbortCode> {
        let old = self.current(cia301::COB_ID_SYNC, 0);
        require(identifier(new).is_some(), AbortCode::INVALID_VALUE)?;
        let can_generate = self.od.entry(Address::new(cia301::COMMUNICATION_CYCLE_PERIOD, 0)).is_ok();
        require(new & SYNC_GENERATED == 0 || can_generate, AbortCode::INVALID_VALUE)?;
        let generates = identifier(old).is_some() && old & SYNC_GENERATED != 0;
        self.check_change(old, new, generates && new & SYNC_GENERATED != 0)?;
        self.check_free(Address::new(cia301::COB_ID_SYNC, 0), old, Some(new))
    }

    /// CiA 301, 7.5.2.15: bits 0 to 29 stay while TIME exists (bits 30 and 31).
    fn check_time_cob_id(&mut self, new: u32) -> Result<(), AbortCode> {
        let old = self.current(cia301::COB_ID_TIME, 0);
        let can_be = new & TIME_PRODUCED == 0 || self.behaviour().produces_time;
        require(identifier(new).is_some() && can_be, AbortCode::INVALID_VALUE)?;
        let existed = identifier(old).filter(|_| old & TIME_EXISTS != 0);
        let exists = identifier(new).filter(|_| new & TIME_EXISTS != 0);
        require(stays(existed, exists), AbortCode::INVALID_VALUE)?;
        self.check_free(Address::new(cia301::COB_ID_TIME, 0), old, exists.and(Some(new)))
    }

    /// CiA 301, 7.5.2.17: bits 0 to 29 stay while EMCY exists (bit 31 clear).
    fn check_emcy_cob_id(&mut self, new: u32) -> Result<(), AbortCode> {
        let old = self.current(cia301::COB_ID_EMCY, 0);
        require(is_allowed(new), AbortCode::INVALID_VALUE)?;
        self.check_change(old, new, switched(old).is_some() && switched(new).is_some())?;
        self.check_free(Address::new(cia301::COB_ID_EMCY, 0), old, switched(new).and(Some(new)))
    }

    /// CiA 301, 7.5.2.30: bits 0 to 29 stay while the EMCY consumer exists (bit 31 clear). The device
    /// itself does not listen to it: its application may.
    fn check_consumed_emcy(&mut self, address: Address, new: u32) -> Result<(), AbortCode> {
        let old = self.current(address.index(), address.sub());
        require(is_allowed(new) && stays(switched(old), switched(new)), AbortCode::INVALID_VALUE)
    }

    /// Whether an identifier may change; `in_use` before and after.
    fn check_change(&self, old: u32, new: u32, in_use: bool) -> Result<(), AbortCode> {
        match self.behaviour().changes {
            ChangeRule::InPreOperational => self.require_pre_operational(),
            ChangeRule::WhileInvalid => {
                let same = CobId::from_parameter(old) == CobId::from_parameter(new);
                require(same || !in_use, AbortCode::INVALID_VALUE)
            }
        }
    }

    fn require_pre_operational(&self) -> Result<(), AbortCode> {
        require(self.services.nmt.state() == NmtState::PreOperational, AbortCode::DEVICE_STATE)
    }

    fn check_guarding(&mut self, index: u16, new: u32) -> Result<(), AbortCode> {
        let other = if index == cia301::GUARD_TIME { cia301::LIFE_TIME_FACTOR } else { cia301::GUARD_TIME };
        let guards = new != 0 && self.current(other, 0) != 0;
        let clashes = guards && self.current(cia301::PRODUCER_HEARTBEAT_TIME, 0) != 0;
        self.check_error_control(clashes)
    }

    fn check_heartbeat(&mut self, new: u32) -> Result<(), AbortCode> {
        let guards = self.current(cia301::GUARD_TIME, 0) != 0 && self.current(cia301::LIFE_TIME_FACTOR, 0) != 0;
        self.check_error_control(guards && new != 0)
    }

    fn check_error_control(&self, clashes: bool) -> Result<(), AbortCode> {
        let exclusive = self.behaviour().error_control == ErrorControlRule::Exclusive;
        require(!(clashes && exclusive), AbortCode::PARAMETER_INCOMPATIBLE)
    }

    /// CiA 301, 7.5.2.19: a node is consumed once only.
    fn check_consumed_heartbeat(&mut self, sub: u8, new: u32) -> Result<(), AbortCode> {
        let Some((node, _)) = consumed_heartbeat(new) else { return Ok(()) };
        require(usize::from(sub) <= MONITORED, AbortCode::DEVICE_INCOMPATIBLE)?;
        let others = self.current(cia301::CONSUMER_HEARTBEAT_TIME, 0) as u8;
        for other in (1..=others).filter(|&other| other != sub) {
            let twice = consumed_heartbeat(self.current(cia301::CONSUMER_HEARTBEAT_TIME, other))
                .is_some_and(|(same, _)| same == node);
            require(!twice, AbortCode::PARAMETER_INCOMPATIBLE)?;
        }
        Ok(())
    }

    /// CiA 301, 7.5.2.22: only while no SYNC is produced, and not 1.
    fn check_sync_overflow(&mut self, new: u32) -> Result<(), AbortCode> {
        require(matches!(new, 0 | 2..=240), AbortCode::INVALID_VALUE)?;
        require(self.current(cia301::COMMUNICATION_CYCLE_PERIOD, 0) == 0, AbortCode::DEVICE_STATE)
    }

    /// CiA 301, 7.5.2.33: the identifiers of the default server are what they are.
    pub(super) fn check_default_sdo(&self, sub: u8, new: u32) -> Result<(), AbortCode> {
        let (request, response) = default_channel(self.services.nmt.node());
        let id = if sub == 1 { request } else { response };
        require(new == id.to_parameter(), AbortCode::INVALID_VALUE)
    }

    /// CiA 301, 7.5.2.33: the identifiers of an SDO stay while it exists.
    fn check_sdo(&mut self, address: Address, new: u32) -> Result<(), AbortCode> {
        let (index, sub) = (address.index(), address.sub());
        require(is_allowed(new), AbortCode::INVALID_VALUE)?;
        let exists = identifiers::sdo(index, self.od).is_some();
        let (old, id) = (self.current(index, sub), switched(new));
        require(!exists || stays(switched(old), id), AbortCode::INVALID_VALUE)?;
        self.check_free(address, old, id.and(Some(new)))?;
        let other = objects::read_u32(self.od, index, 3 - sub).and_then(switched);
        let is_new_server = id.and(other).is_some() && !exists && index < cia301::SDO_CLIENT_1;
        let has_room = !is_new_server
            || identifiers::sdo_count(cia301::SDO_SERVER_2..cia301::SDO_CLIENT_1, self.od) + 1 < self.server_room;
        require(has_room, AbortCode::DEVICE_INCOMPATIBLE)
    }

    /// CiA 301, 7.5.2.35 and 7.5.2.37: the communication parameter of a PDO.
    fn check_parameter(&mut self, direction: Direction, address: Address, new: u32) -> Result<(), AbortCode> {
        if self.behaviour().changes == ChangeRule::InPreOperational {
            self.require_pre_operational()?;
        }
        let index = address.index();
        let valid = self.is_in_use(index);
        match address.sub() {
            1 => self.check_pdo_cob_id(index, valid, new),
            2 => require(type_exists(direction, new), AbortCode::INVALID_VALUE),
            // The SYNC counter never gets there.
            6 if new > 240 => Err(AbortCode::INVALID_VALUE),
            3 | 6 => {
                let refused = valid && self.behaviour().changes == ChangeRule::WhileInvalid;
                let same = self.current(index, address.sub()) == new;
                require(same || !refused, AbortCode::INVALID_VALUE)
            }
            _ => Ok(()),
        }
    }

    fn check_pdo_cob_id(&mut self, index: u16, valid: bool, new: u32) -> Result<(), AbortCode> {
        let will_be_valid = self.is_valid(PdoCobId(new));
        require(!will_be_valid || identifier(new).is_some(), AbortCode::INVALID_VALUE)?;
        let old = self.current(index, 1);
        self.check_change(old, new, valid && will_be_valid)?;
        require(!will_be_valid || valid || self.is_served(index), AbortCode::DEVICE_INCOMPATIBLE)?;
        self.check_free(Address::new(index, 1), old, will_be_valid.then_some(new))
    }

    /// Whether the device has room for the PDO.
    pub(super) fn is_served(&self, index: u16) -> bool {
        self.services.rpdos.iter().any(|slot| slot.parameter_index() == index)
            || self.services.tpdos.iter().any(|slot| slot.parameter_index() == index)
    }

    /// Two services of one device do not share an identifier. `owner` is the parameter that is written; `new` is
    /// `None` if the service will not exist. The value that is there already may be written again.
    fn check_free(&mut self, owner: Address, old: u32, new: Option<u32>) -> Result<(), AbortCode> {
        let changed = new.filter(|&new| new != old).map(CobId::from_parameter);
        let taken = changed.is_some_and(|id| self.is_taken(id, owner));
        require(!taken, AbortCode::PARAMETER_INCOMPATIBLE)
    }

    /// Whether a service of the device has the identifier. The service that has the parameter `owner` does not count.
    pub(super) fn is_taken(&mut self, id: CobId, owner: Address) -> bool {
        let is_other = |index, cob_id: PdoCobId| index != owner.index() && cob_id.is_valid() && cob_id.id() == id;
        self.services.rpdos.iter().any(|slot| is_other(slot.parameter_index(), slot.pdo.parameters().cob_id))
            || self.services.tpdos.iter().any(|slot| is_other(slot.parameter_index(), slot.pdo.parameters().cob_id))
            || identifiers::is_taken(id, owner, self.od)
    }

    pub(super) fn is_valid(&self, cob_id: PdoCobId) -> bool {
        cob_id.is_valid() || !self.behaviour().pdo_bit_31
    }

    /// Whether the PDO with this communication parameter exists.
    fn is_in_use(&mut self, parameter: u16) -> bool {
        let cob_id = self.current(parameter, 1);
        self.is_valid(PdoCobId(cob_id)) && identifier(cob_id).is_some()
    }

    /// CiA 301, 7.5.2.36 and 7.5.2.38: the mapping changes only while the PDO does not exist, and its
    /// entries only while none of them counts. To write what is there already is no change.
    fn check_mapping(&mut self, direction: Direction, address: Address, new: u32) -> Result<(), AbortCode> {
        let (index, sub) = (address.index(), address.sub());
        if self.current(index, sub) == new {
            return Ok(());
        }
        match self.behaviour().changes {
            ChangeRule::InPreOperational => self.require_pre_operational()?,
            ChangeRule::WhileInvalid => {
                require(!self.is_in_use(index - cia301::TO_MAPPING), AbortCode::UNSUPPORTED_ACCESS)?;
            }
        }
        if sub == 0 {
            return self.check_mapping_length(direction, index, new);
        }
        require(self.current(index, 0) == 0, AbortCode::UNSUPPORTED_ACCESS)?;
        let mapped = Mapped::from_parameter(new);
        if new == 0 { Ok(()) } else { mapping::check(mapped, direction, self.behaviour().dummies, self.od) }
    }

    fn check_mapping_length(&mut self, direction: Direction, index: u16, len: u32) -> Result<(), AbortCode> {
        let has_room = |&len: &u8| len == 0 || self.od.entry(Address::new(index, len)).is_ok();
        let len = u8::try_from(len).ok().filter(|&len| usize::from(len) <= MAPPED).filter(has_room);
        let mut bits = 0;
        for sub in 1..=len.ok_or(AbortCode::PDO_LENGTH_EXCEEDED)? {
            let entry = objects::read_u32(self.od, index, sub).ok_or(AbortCode::PDO_LENGTH_EXCEEDED)?;
            let mapped = Mapped::from_parameter(entry);
            mapping::check(mapped, direction, self.behaviour().dummies, self.od)?;
            bits = mapping::bits_with(bits, mapped).ok_or(AbortCode::PDO_LENGTH_EXCEEDED)?;
        }
        Ok(())
    }
}

/// Node and time in ms of an entry of 1016h; `None` when the entry consumes nothing.
pub(super) fn consumed_heartbeat(entry: u32) -> Option<(NodeId, u16)> {
    let node = u8::try_from(entry >> 16).ok().and_then(NodeId::new)?;
    let time_ms = entry as u16;
    (time_ms != 0).then_some((node, time_ms))
}

pub(super) fn type_exists(direction: Direction, code: u32) -> bool {
    let Ok(code) = u8::try_from(code) else { return false };
    match TransmissionType::from_code(code) {
        TransmissionType::Reserved(_) => false,
        TransmissionType::Remote | TransmissionType::SynchronousRemote => direction == Direction::Transmit,
        _ => true,
    }
}

/// Whether a COB-ID parameter may have this value: any if bit 31 switches the service off, else one whose identifier is
/// not restricted (CiA 301, 7.3.5).
fn is_allowed(cob_id: u32) -> bool {
    !PdoCobId(cob_id).is_valid() || identifier(cob_id).is_some()
}

/// Whether a service keeps its identifier for as long as it exists.
fn stays(before: Option<CobId>, after: Option<CobId>) -> bool {
    before.zip(after).is_none_or(|(before, after)| before == after)
}

pub(super) fn require(condition: bool, code: AbortCode) -> Result<(), AbortCode> {
    if condition { Ok(()) } else { Err(code) }
}
