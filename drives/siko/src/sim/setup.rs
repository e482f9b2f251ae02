//! How a simulated drive is set up, and its non-volatile data.

use lexican_runtime::NodeId;
use lexican_runtime::device::Behaviour;
use simulator::Storage;

use super::address;
use super::eeprom::NonVolatile;
use super::inputs::Inputs;
use super::objects::fit;
use super::switches::DipSwitches;
use crate::model::{Addressing, Model};

/// The bit rates of 2100h by its value, in bit/s (7.12.2.31).
pub const BIT_RATES: [u32; 12] =
    [15_625, 20_000, 25_000, 40_000, 50_000, 62_500, 100_000, 125_000, 200_000, 250_000, 500_000, 1_000_000];

/// The configuration of one drive.
#[derive(Clone, Debug)]
pub struct Setup {
    /// Which drive it is.
    pub model: &'static Model,
    /// The DIP switches, and with them the node-ID, if the drive has any.
    pub switches: DipSwitches,
    /// The built-in gear (2102h).
    pub gear: u8,
    /// 1018h:04.
    pub serial_number: u32,
    /// 2500h, with one decimal digit in each four bits: day, month, year.
    pub production_date: u32,
    /// The surroundings of the drive.
    pub inputs: Inputs,
    /// The data kept from the last time that power was on; empty in a new drive.
    pub non_volatile: NonVolatile,
    /// How the drive deviates from CiA 301.
    pub behaviour: Behaviour,
}

impl Setup {
    /// A new drive with this node-ID.
    #[must_use]
    pub fn new(model: &'static Model, node: NodeId) -> Self {
        let mut non_volatile = NonVolatile::default();
        if model.addressing == Addressing::Object {
            non_volatile.eeprom.insert(address::NODE_ID, node.get().into());
        }
        Setup {
            model,
            switches: DipSwitches::for_node(node),
            gear: model.gear,
            serial_number: 1,
            production_date: 0x1507_2009,
            inputs: Inputs::default(),
            non_volatile,
            behaviour: model.behaviour,
        }
    }

    /// The node-ID after power-on.
    pub(super) fn node(&self) -> NodeId {
        let kept = || NodeId::new(*self.non_volatile.eeprom.get(&address::NODE_ID)? as u8);
        match self.model.addressing {
            Addressing::Switches => self.switches.node(),
            Addressing::Object => kept().unwrap_or(self.switches.node()),
        }
    }

    /// The dictionary after power-on: the defaults for `node`, overwritten by the EEPROM.
    pub(super) fn storage(&self, node: NodeId) -> Box<dyn Storage> {
        let mut storage = (self.model.storage)(node);
        for (&address, raw) in &self.non_volatile.eeprom {
            if let Ok(entry) = storage.entry(address) {
                let bytes = raw.to_le_bytes();
                // A value that the dictionary refuses comes from another firmware: the default stays.
                let _ = storage.write(&entry, 0, bytes.get(..usize::from(entry.capacity)).unwrap_or(&bytes), true);
            }
        }
        let faults = self.model.persistent.iter().filter(|kept| kept.index() == address::FAULT_COUNT.index());
        let faults = faults.filter(|fault| storage.raw(**fault).is_some_and(|code| code != 0)).count();
        storage.set_raw(address::FAULT_COUNT, faults as u64);
        if self.model.addressing == Addressing::Switches {
            storage.set_raw(address::NODE_ID, node.get().into());
        }
        for &(address, raw) in self.model.constants {
            storage.set_raw(address, raw);
        }
        storage.set_raw(address::SERIAL_NUMBER, self.serial_number.into());
        storage.set_raw(address::PRODUCTION_DATE, self.production_date.into());
        storage.set_raw(address::GEAR, self.gear.into());
        fit(self.model, &mut *storage);
        storage
    }
}
