//! What a simulated drive is made of, and what it keeps without power.

use std::collections::BTreeMap;
use std::fmt;
use std::str::FromStr;

use lexican_runtime::NodeId;
use lexican_runtime::device::{Behaviour, ChangeRule, ErrorControlRule};
use lexican_runtime::object::{Address, ObjectDictionary};
use lexican_runtime::service::tpdo::Triggers;
use lexican_runtime::wire::emcy::ErrorCode;

use super::inputs::Inputs;
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
    // The worked example of 7.2.8 answers 42h; table 18 has 43h, 4Bh and 4Fh.
    sdo_sizes_indicated: false,
    ..Behaviour::CIA_301
};

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
    /// The node-ID, as set by the DIP switches ([`Setup::node_of_switches`]).
    pub node: NodeId,
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
            node,
            gear: Gear::default(),
            serial_number: 1,
            production_date: 0x1507_2009,
            inputs: Inputs::default(),
            non_volatile: NonVolatile::default(),
            behaviour: BEHAVIOUR,
        }
    }

    /// The node-ID that the switches SW1 (bit 0) to SW7 (bit 6) set: all off means 1 (7.13).
    #[must_use]
    pub const fn node_of_switches(switches: u8) -> NodeId {
        match NodeId::new(switches & 0x7F) {
            Some(node) => node,
            None => NodeId::literal(1),
        }
    }

    /// The dictionary after power-on: defaults, and over them what the EEPROM has kept.
    pub(super) fn storage(&self) -> od::Storage {
        let mut storage = od::storage(self.node);
        for (&address, raw) in &self.non_volatile.eeprom {
            if let Ok(entry) = storage.entry(address) {
                let bytes = raw.to_le_bytes();
                // A value that the dictionary does not take is that of another firmware: the default stays.
                let _ = storage.write(&entry, 0, bytes.get(..usize::from(entry.capacity)).unwrap_or(&bytes), true);
            }
        }
        let faults = od::PRE_DEFINED_ERROR_FIELD.iter().filter(|fault| storage.get(*fault).0 != 0).count();
        storage.set(od::PRE_DEFINED_ERROR_FIELD.len_object(), faults as u8);
        storage.set(od::NODE_ID, self.node.get());
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

/// What survives without power: the EEPROM, and the absolute encoder with its battery.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct NonVolatile {
    /// The persistent entries, in wire form.
    pub eeprom: BTreeMap<Address, u64>,
    /// The position as 6064h shows it.
    pub position: i32,
}

/// One line for the position and one for each entry: `position -5000`, `2410:01 0x64`.
impl fmt::Display for NonVolatile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "position {}", self.position)?;
        self.eeprom.iter().try_for_each(|(address, raw)| writeln!(f, "{address} {raw:#x}"))
    }
}

/// Empty lines do not matter, nor does their order.
impl FromStr for NonVolatile {
    type Err = NotNonVolatile;

    fn from_str(text: &str) -> Result<Self, NotNonVolatile> {
        let mut kept = NonVolatile::default();
        for (line, words) in (1..).zip(text.lines().map(str::trim)).filter(|(_, words)| !words.is_empty()) {
            kept.take(words).ok_or(NotNonVolatile { line })?;
        }
        Ok(kept)
    }
}

impl NonVolatile {
    fn take(&mut self, line: &str) -> Option<()> {
        let (name, value) = line.split_once(char::is_whitespace)?;
        let value = value.trim();
        if name == "position" {
            self.position = value.parse().ok()?;
            return Some(());
        }
        let (index, sub) = name.split_once(':')?;
        let address = Address::new(u16::from_str_radix(index, 16).ok()?, u8::from_str_radix(sub, 16).ok()?);
        self.eeprom.insert(address, u64::from_str_radix(value.strip_prefix("0x")?, 16).ok()?);
        Some(())
    }
}

/// A line is neither the position nor an entry.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {line} is neither `position -5000` nor an entry such as `2410:01 0x64`")]
pub struct NotNonVolatile {
    /// Which line, counted from 1.
    pub line: u32,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_kept_reads_back_as_written() {
        let kept = NonVolatile { eeprom: BTreeMap::from([(Address::new(0x2410, 0x0A), 101)]), position: -5000 };
        assert_eq!(kept.to_string(), "position -5000\n2410:0A 0x65\n");
        assert_eq!(kept.to_string().parse(), Ok(kept));
        assert_eq!("".parse(), Ok(NonVolatile::default()));
    }

    #[test]
    fn a_line_that_is_none_is_named() {
        for text in ["\nposition x", "\n2410 0x1", "\n2410:01 1", "\nposition"] {
            assert_eq!(text.parse::<NonVolatile>(), Err(NotNonVolatile { line: 2 }), "{text:?}");
        }
    }

    #[test]
    fn what_the_dictionary_does_not_take_stays_at_its_default() {
        let mut setup = Setup::new(NodeId::literal(5));
        setup.non_volatile.eeprom.insert(od::MOTOR_PARAMETER_SET.a_pos().address(), 200);
        setup.non_volatile.eeprom.insert(Address::new(0x5555, 0), 1);
        assert_eq!(setup.storage().get(od::MOTOR_PARAMETER_SET.a_pos()).0, 50);
    }
}
