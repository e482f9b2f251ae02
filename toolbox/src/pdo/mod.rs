//! The PDOs of a device: their configuration ([`PdoState`]), changes to it ([`Plan`]), and both as text.
//!
//! This module does no I/O: values are read through a function, and to be written as
//! [`Settings`](lexican_runtime::host::Settings).

pub mod dbc;
mod plan;
mod words;

use std::collections::BTreeSet;
use std::fmt;
use std::str::FromStr;

use lexican_eds::model::{Device, Value};
use lexican_runtime::cia301::{self, TO_MAPPING};
use lexican_runtime::object::{Address, Direction, Mapped};
use lexican_runtime::wire::pdo::{PdoCobId, TransmissionType};
use lexican_runtime::{CobId, NodeId};

use crate::values::{given, resolved};

pub use plan::{Change, Objection, Plan};
pub(crate) use words::manner;
pub use words::{in_words, summary, title};

/// After this many missing PDOs in a row, a device is assumed to have no more.
const GAP: u16 = 8;

/// A PDO of a device: `TPDO1`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PdoName {
    /// The direction, as the device sees it.
    pub direction: Direction,
    /// 1 to 512.
    pub number: u16,
}

/// The text names no PDO.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0:?} is no PDO such as tpdo1 or rpdo3")]
pub struct NoPdoName(String);

impl FromStr for PdoName {
    type Err = NoPdoName;

    fn from_str(text: &str) -> Result<Self, NoPdoName> {
        let lower = text.to_ascii_lowercase();
        let (direction, number) = match (lower.strip_prefix("tpdo"), lower.strip_prefix("rpdo")) {
            (Some(number), _) => (Direction::Transmit, number),
            (_, Some(number)) => (Direction::Receive, number),
            _ => return Err(NoPdoName(text.to_owned())),
        };
        let number = number.trim_start().parse().ok().filter(|number| (1..=512).contains(number));
        Ok(PdoName { direction, number: number.ok_or_else(|| NoPdoName(text.to_owned()))? })
    }
}

impl fmt::Display for PdoName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}PDO{}", if self.direction == Direction::Receive { 'R' } else { 'T' }, self.number)
    }
}

impl PdoName {
    /// The address of an entry in its communication parameter.
    #[must_use]
    pub fn parameter(self, sub: u8) -> Address {
        let index = match self.direction {
            Direction::Receive => cia301::rpdo(self.number),
            Direction::Transmit => cia301::tpdo(self.number),
        };
        Address::new(index, sub)
    }

    /// The address of an entry in its mapping parameter.
    #[must_use]
    pub fn mapping(self, sub: u8) -> Address {
        Address::new(self.parameter(0).index() + TO_MAPPING, sub)
    }

    /// Its COB-ID in the predefined connection set (CiA 301, 7.3.3); `None` from the fifth PDO on.
    #[must_use]
    pub fn predefined(self, node: NodeId) -> Option<CobId> {
        let first = match self.direction {
            Direction::Receive => cia301::connection::RPDO_1,
            Direction::Transmit => cia301::connection::TPDO_1,
        };
        (self.number <= 4).then(|| CobId::of_node(first + 0x100 * (self.number - 1), node))
    }

    /// The PDOs in a data sheet: receive PDOs first, then by number.
    #[must_use]
    pub fn of_sheet(device: &Device) -> Vec<PdoName> {
        let names = device.entries().filter(|entry| entry.sub == 1).filter_map(|entry| PdoName::of_index(entry.index));
        names.collect::<BTreeSet<_>>().into_iter().collect()
    }

    /// The PDO of a communication parameter.
    fn of_index(index: u16) -> Option<PdoName> {
        let direction = match index {
            cia301::RPDO_1..=cia301::RPDO_512 => Direction::Receive,
            cia301::TPDO_1..=cia301::TPDO_512 => Direction::Transmit,
            _ => return None,
        };
        Some(PdoName { direction, number: cia301::pdo_number(index) })
    }
}

/// The configuration of a PDO.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PdoState {
    /// Which PDO.
    pub name: PdoName,
    /// The COB-ID, and whether the PDO is enabled.
    pub cob_id: PdoCobId,
    /// `None` if the device lacks the entry.
    pub transmission: Option<TransmissionType>,
    /// In multiples of 100 µs; `None` if the device lacks the entry.
    pub inhibit_100us: Option<u16>,
    /// In ms; for an RPDO, its deadline. `None` if the device lacks the entry.
    pub event_timer_ms: Option<u16>,
    /// The mapped objects, in order.
    pub mapping: Vec<Mapped>,
}

impl PdoState {
    /// Reads the configuration of a PDO. `read` returns the bytes of an entry, or `None` if it does not exist. The
    /// result is `None` if the PDO has no COB-ID entry.
    pub fn read<E>(
        name: PdoName,
        mut read: impl FnMut(Address) -> Result<Option<Vec<u8>>, E>,
    ) -> Result<Option<PdoState>, E> {
        let mut number = |address, size| -> Result<Option<u32>, E> {
            let bytes = read(address)?;
            // A server that does not indicate the size sends four bytes.
            let number =
                |bytes: Vec<u8>| bytes.iter().take(size).rev().fold(0, |sum, byte| sum << 8 | u32::from(*byte));
            Ok(bytes.map(number))
        };
        let Some(cob_id) = number(name.parameter(1), 4)? else { return Ok(None) };
        let transmission = number(name.parameter(2), 1)?.map(|code| TransmissionType::from_code(code as u8));
        let inhibit_100us = match name.direction {
            Direction::Transmit => number(name.parameter(3), 2)?.map(|time| time as u16),
            Direction::Receive => None,
        };
        let event_timer_ms = number(name.parameter(5), 2)?.map(|time| time as u16);
        // 254 and 255 mark multiplexed PDOs, which have no mapping of their own.
        let count = number(name.mapping(0), 1)?.map_or(0, |count| count as u8);
        let mut mapping = Vec::new();
        for sub in 1..=if count > 64 { 0 } else { count } {
            mapping.extend(number(name.mapping(sub), 4)?.map(Mapped::from_parameter));
        }
        let cob_id = PdoCobId(cob_id);
        Ok(Some(PdoState { name, cob_id, transmission, inhibit_100us, event_timer_ms, mapping }))
    }

    /// The configuration of a node's PDO by its data sheet.
    #[must_use]
    pub fn of_sheet(device: &Device, node: NodeId, name: PdoName) -> Option<PdoState> {
        let state = PdoState::read(name, |address| {
            let Some(entry) = device.entry(address.index(), address.sub()) else { return Ok(None) };
            let value = given(entry).map(|value| resolved(value, node));
            let number = value.as_ref().and_then(Value::as_integer).unwrap_or(0);
            Ok::<_, std::convert::Infallible>(Some((number as u32).to_le_bytes().to_vec()))
        });
        state.unwrap_or_default()
    }

    /// Reads all PDOs of a device: those in the data sheet, or without one, those for which the device answers.
    pub fn read_all<E>(
        device: Option<&Device>,
        mut read: impl FnMut(Address) -> Result<Option<Vec<u8>>, E>,
    ) -> Result<Vec<PdoState>, E> {
        let mut states = Vec::new();
        if let Some(device) = device {
            for name in PdoName::of_sheet(device) {
                states.extend(PdoState::read(name, &mut read)?);
            }
            return Ok(states);
        }
        for direction in [Direction::Receive, Direction::Transmit] {
            let mut missing = 0;
            for number in 1..=512 {
                let state = PdoState::read(PdoName { direction, number }, &mut read)?;
                missing = if state.is_some() { 0 } else { missing + 1 };
                states.extend(state);
                if missing == GAP {
                    break;
                }
            }
        }
        Ok(states)
    }

    /// The number of mapped bits.
    #[must_use]
    pub fn bits(&self) -> u32 {
        self.mapping.iter().map(|mapped| u32::from(mapped.bits)).sum()
    }

    /// The differences from `wanted`, as text.
    #[must_use]
    pub fn differences(&self, wanted: &PdoState) -> Vec<String> {
        let mut differences = Vec::new();
        let mut compare = |what: &str, found: String, wanted: String| {
            if found != wanted {
                differences.push(format!("{what} is {found}, not {wanted}"));
            }
        };
        let code = |state: &PdoState| state.transmission.map_or_else(|| "missing".into(), |it| it.code().to_string());
        let time = |time: Option<u16>| time.map_or_else(|| "missing".into(), |time| time.to_string());
        let mapping = |state: &PdoState| {
            let entries = state.mapping.iter().map(|mapped| format!("{:08X}h", mapped.to_parameter()));
            format!("[{}]", entries.collect::<Vec<_>>().join(", "))
        };
        compare("the COB-ID", format!("{:08X}h", self.cob_id.0), format!("{:08X}h", wanted.cob_id.0));
        compare("the transmission type", code(self), code(wanted));
        compare("the inhibit time", time(self.inhibit_100us), time(wanted.inhibit_100us));
        compare("the event timer", time(self.event_timer_ms), time(wanted.event_timer_ms));
        compare("the mapping", mapping(self), mapping(wanted));
        differences
    }
}

/// When a PDO of this type is sent or takes effect, as text: `with every SYNC (1)`.
#[must_use]
pub fn transmission(direction: Direction, transmission: TransmissionType) -> String {
    use TransmissionType as T;
    let words = match (direction, transmission) {
        (_, T::Reserved(_)) => "reserved",
        (Direction::Receive, it) if it.is_synchronous() => "takes effect at the next SYNC",
        (Direction::Receive, T::EventManufacturer | T::EventProfile) => "takes effect at once",
        (_, T::SynchronousAcyclic) => "with the next SYNC after an event",
        (_, T::SynchronousCyclic(1)) => "with every SYNC",
        (_, T::SynchronousCyclic(2)) => "with every 2nd SYNC",
        (_, T::SynchronousCyclic(3)) => "with every 3rd SYNC",
        (_, T::SynchronousCyclic(n)) => return format!("with every {n}th SYNC ({n})"),
        (_, T::SynchronousRemote) => "sampled at SYNC, sent when asked for",
        (_, T::Remote) => "sent when asked for",
        (_, T::EventManufacturer) => "at events of the manufacturer",
        (_, T::EventProfile) => "at events of the profile",
    };
    format!("{words} ({})", transmission.code())
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use lexican_eds::library;
    use lexican_eds::types::DataType;

    use super::*;

    const NODE: NodeId = NodeId::literal(5);

    fn akd() -> Device {
        lexican_eds::load(&library::find("kollmorgen/akd").unwrap().input()).0
    }

    fn plan(device: &Device, pdo: &str, objects: &[&str], change: Change) -> Result<Plan, Vec<Objection>> {
        let name: PdoName = pdo.parse().unwrap();
        let mapping = (!objects.is_empty()).then(|| name.map(Some(device), objects)).transpose()?;
        Plan::new(Some(device), NODE, PdoState::of_sheet(device, NODE, name).unwrap(), &Change { mapping, ..change })
    }

    #[test]
    fn names_of_pdos_are_read_in_any_case() {
        for (text, name) in [("tpdo1", Some("TPDO1")), ("RPDO512", Some("RPDO512")), ("tpdo0", None), ("pdo1", None)] {
            assert_eq!(text.parse::<PdoName>().ok().map(|name| name.to_string()).as_deref(), name, "{text}");
        }
    }

    #[test]
    fn transmission_types_are_words() {
        let words = |direction, code| transmission(direction, TransmissionType::from_code(code));
        assert_eq!(words(Direction::Transmit, 1), "with every SYNC (1)");
        assert_eq!(words(Direction::Transmit, 4), "with every 4th SYNC (4)");
        assert_eq!(words(Direction::Receive, 4), "takes effect at the next SYNC (4)");
        assert_eq!(words(Direction::Transmit, 245), "reserved (245)");
    }

    #[test]
    fn the_bits_of_a_mapping_are_a_picture() {
        let name = "rpdo1".parse().unwrap();
        let mapping = vec![Mapped::new(0x2000, 1, 1), Mapped::new(5, 0, 8), Mapped::new(0x2000, 2, 2)];
        let state = PdoState {
            name,
            cob_id: PdoCobId(0x205),
            transmission: Some(TransmissionType::EventProfile),
            inhibit_100us: None,
            event_timer_ms: Some(50),
            mapping,
        };
        let expected = "RPDO1  205h, takes effect at once (255), deadline 50 ms\n       0        1\n    \
                        -------a .....cc-\n    a  bit 0      2000:01\n    -  bits 1-8   gap of UNSIGNED8\n    \
                        c  bits 9-10  2000:02\n";
        assert_eq!(in_words(&state, None, &BTreeMap::new()), expected);
    }

    #[test]
    fn a_change_is_checked_and_can_be_undone() {
        let device = akd();
        let change = || Change { on: Some(true), event_timer_ms: Some(10), ..Change::default() };
        let plan = plan(&device, "tpdo1", &["statusword", "6064"], change()).unwrap();
        assert_eq!((plan.after.bits(), plan.after.event_timer_ms, plan.after.cob_id), (48, Some(10), PdoCobId(0x185)));
        assert!(!plan.changes_nothing());
        let differences = plan.before.differences(&plan.after);
        assert_eq!(differences[0], "the event timer is 0, not 10");
        assert_eq!(differences.len(), 2, "{differences:?}");
    }

    #[test]
    fn every_objection_is_found() {
        let device = akd();
        let of = |objects: &[&str], change| plan(&device, "rpdo1", objects, change).unwrap_err();
        let fixed = Change { transmission: Some(TransmissionType::Remote), ..Change::default() };
        let pdo = "rpdo1".parse().unwrap();
        assert_eq!(of(&[], fixed), [Objection::NoTransmissionType { pdo, code: 253 }]);
        let unmapped = of(&["1000"], Change::default());
        assert!(matches!(unmapped[..], [Objection::NotMappable(_)]), "{unmapped:?}");
        let text = of(&["1008"], Change::default());
        assert!(matches!(text[..], [Objection::NoFixedLength { data_type: DataType::VisibleString, .. }]), "{text:?}");
        let nine = ["target position"; 9];
        let too_many = of(&nine, Change::default());
        assert_eq!(too_many, [Objection::TooMany { pdo, count: 9, most: 8 }, Objection::TooLong(288)]);
        // Without a data sheet, names and lengths are unknown.
        let unknown = pdo.map(None, &["6041"]).unwrap_err();
        assert_eq!(unknown, [Objection::UnknownLength(Address::new(0x6041, 0))]);
    }

    #[test]
    fn a_pdo_beyond_the_predefined_ones_needs_a_cob_id() {
        let state = |number| PdoState {
            name: PdoName { direction: Direction::Transmit, number },
            cob_id: PdoCobId(0xC000_0000),
            transmission: None,
            inhibit_100us: None,
            event_timer_ms: None,
            mapping: Vec::new(),
        };
        let on = Change { on: Some(true), ..Change::default() };
        let plan = |number, change: &Change| Plan::new(None, NODE, state(number), change);
        assert_eq!(plan(4, &on).unwrap().after.cob_id, PdoCobId(0x4000_0485));
        assert_eq!(plan(5, &on).unwrap_err(), [Objection::NoCobId(state(5).name)]);
        let given = Change { cob_id: CobId::standard(0x1A5), ..on };
        assert_eq!(plan(5, &given).unwrap().after.cob_id, PdoCobId(0x4000_01A5));
        let off = Change { on: Some(false), ..Change::default() };
        assert!(plan(5, &off).unwrap().changes_nothing());
    }
}
