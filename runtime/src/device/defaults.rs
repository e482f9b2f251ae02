//! What the dictionary asks for and the device cannot serve. A write would have been refused; a default was not
//! asked.

use core::fmt;

use super::checked::{Checked, require, type_exists};
use super::configure::pdo_exists;
use super::identifiers::{self, SYNC_GENERATED, TIME_EXISTS, TIME_PRODUCED, identifier};
use super::{Device, Misconfigured, Selection};
use crate::abort::AbortCode;
use crate::cia301;
use crate::object::{Address, Direction, Mapped, ObjectDictionary};
use crate::service::mapping;
use crate::service::objects;
use crate::wire::pdo::PdoCobId;

impl<
    const RPDOS: usize,
    const TPDOS: usize,
    const SERVERS: usize,
    const MONITORED: usize,
    const MAPPED: usize,
    S: Selection,
> Device<RPDOS, TPDOS, SERVERS, MONITORED, MAPPED, S>
{
    /// What the dictionary holds after [`Device::restart`] and the device does not serve, or not as it is
    /// written: services that its [`Selection`] leaves out, PDOs, servers and heartbeats beyond the room there is, mappings that cannot be, identifiers that
    /// are restricted (no service has them) or that two services have (SYNC and TIME go before SDO, and SDO before
    /// RPDOs). Defaults of a data sheet are not checked when they are loaded, as a manager's writes are.
    pub fn misconfigured<'a>(
        &'a self,
        od: &'a mut (impl ObjectDictionary + ?Sized),
    ) -> impl Iterator<Item = Misconfigured> + 'a {
        let checked = self.services.get().checked(od, SERVERS);
        Defaults { checked, next: Address::new(cia301::COMMUNICATION.start, 0) }
    }
}

/// The defaults that cannot be served, ascending by address.
struct Defaults<
    'a,
    O: ?Sized,
    const RPDOS: usize,
    const TPDOS: usize,
    const MONITORED: usize,
    const MAPPED: usize,
    S: Selection,
> {
    checked: Checked<'a, O, RPDOS, TPDOS, MONITORED, MAPPED, S>,
    next: Address,
}

impl<
    O: ObjectDictionary + ?Sized,
    const RPDOS: usize,
    const TPDOS: usize,
    const MONITORED: usize,
    const MAPPED: usize,
    S: Selection,
> Iterator for Defaults<'_, O, RPDOS, TPDOS, MONITORED, MAPPED, S>
{
    type Item = Misconfigured;

    fn next(&mut self) -> Option<Misconfigured> {
        while self.next.index() < cia301::COMMUNICATION.end {
            let address = self.next;
            let object_exists = self.checked.od.entry(address) != Err(AbortCode::NO_SUCH_OBJECT);
            self.next = match address.sub().checked_add(1) {
                Some(sub) if object_exists => Address::new(address.index(), sub),
                _ => Address::new(address.index() + 1, 0),
            };
            if let Err(reason) = self.checked.check_default(address) {
                return Some(Misconfigured { address, reason });
            }
        }
        None
    }
}

/// `1A00:01: 0604 0041: object cannot be mapped to the PDO`.
impl fmt::Display for Misconfigured {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.address, self.reason)
    }
}

impl<
    O: ObjectDictionary + ?Sized,
    const RPDOS: usize,
    const TPDOS: usize,
    const MONITORED: usize,
    const MAPPED: usize,
    S: Selection,
> Checked<'_, O, RPDOS, TPDOS, MONITORED, MAPPED, S>
{
    /// Whether the device can serve what a parameter holds. What is not in the dictionary asks for nothing.
    fn check_default(&mut self, address: Address) -> Result<(), AbortCode> {
        let Some(value) = objects::read_at(self.od, address) else { return Ok(()) };
        let value = u32::try_from(value).unwrap_or(u32::MAX);
        let (index, sub) = (address.index(), address.sub());
        self.check_selection(index, value)?;
        match index {
            cia301::COB_ID_SYNC | cia301::COB_ID_TIME | cia301::COB_ID_EMCY if sub == 0 => {
                self.check_default_message(address, value)
            }
            cia301::CONSUMER_HEARTBEAT_TIME | cia301::ERROR_BEHAVIOUR if sub > 0 => self.check(address, value),
            cia301::PRODUCER_HEARTBEAT_TIME if sub == 0 => self.check(address, value),
            cia301::SYNCHRONOUS_COUNTER_OVERFLOW if sub == 0 => {
                require(matches!(value, 0 | 2..=240), AbortCode::INVALID_VALUE)
            }
            cia301::SDO_SERVER_1 if matches!(sub, 1 | 2) => self.check_default_sdo(sub, value),
            cia301::SDO_SERVER_2..=cia301::SDO_SERVER_128 if matches!(sub, 1 | 2) => {
                self.check_default_server(address, value)
            }
            cia301::RPDO_1..=cia301::RPDO_512 => self.check_default_parameter(Direction::Receive, address, value),
            cia301::TPDO_1..=cia301::TPDO_512 => self.check_default_parameter(Direction::Transmit, address, value),
            cia301::RPDO_MAPPING_1..=cia301::RPDO_MAPPING_512 if sub == 0 => self.check_default_length(index, value),
            cia301::TPDO_MAPPING_1..=cia301::TPDO_MAPPING_512 if sub == 0 => self.check_default_length(index, value),
            cia301::RPDO_MAPPING_1..=cia301::RPDO_MAPPING_512 => {
                self.check_default_entry(Direction::Receive, address, value)
            }
            cia301::TPDO_MAPPING_1..=cia301::TPDO_MAPPING_512 => {
                self.check_default_entry(Direction::Transmit, address, value)
            }
            _ => Ok(()),
        }
    }

    fn check_default_message(&mut self, address: Address, value: u32) -> Result<(), AbortCode> {
        let exists = match address.index() {
            cia301::COB_ID_SYNC => true,
            cia301::COB_ID_TIME => value & TIME_EXISTS != 0,
            _ => PdoCobId(value).is_valid(),
        };
        let can_generate = self.od.entry(Address::new(cia301::COMMUNICATION_CYCLE_PERIOD, 0)).is_ok();
        let generates = address.index() == cia301::COB_ID_SYNC && value & SYNC_GENERATED != 0;
        require(!generates || can_generate, AbortCode::INVALID_VALUE)?;
        let produces_time = address.index() == cia301::COB_ID_TIME && value & TIME_PRODUCED != 0;
        require(!produces_time || self.behaviour().produces_time, AbortCode::INVALID_VALUE)?;
        if exists { self.check_default_identifier(address, value) } else { Ok(()) }
    }

    fn check_default_identifier(&mut self, address: Address, value: u32) -> Result<(), AbortCode> {
        let id = identifier(value).ok_or(AbortCode::INVALID_VALUE)?;
        require(!self.is_taken(id, address), AbortCode::PARAMETER_INCOMPATIBLE)
    }

    fn check_default_server(&mut self, address: Address, value: u32) -> Result<(), AbortCode> {
        if !PdoCobId(value).is_valid() {
            return Ok(());
        }
        self.check_default_identifier(address, value)?;
        let served = identifiers::sdo_count(cia301::SDO_SERVER_2..address.index(), self.od) + 1 < self.server_room;
        let exists = identifiers::sdo(address.index(), self.od).is_some();
        require(address.sub() != 1 || !exists || served, AbortCode::DEVICE_INCOMPATIBLE)
    }

    fn check_default_parameter(&mut self, direction: Direction, address: Address, value: u32) -> Result<(), AbortCode> {
        let number = cia301::pdo_number(address.index());
        match address.sub() {
            1 if self.is_valid(PdoCobId(value)) && pdo_exists(direction, number, self.od) => {
                self.check_default_identifier(address, value)?;
                require(self.is_served(address.index()), AbortCode::DEVICE_INCOMPATIBLE)
            }
            2 => require(type_exists(direction, value), AbortCode::INVALID_VALUE),
            6 if direction == Direction::Transmit => require(value <= 240, AbortCode::INVALID_VALUE),
            _ => Ok(()),
        }
    }

    /// Only the length: entries that cannot be mapped are findings of their own.
    fn check_default_length(&mut self, index: u16, len: u32) -> Result<(), AbortCode> {
        let len = u8::try_from(len).ok().filter(|&len| usize::from(len) <= MAPPED);
        let mut bits = 0;
        for sub in 1..=len.ok_or(AbortCode::PDO_LENGTH_EXCEEDED)? {
            let entry = objects::read_u32(self.od, index, sub).ok_or(AbortCode::PDO_LENGTH_EXCEEDED)?;
            bits = mapping::bits_with(bits, Mapped::from_parameter(entry)).ok_or(AbortCode::PDO_LENGTH_EXCEEDED)?;
        }
        Ok(())
    }

    fn check_default_entry(&mut self, direction: Direction, address: Address, value: u32) -> Result<(), AbortCode> {
        let counts = u32::from(address.sub()) <= self.current(address.index(), 0);
        let mapped = Mapped::from_parameter(value);
        if counts { mapping::check(mapped, direction, self.behaviour().dummies, self.od) } else { Ok(()) }
    }
}
