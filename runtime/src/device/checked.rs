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
        self.check_selection(index, value)?;
        match (index, sub) {
            (cia301::SDO_SERVER_1, 1 | 2) => self.check_default_sdo(sub, value),
            _ if is_cob_id(address) => self.check_cob_id(address, value),
            (cia301::PREDEFINED_ERROR_FIELD, 0) => require(value == 0, AbortCode::INVALID_VALUE),
            (cia301::GUARD_TIME | cia301::LIFE_TIME_FACTOR, 0) => self.check_guarding(index, value),
            (cia301::CONSUMER_HEARTBEAT_TIME, 1..) => self.check_consumed_heartbeat(sub, value),
            (cia301::PRODUCER_HEARTBEAT_TIME, 0) => self.check_heartbeat(value),
            (cia301::SYNCHRONOUS_COUNTER_OVERFLOW, 0) => self.check_sync_overflow(value),
            (cia301::ERROR_BEHAVIOUR, 1..) => require(value <= 2, AbortCode::INVALID_VALUE),
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

    /// The COB-ID of a service (CiA 301, 7.5.2.5, 15, 17, 30, 33, 35 and 37): bits 0 to 29 stay while it exists. None has an
    /// identifier that is restricted (7.3.5), and no two services of the device have the same.
    fn check_cob_id(&mut self, address: Address, new: u32) -> Result<(), AbortCode> {
        let index = address.index();
        let old = self.current(index, address.sub());
        let id = |cob_id| identifier(cob_id).filter(|_| self.exists(index, cob_id));
        let (before, after) = (id(old), id(new));
        let is_right = CobId::is_parameter(new) && (identifier(new).is_some() || !self.exists(index, new));
        // What else a value must be, whether the identifier stays if there is one before and after, and whether there is room.
        let (is_allowed, stays, has_room) = match index {
            cia301::COB_ID_SYNC => {
                let can_generate = self.od.entry(Address::new(cia301::COMMUNICATION_CYCLE_PERIOD, 0)).is_ok();
                (new & SYNC_GENERATED == 0 || can_generate, old & new & SYNC_GENERATED != 0, true)
            }
            cia301::COB_ID_TIME => {
                let can_be = new & TIME_PRODUCED == 0 || self.behaviour().produces_time;
                (identifier(new).is_some() && can_be, true, true)
            }
            cia301::SDO_SERVER_2..=cia301::SDO_CLIENT_128 => {
                let exists = identifiers::sdo(index, self.od).is_some();
                (true, exists, exists || self.has_room_for_sdo(address, after))
            }
            cia301::RPDO_1.. => (true, true, after.is_none() || before.is_some() || self.is_served(index)),
            _ => (true, true, true),
        };
        require(is_right && is_allowed, AbortCode::INVALID_VALUE)?;
        let rule = match index {
            cia301::COB_ID_SYNC | cia301::COB_ID_EMCY | cia301::RPDO_1.. => self.behaviour().changes,
            _ => ChangeRule::WhileInvalid,
        };
        match rule {
            ChangeRule::InPreOperational => self.require_pre_operational()?,
            ChangeRule::WhileInvalid => {
                let changes = before.zip(after).is_some_and(|(before, after)| before != after);
                require(!(stays && changes), AbortCode::INVALID_VALUE)?;
            }
        }
        require(has_room, AbortCode::DEVICE_INCOMPATIBLE)?;
        // The device itself does not listen to EMCY of others: its application may. A value that is there already may be
        // written again.
        let is_own = index != cia301::EMERGENCY_CONSUMER && new != old;
        let is_taken = is_own && after.is_some_and(|id| self.is_taken(id, address));
        require(!is_taken, AbortCode::PARAMETER_INCOMPATIBLE)
    }

    /// Whether the device has room for one more SDO, if it is a server that exists with this identifier.
    fn has_room_for_sdo(&mut self, address: Address, id: Option<CobId>) -> bool {
        let other = objects::read_u32(self.od, address.index(), 3 - address.sub()).and_then(switched);
        let is_server = id.and(other).is_some() && address.index() < cia301::SDO_CLIENT_1;
        let servers = cia301::SDO_SERVER_2..cia301::SDO_CLIENT_1;
        !is_server || identifiers::sdo_count(servers, self.od) + 1 < self.server_room
    }

    /// Whether a COB-ID parameter says that its service exists.
    fn exists(&self, index: u16, cob_id: u32) -> bool {
        match index {
            cia301::COB_ID_SYNC => true,
            cia301::COB_ID_TIME => cob_id & TIME_EXISTS != 0,
            cia301::RPDO_1.. => self.is_valid(PdoCobId(cob_id)),
            _ => PdoCobId(cob_id).is_valid(),
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
        for other in (0..others).map(|at| at + 1).filter(|&other| other != sub) {
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

    /// CiA 301, 7.5.2.35 and 7.5.2.37: the communication parameter of a PDO.
    fn check_parameter(&mut self, direction: Direction, address: Address, new: u32) -> Result<(), AbortCode> {
        if self.behaviour().changes == ChangeRule::InPreOperational {
            self.require_pre_operational()?;
        }
        let index = address.index();
        let valid = self.is_in_use(index);
        match address.sub() {
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

    /// Whether the device has room for the PDO.
    pub(super) fn is_served(&self, index: u16) -> bool {
        self.services.rpdos.iter().any(|slot| slot.parameter_index() == index)
            || self.services.tpdos.iter().any(|slot| slot.parameter_index() == index)
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
        for at in 0..len.ok_or(AbortCode::PDO_LENGTH_EXCEEDED)? {
            let entry = objects::read_u32(self.od, index, at + 1).ok_or(AbortCode::PDO_LENGTH_EXCEEDED)?;
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

pub(super) fn require(condition: bool, code: AbortCode) -> Result<(), AbortCode> {
    if condition { Ok(()) } else { Err(code) }
}
