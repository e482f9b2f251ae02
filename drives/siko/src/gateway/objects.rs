//! The dictionary of a gateway: some objects are read and written through the door, the others are its own.

use lexican_runtime::AbortCode;
use lexican_runtime::cia301;
use lexican_runtime::object::{Address, Entry, Layer};
use simulator::{Storage, signed};

use super::Door;

pub(super) const CONTROL_WORD: Address = Address::new(0x6040, 0x00);
pub(super) const STATUS_WORD: Address = Address::new(0x6041, 0x00);
pub(super) const SYSTEM_STATUS: Address = Address::new(0x1002, 0x00);
pub(super) const POSITION: Address = Address::new(0x6064, 0x00);
pub(super) const VELOCITY: Address = Address::new(0x606C, 0x00);
pub(super) const MODE: Address = Address::new(0x6060, 0x00);
pub(super) const TARGET_POSITION: Address = Address::new(0x607A, 0x00);
pub(super) const TARGET_VELOCITY: Address = Address::new(0x60FF, 0x00);
pub(super) const LATEST_FAULT: Address = Address::new(cia301::PREDEFINED_ERROR_FIELD, 0x01);

/// Objects of the communication profile area that a gateway does not have unless its door has them: they belong to the
/// drive, or concern a manager that is gone.
const NOT_OWN: &[u16] = &[
    cia301::PREDEFINED_ERROR_FIELD,
    0x100A,
    cia301::GUARD_TIME,
    cia301::LIFE_TIME_FACTOR,
    cia301::STORE_PARAMETERS,
    cia301::RESTORE_DEFAULT_PARAMETERS,
    cia301::CONSUMER_HEARTBEAT_TIME,
];

/// Where an object is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Place {
    Own,
    /// In the drive, behind the door.
    Door,
    /// Comes with the facts.
    Fact,
    Missing,
}

/// Where an object is kept. `target` is the object of the operating mode's target.
pub(super) fn place(door: &(impl Door + ?Sized), address: Address, target: Option<Address>) -> Place {
    match address {
        CONTROL_WORD => Place::Own,
        STATUS_WORD | SYSTEM_STATUS => Place::Fact,
        // The target of the other mode is kept here.
        TARGET_POSITION | TARGET_VELOCITY if target != Some(address) => Place::Own,
        _ if door.has(address) => Place::Door,
        TARGET_POSITION | TARGET_VELOCITY => Place::Own,
        _ if cia301::COMMUNICATION.contains(&address.index()) && !NOT_OWN.contains(&address.index()) => Place::Own,
        // The number of entries of a record.
        _ if address.sub() == 0 && (1..=u8::MAX).any(|sub| door.has(Address::new(address.index(), sub))) => Place::Own,
        _ => Place::Missing,
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Effect {
    /// A control word came.
    Control(u16),
    /// A control word came in a PDO whose target is out of range.
    ControlWithoutTarget(u16),
    /// An object behind the door is to be written.
    Write(Address, i64),
}

/// Storage and door, borrowed by the device for one call.
pub(super) struct Objects<'a, D: ?Sized> {
    pub(super) storage: &'a mut dyn Storage,
    pub(super) door: &'a D,
    /// The object of the operating mode's target.
    pub(super) target: Option<Address>,
    /// Whether an SDO request is being served.
    pub(super) by_sdo: bool,
    /// Why the door refused to read the requested object.
    pub(super) refusal: Option<AbortCode>,
    pub(super) effects: &'a mut Vec<Effect>,
}

impl<'a, D: Door + ?Sized> Layer for Objects<'a, D> {
    type Under = dyn Storage + 'a;

    fn under(&self) -> &Self::Under {
        self.storage
    }

    fn under_mut(&mut self) -> &mut Self::Under {
        self.storage
    }

    fn admits(&self, address: Address) -> Result<(), AbortCode> {
        match place(self.door, address, self.target) {
            Place::Missing => Err(AbortCode::NO_SUCH_OBJECT),
            Place::Own | Place::Door | Place::Fact => Ok(()),
        }
    }

    fn read_entry(&mut self, entry: &Entry, offset: u32, buffer: &mut [u8]) -> Result<usize, AbortCode> {
        self.refusal.filter(|_| self.by_sdo).map_or(Ok(()), Err)?;
        self.storage.read(entry, offset, buffer)
    }

    fn write_entry(&mut self, entry: &Entry, offset: u32, data: &[u8], last: bool) -> Result<(), AbortCode> {
        let address = entry.address;
        let before = self.storage.raw(address);
        self.storage.write(entry, offset, data, last)?;
        let raw = self.storage.raw(address).unwrap_or_default();
        if address == CONTROL_WORD {
            self.effects.push(Effect::Control(raw as u16));
        } else if self.by_sdo && place(self.door, address, self.target) == Place::Door {
            // The data sheet allows the value; the drive may still refuse it.
            self.storage.set_raw(address, before.unwrap_or_default());
            self.effects.push(Effect::Write(address, signed(entry.data_type, raw).unwrap_or_default()));
        }
        Ok(())
    }
}
