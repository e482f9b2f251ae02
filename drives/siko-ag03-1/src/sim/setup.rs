//! What a simulated drive is made of, and what it keeps without power.

use lexican_runtime::NodeId;
use lexican_runtime::device::{Behaviour, ChangeRule, ErrorControlRule};
use lexican_runtime::object::ObjectDictionary;
use lexican_runtime::service::sdo_server::SizesIndicated;
use lexican_runtime::service::tpdo::Triggers;
use lexican_runtime::wire::emcy::ErrorCode;

use super::eeprom::NonVolatile;
use super::inputs::Inputs;
use super::switches::DipSwitches;
use crate::od;

/// In what the AG03/1 deviates from CiA 301, or fills in what it leaves open.
pub const BEHAVIOUR: Behaviour = Behaviour {
    // On change and by event timer (1800h:02); "sent with transition to OPERATIONAL" (7.2.2.4).
    triggers_254: Triggers { start: true, change: true, timer: true, inhibit: true },
    // By event timer only; the inhibit time is for type 254.
    triggers_255: Triggers { start: false, change: false, timer: true, inhibit: false },
    type_0_at_every_sync: true,
    // 1400h:05 is a compatibility entry.
    rpdo_deadlines: false,
    changes: ChangeRule::InPreOperational,
    dummies: 0,
    empty_history_is_zero: true,
    // Table 20 has no code for what a device notices by itself on the bus.
    records_communication_errors: false,
    unreported: &[
        ErrorCode::LIFE_GUARD,
        ErrorCode::PDO_LENGTH,
        ErrorCode::PDO_TOO_LONG,
        ErrorCode::SYNC_LENGTH,
        ErrorCode::RPDO_TIMEOUT,
    ],
    error_control: ErrorControlRule::Exclusive,
    // Table 18 has 4Fh, 4Bh and 43h; the worked example of 7.2.8.1 answers four bytes with 42h.
    sdo_sizes_indicated: SizesIndicated { expedited: [true, true, true, false], longer: true },
    ..Behaviour::CIA_301
};

/// The bit rates of 2100h by its value, in bit/s (7.12.2.31).
pub const BIT_RATES: [u32; 12] =
    [15_625, 20_000, 25_000, 40_000, 50_000, 62_500, 100_000, 125_000, 200_000, 250_000, 500_000, 1_000_000];

/// The gear that is built in (2102h).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Gear {
    /// 24:1, up to 200 rev/min.
    #[default]
    Reduction24,
    /// 48:1, up to 100 rev/min.
    Reduction48,
}

/// What the drive is made of, and how it differs from others.
#[derive(Clone, Debug)]
pub struct Setup {
    /// The DIP switches, and with them the node-ID.
    pub switches: DipSwitches,
    /// The gear.
    pub gear: Gear,
    /// 1018h:04.
    pub serial_number: u32,
    /// 2500h, one decimal digit per four bits: day, month, year.
    pub production_date: u32,
    /// The world around the drive.
    pub inputs: Inputs,
    /// What is kept from the last time that power was on; nothing in a new drive.
    pub non_volatile: NonVolatile,
    /// How the drive deviates from CiA 301.
    pub behaviour: Behaviour,
}

impl Setup {
    /// A new drive with the 24:1 gear.
    #[must_use]
    pub fn new(node: NodeId) -> Self {
        Setup {
            switches: DipSwitches::for_node(node),
            gear: Gear::default(),
            serial_number: 1,
            production_date: 0x1507_2009,
            inputs: Inputs::default(),
            non_volatile: NonVolatile::default(),
            behaviour: BEHAVIOUR,
        }
    }

    /// The dictionary of `node` after power-on: defaults, and over them what the EEPROM has kept.
    pub(super) fn storage(&self, node: NodeId) -> od::Storage {
        let mut storage = od::storage(node);
        for (&address, raw) in &self.non_volatile.eeprom {
            if let Ok(entry) = storage.entry(address) {
                let bytes = raw.to_le_bytes();
                // A value that the dictionary does not take is that of another firmware: the default stays.
                let _ = storage.write(&entry, 0, bytes.get(..usize::from(entry.capacity)).unwrap_or(&bytes), true);
            }
        }
        let faults = od::PRE_DEFINED_ERROR_FIELD.iter().filter(|fault| storage.get(*fault).0 != 0).count();
        storage.set(od::PRE_DEFINED_ERROR_FIELD.len_object(), faults as u8);
        storage.set(od::NODE_ID, node.get());
        storage.set(od::MANUFACTURER_DEVICE_NAME, u32::from_le_bytes(*b"AG03"));
        storage.set(od::MANUFACTURER_SOFTWARE_VERSION, u32::from_le_bytes(*b"4.01"));
        storage.set(od::IDENTITY_OBJECT.serial_number(), self.serial_number);
        storage.set(od::PRODUCTION_DATE, self.production_date);
        storage.set(
            od::GEAR_REDUCTION,
            match self.gear {
                Gear::Reduction24 => od::GearReduction::GEAR_24_1,
                Gear::Reduction48 => od::GearReduction::GEAR_48_1,
            },
        );
        storage
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lexican_runtime::object::Address;

    #[test]
    fn what_the_dictionary_does_not_take_stays_at_its_default() {
        let node = NodeId::literal(5);
        let mut setup = Setup::new(node);
        setup.non_volatile.eeprom.insert(od::MOTOR_PARAMETER_SET.a_pos().address(), 200);
        setup.non_volatile.eeprom.insert(Address::new(0x5555, 0), 1);
        assert_eq!(setup.storage(node).get(od::MOTOR_PARAMETER_SET.a_pos()).0, 50);
    }
}
