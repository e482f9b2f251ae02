//! Objects of CiA 301 and CiA 402-2: their kinds, data types, and the meanings of their numbers.

use crate::model::{Device, ObjectKind};
use crate::types::DataType;
use lexican_cia::cia301;
use lexican_cia::cia402::Mode;

/// An object of a standard.
#[derive(Clone, Copy, Debug)]
pub struct Standard {
    /// `CiA 301`.
    pub source: &'static str,
    /// VAR, ARRAY or RECORD.
    pub kind: ObjectKind,
    /// Whether both ARRAY and RECORD are common for this object.
    pub loose: bool,
    /// The meaning of its numbers; for an array, of its elements.
    pub meaning: Option<&'static Meaning>,
    types: Types,
}

/// The meaning of an object's numbers.
#[derive(Debug)]
pub struct Meaning {
    /// The name of the type in generated code.
    pub name: &'static str,
    /// One sentence.
    pub description: &'static str,
    /// The named values or bits.
    pub numbers: Numbers,
}

/// Names of values or bits.
#[derive(Clone, Copy, Debug)]
pub enum Numbers {
    /// Values and their names.
    Values(&'static [(i128, &'static str)]),
    /// Bits: the lowest, the highest, the name.
    Bits(&'static [(u8, u8, &'static str)]),
}

#[derive(Clone, Copy, Debug)]
enum Types {
    /// For the single value, or for all entries but sub-index 0.
    All(DataType),
    /// For each sub-index, from 1 on.
    Each(&'static [Option<DataType>]),
}

impl Standard {
    /// The data type of a sub-index, if the standard fixes it.
    #[must_use]
    pub fn data_type(&self, sub: u8) -> Option<DataType> {
        match (self.kind.has_subs(), sub, self.types) {
            (true, 0, _) => Some(DataType::Unsigned8),
            (true, 0xFF, _) => None,
            (_, _, Types::All(data_type)) => Some(data_type),
            (_, sub, Types::Each(types)) => types.get(usize::from(sub) - 1).copied().flatten(),
        }
    }
}

/// The object with this index in CiA 301, or in CiA 402 if that is the profile.
#[must_use]
pub fn object(index: u16, profile: Option<u16>) -> Option<Standard> {
    match index {
        0x1000..=0x1FFF => communication(index),
        0x6000..=0x9FFF if profile == Some(402) => cia402(0x6000 + (index - 0x6000) % 0x800),
        _ => None,
    }
}

/// The effect of writing an entry that is more than a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Role {
    /// A target or an output that takes effect immediately: a target position, a digital output.
    SetPoint,
    /// A command: store, restore, program, change a state.
    Command,
}

/// The role of an entry by CiA 301, 302, 401 and 402; `None` if it is a parameter.
///
/// A device whose 1000h names no profile is a drive of CiA 402 if it has 6040h, 6041h and 6060h.
#[must_use]
pub fn role(device: &Device, index: u16, sub: u8) -> Option<Role> {
    use cia301::*;
    let has = |index| device.object(index).is_some();
    let is_drive = device.profile == Some(402) || [0x6040, 0x6041, 0x6060].into_iter().all(has);
    match (index, sub) {
        (HIGH_RESOLUTION_TIME_STAMP, _) => Some(Role::SetPoint),
        (PREDEFINED_ERROR_FIELD | STORE_PARAMETERS | RESTORE_DEFAULT_PARAMETERS, _) => Some(Role::Command),
        (OS_COMMAND..=OS_PROMPT, _) => Some(Role::Command),
        // CiA 302: configure slaves, download and start programs, request NMT and node guarding.
        (0x1F25 | 0x1F50 | 0x1F51 | 0x1F82 | 0x1F83, _) => Some(Role::Command),
        // The control word, for CiA 408 as well.
        (0x6040, _) if has(0x6041) => Some(Role::Command),
        // Axes are 800h apart.
        (0x6000..=0x9FFF, sub) if is_drive => match (0x6000 + (index - 0x6000) % 0x800, sub) {
            (0x6040, _) => Some(Role::Command),
            // Clears the buffer of interpolated positions.
            (0x60C4, 6) => Some(Role::Command),
            // vl: target velocity and percentage; target torque and position, offsets, touch probes, interpolated
            // positions.
            (0x6042 | 0x6052 | 0x6071 | 0x607A | 0x60B0..=0x60B2 | 0x60B8 | 0x60C1, _) => Some(Role::SetPoint),
            // Outputs, but not their mask (60FEh:02); pv: target velocity.
            (0x60FE, 0 | 1) | (0x60FF, _) => Some(Role::SetPoint),
            _ => None,
        },
        // CiA 401: digital outputs in groups of 8, 1, 16 and 32, and analogue ones.
        (0x6200 | 0x6220 | 0x6300 | 0x6320 | 0x6410..=0x6414, _) if device.profile == Some(401) => Some(Role::SetPoint),
        _ => None,
    }
}

/// Whether an entry holds a code, an identifier, a signature or bits, which the standards write in hexadecimal.
#[must_use]
pub fn is_hex(index: u16, sub: u8) -> bool {
    use cia301::*;
    match (index, sub) {
        (DEVICE_TYPE..=MANUFACTURER_STATUS_REGISTER | COB_ID_SYNC | COB_ID_TIME | COB_ID_EMCY | 0x603F, 0) => true,
        (
            PREDEFINED_ERROR_FIELD | STORE_PARAMETERS | RESTORE_DEFAULT_PARAMETERS | IDENTITY | EMERGENCY_CONSUMER,
            1..,
        ) => true,
        (SDO_SERVER_1..=SDO_CLIENT_128, 1 | 2) => true,
        _ => (is_pdo_communication(index) && sub == 1) || (is_pdo_mapping(index) && sub > 0),
    }
}

/// Objects of CiA 301, 7.5.2.
fn communication(index: u16) -> Option<Standard> {
    use DataType as D;
    use cia301::*;
    // Sub-index 4 is reserved.
    const PDO: &[Option<DataType>] =
        &[Some(D::Unsigned32), Some(D::Unsigned8), Some(D::Unsigned16), None, Some(D::Unsigned16), Some(D::Unsigned8)];
    const SDO: &[Option<DataType>] = &[Some(D::Unsigned32), Some(D::Unsigned32), Some(D::Unsigned8)];
    const COMMAND: &[Option<DataType>] = &[Some(D::OctetString), Some(D::Unsigned8), Some(D::OctetString)];
    let (kind, types) = match index {
        DEVICE_TYPE | MANUFACTURER_STATUS_REGISTER => variable(D::Unsigned32),
        COB_ID_SYNC | COMMUNICATION_CYCLE_PERIOD | SYNCHRONOUS_WINDOW_LENGTH => variable(D::Unsigned32),
        COB_ID_TIME | HIGH_RESOLUTION_TIME_STAMP | COB_ID_EMCY => variable(D::Unsigned32),
        ERROR_REGISTER | LIFE_TIME_FACTOR | SYNCHRONOUS_COUNTER_OVERFLOW | OS_COMMAND_MODE => variable(D::Unsigned8),
        MANUFACTURER_DEVICE_NAME..=MANUFACTURER_SOFTWARE_VERSION => variable(D::VisibleString),
        GUARD_TIME | INHIBIT_TIME_EMCY | PRODUCER_HEARTBEAT_TIME => variable(D::Unsigned16),
        PREDEFINED_ERROR_FIELD | STORE_PARAMETERS | RESTORE_DEFAULT_PARAMETERS => array(D::Unsigned32),
        CONSUMER_HEARTBEAT_TIME | VERIFY_CONFIGURATION | EMERGENCY_CONSUMER => array(D::Unsigned32),
        OS_PROMPT | ERROR_BEHAVIOUR => array(D::Unsigned8),
        MODULE_LIST => array(D::Unsigned16),
        IDENTITY => (ObjectKind::Record, Types::All(D::Unsigned32)),
        OS_COMMAND | OS_DEBUGGER_INTERFACE => (ObjectKind::Record, Types::Each(COMMAND)),
        SDO_SERVER_1..=SDO_CLIENT_128 => (ObjectKind::Record, Types::Each(SDO)),
        _ if is_pdo_communication(index) => (ObjectKind::Record, Types::Each(PDO)),
        _ if is_pdo_mapping(index) => (ObjectKind::Record, Types::All(D::Unsigned32)),
        _ => return None,
    };
    // Mappings are lists of equal numbers, and many data sheets make them arrays.
    Some(Standard { source: "CiA 301", kind, loose: is_pdo_mapping(index), meaning: meaning(index), types })
}

/// Objects of CiA 402-2, by the index for the first axis.
fn cia402(index: u16) -> Option<Standard> {
    use DataType as D;
    const RAMP: &[Option<DataType>] = &[Some(D::Unsigned32), Some(D::Unsigned16)];
    const INTERPOLATION_TIME: &[Option<DataType>] = &[Some(D::Unsigned8), Some(D::Integer8)];
    let (kind, types) = match index {
        0x603F..=0x6041 => variable(D::Unsigned16),
        0x6066 | 0x6068 | 0x606D..=0x6070 | 0x6072 | 0x6073 => variable(D::Unsigned16),
        0x6007 | 0x6042..=0x6044 | 0x605A..=0x605E | 0x606A => variable(D::Integer16),
        0x6071 | 0x6074 | 0x6077 | 0x6078 | 0x6086 | 0x6088 => variable(D::Integer16),
        0x6060 | 0x6061 | 0x6098 => variable(D::Integer8),
        0x607E => variable(D::Unsigned8),
        0x6062..=0x6064 | 0x6069 | 0x606B | 0x606C | 0x607A | 0x607C => variable(D::Integer32),
        0x60F4 | 0x60FA | 0x60FC | 0x60FF => variable(D::Integer32),
        0x6065 | 0x6067 | 0x6075 | 0x6076 | 0x6079 | 0x607F..=0x6085 | 0x6087 => variable(D::Unsigned32),
        0x609A | 0x60C5 | 0x60C6 | 0x60FD | 0x6502 => variable(D::Unsigned32),
        0x607B | 0x607D => array(D::Integer32),
        0x6046 | 0x608F | 0x6090 | 0x6091 | 0x6092 | 0x6099 | 0x60FE => array(D::Unsigned32),
        0x6048..=0x604A => (ObjectKind::Record, Types::Each(RAMP)),
        0x60C2 => (ObjectKind::Record, Types::Each(INTERPOLATION_TIME)),
        0x6504 | 0x6505 => variable(D::VisibleString),
        _ => return None,
    };
    Some(Standard { source: "CiA 402", kind, loose: true, meaning: meaning(index), types })
}

fn variable(data_type: DataType) -> (ObjectKind, Types) {
    (ObjectKind::Variable, Types::All(data_type))
}

fn array(data_type: DataType) -> (ObjectKind, Types) {
    (ObjectKind::Array, Types::All(data_type))
}

/// The meaning of an object's numbers; for CiA 402, by the index for the first axis.
fn meaning(index: u16) -> Option<&'static Meaning> {
    MEANINGS.iter().find(|(indices, _)| indices.contains(&index)).map(|(_, meaning)| meaning)
}

/// The values of option codes, from `first` to `last`.
const fn stops(first: usize, last: usize) -> &'static [(i128, &'static str)] {
    const STOPS: &[(i128, &str)] = &[
        (0, "disable drive function"),
        (1, "slow down ramp"),
        (2, "quick stop ramp"),
        (3, "current limit"),
        (4, "voltage limit"),
        (5, "slow down ramp and stay"),
        (6, "quick stop ramp and stay"),
        (7, "current limit and stay"),
        (8, "voltage limit and stay"),
    ];
    STOPS.split_at(last + 1).0.split_at(first).1
}

/// One row each: indices, name, description, names of values or bits.
macro_rules! meanings {
    ($([$($index:expr),*] $name:literal, $description:literal, $kind:ident $numbers:expr;)*) => {
        const MEANINGS: &[(&[u16], Meaning)] = &[$((
            &[$($index),*],
            Meaning { name: $name, description: $description, numbers: Numbers::$kind($numbers) },
        )),*];
    };
}

meanings! {
    [cia301::ERROR_REGISTER] "Error register", "Which kinds of error are present (CiA 301, 7.5.2.2).",
        Bits &[
            (0, 0, "generic error"), (1, 1, "current"), (2, 2, "voltage"), (3, 3, "temperature"), (4, 4, "communication error"),
            (5, 5, "device profile specific"), (7, 7, "manufacturer specific"),
        ];
    [cia301::ERROR_BEHAVIOUR] "Error behaviour", "Which NMT state a device goes to by itself in an error (CiA 301).",
        Values &[(0, "pre-operational"), (1, "no change"), (2, "stopped")];
    [0x6040] "Controlword", "Commands to the drive (CiA 402).",
        Bits &[
            (0, 0, "switch on"), (1, 1, "enable voltage"), (2, 2, "quick stop"), (3, 3, "enable operation"),
            (4, 6, "operation mode specific"), (7, 7, "fault reset"), (8, 8, "halt"), (9, 9, "operation mode specific 9"),
            (11, 15, "manufacturer specific"),
        ];
    [0x6041] "Statusword", "The state of the drive (CiA 402).",
        Bits &[
            (0, 0, "ready to switch on"), (1, 1, "switched on"), (2, 2, "operation enabled"), (3, 3, "fault"),
            (4, 4, "voltage enabled"), (5, 5, "quick stop"), (6, 6, "switch on disabled"), (7, 7, "warning"),
            (8, 8, "manufacturer specific"), (9, 9, "remote"), (10, 10, "target reached"), (11, 11, "internal limit active"),
            (12, 13, "operation mode specific"), (14, 15, "manufacturer specific 14"),
        ];
    [0x6060, 0x6061] "Mode of operation", "What the drive controls; negative values are the manufacturer's (CiA 402).",
        Values Mode::VALUES;
    [0x605A] "Quick stop option", "How the drive stops in a quick stop, and where it stays (CiA 402).",
        Values stops(0, 8);
    [0x605B] "Shutdown option", "What the drive does when operation enabled is left for ready to switch on (CiA 402).",
        Values stops(0, 1);
    [0x605C] "Disable operation option", "What the drive does when operation enabled is left for switched on (CiA 402).",
        Values stops(0, 1);
    [0x605D] "Halt option", "How the drive stops for bit 8 of the control word (CiA 402).",
        Values stops(1, 4);
    [0x605E] "Fault reaction option", "How the drive stops for a fault (CiA 402).",
        Values stops(0, 4);
    [0x6502] "Supported drive modes", "Which modes of operation the drive has (CiA 402).",
        Bits Mode::SUPPORTED;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn data_types_are_those_of_the_standards() {
        let check = |index: u16, sub: u8, data_type: Option<DataType>| {
            let found = object(index, Some(402)).and_then(|standard| standard.data_type(sub));
            assert_eq!(found, data_type, "{index:04X}:{sub:02X}");
        };
        check(0x1000, 0, Some(DataType::Unsigned32));
        check(0x1018, 0, Some(DataType::Unsigned8));
        check(0x1018, 4, Some(DataType::Unsigned32));
        check(0x1800, 3, Some(DataType::Unsigned16));
        check(0x1800, 4, None);
        check(0x1800, 9, None);
        check(0x1A00, 64, Some(DataType::Unsigned32));
        check(0x6060, 0, Some(DataType::Integer8));
        check(0x6860, 0, Some(DataType::Integer8));
        check(0x6048, 2, Some(DataType::Unsigned16));
        check(0x2000, 0, None);
    }
}
