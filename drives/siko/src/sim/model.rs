//! A SIKO drive as data: what the simulator has to know of it.

use std::fmt;

use lexican_driver::description::EmergencySwitch;
use lexican_driver::{Code, Parameter};
use lexican_runtime::device::Behaviour;
use lexican_runtime::host::kept::KeptFormat;
use lexican_runtime::object::{
    Address, ConditionalLimit, DataType, Dictionary, Object, ObjectDictionary, Rw, Value, WritableIn,
};
use lexican_runtime::{Duration, NodeId};

use crate::fault::{Fault, FaultKind};

/// A drive of the family. Objects have the same indices and types in all of its drives, so what a drive has is what
/// its dictionary has: without 2418h the loop has the length of [`Model::loop_length`], without 2421h there is no
/// torque deactivation, and so on. Everything else is here.
#[derive(Clone, Copy, Debug)]
pub struct Model {
    /// What messages call it: `AG03/1`.
    pub name: &'static str,
    /// The first line of the file of its EEPROM.
    pub eeprom: KeptFormat,
    /// The dictionary with the defaults of the data sheet for a node-ID.
    pub storage: fn(NodeId) -> Box<dyn Storage>,
    /// The entries that the EEPROM keeps.
    pub persistent: &'static [Address],
    /// In which NMT states entries may be written, where not in all of them.
    pub writable_in: &'static [WritableIn],
    /// Limits that depend on other entries, such as the gear.
    pub ranges: &'static [ConditionalLimit],
    /// What 1011h restores.
    pub parameters: &'static [Parameter],
    /// What the firmware says of itself: name, version, date.
    pub constants: &'static [(Address, u64)],
    /// The gear of a new drive, as 2102h has it.
    pub gear: u8,
    /// In what it deviates from CiA 301, or fills in what that leaves open.
    pub behaviour: Behaviour,
    /// Its faults; what is not among them does not make it fail.
    pub faults: &'static [Fault],
    /// What it reports besides its faults.
    pub notices: &'static [Code],
    /// How long the motor current may be too high.
    pub overcurrent_for: Duration,
    /// The bit of 1014h without which no EMCY is sent, if it is not the one of CiA 301.
    pub emergencies: Option<EmergencySwitch>,
    /// Whether control words come by SDO, too, and not by PDO only.
    pub control_by_sdo: bool,
    /// Whether 23h is the only SDO command that writes, with four bytes for an object of any size.
    pub writes_four_bytes: bool,
    /// Where the node-ID comes from.
    pub addressing: Addressing,
    /// Whether there is an input without which the motor gets no torque: bit 10 of 1002h shows its absence.
    pub enable_input: bool,
    /// Whether there are two limit switches and one for calibration: bits 0 to 2 of 1002h show them.
    pub switches: bool,
    /// The length of a loop in increments, where no object has it.
    pub loop_length: u16,
}

/// Where the node-ID comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Addressing {
    /// From DIP switches, which are read when the supply is switched on.
    Switches,
    /// From 2101h, which is read at every initialisation.
    Object,
}

impl Model {
    /// The fault of a kind, if the drive has it.
    #[must_use]
    pub fn fault(&self, kind: FaultKind) -> Option<Fault> {
        self.faults.iter().find(|fault| fault.kind == kind).copied()
    }
}

/// Where the values of a drive's objects are: a generated dictionary of any size.
pub trait Storage: ObjectDictionary + fmt::Debug + Send {
    /// The number at `address` in wire form; none where there is no number.
    fn raw(&self, address: Address) -> Option<u64>;

    /// Sets a number in wire form, unheld by access and limits; does nothing where there is none.
    fn set_raw(&mut self, address: Address, raw: u64);

    /// The same values once more.
    fn duplicate(&self) -> Box<dyn Storage>;
}

impl<const N: usize> Storage for Dictionary<N> {
    fn raw(&self, address: Address) -> Option<u64> {
        fn get<T: Value, const N: usize>(from: &Dictionary<N>, address: Address) -> u64 {
            from.get(Object::<T, Rw>::new(address.index(), address.sub())).to_raw()
        }
        match self.table().entry(address).ok()?.data_type.size()? {
            1 => Some(get::<u8, N>(self, address)),
            2 => Some(get::<u16, N>(self, address)),
            4 => Some(get::<u32, N>(self, address)),
            8 => Some(get::<u64, N>(self, address)),
            _ => None,
        }
    }

    fn set_raw(&mut self, address: Address, raw: u64) {
        fn set<T: Value, const N: usize>(to: &mut Dictionary<N>, address: Address, raw: u64) {
            to.set(Object::<T, Rw>::new(address.index(), address.sub()), T::from_raw(raw));
        }
        match self.table().entry(address).ok().and_then(|entry| entry.data_type.size()) {
            Some(1) => set::<u8, N>(self, address, raw),
            Some(2) => set::<u16, N>(self, address, raw),
            Some(4) => set::<u32, N>(self, address, raw),
            Some(8) => set::<u64, N>(self, address, raw),
            _ => {}
        }
    }

    fn duplicate(&self) -> Box<dyn Storage> {
        Box::new(self.clone())
    }
}

impl Clone for Box<dyn Storage> {
    fn clone(&self) -> Self {
        self.duplicate()
    }
}

impl dyn Storage + '_ {
    /// The number at `address`; none where there is none.
    #[must_use]
    pub fn number(&self, address: Address) -> Option<i64> {
        signed(self.entry(address).ok()?.data_type, self.raw(address)?)
    }

    /// The value of an object; zero where there is none.
    #[must_use]
    pub fn get<T: Value, A, M>(&self, object: Object<T, A, M>) -> T {
        T::from_raw(self.raw(object.address()).unwrap_or_default())
    }
}

/// What a number in wire form means; none where the type has no fixed size.
pub(super) fn signed(data_type: DataType, raw: u64) -> Option<i64> {
    let unused_bits = 64 - u32::from(data_type.bits()?);
    let high = raw << unused_bits;
    Some(if data_type.is_signed() { (high as i64) >> unused_bits } else { (high >> unused_bits) as i64 })
}
