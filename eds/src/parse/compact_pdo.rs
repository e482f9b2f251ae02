//! Expands PDO parameters that a data sheet leaves out because `CompactPDO` describes them (CiA 306-1, 6.4).
//!
//! `NrOfRXPDO` and `NrOfTXPDO` count the PDOs of the device. PDOs without any section get the lowest free numbers; if
//! only one of the two parameters of a PDO has sections, the other one is added. Bit n of `CompactPDO` means that
//! communication parameters have sub-index n + 1. Mappings are empty and writable, with as many entries as pieces of
//! `Granularity` bits fit into a frame; without that key, bytes, as most devices map.

use crate::finding::{Findings, Kind};
use crate::model::pdo::MAX_PDOS;
use crate::model::types::DataType;
use crate::model::{AccessType, Device, Direction, Entry, Object, ObjectKind, Value};
use crate::parse::facts::{Facts, ObjectFacts};
use crate::parse::section::SectionKind;
use crate::text::Span;
use lexican_cia::cia301;

/// The bits of `CompactPDO` that CiA 306-1 defines, one for each of sub-indices 1 to 6.
pub(crate) const DEFINED_BITS: u32 = 0x3F;

/// The most entries added to a file: enough for all PDOs with mappings of bytes.
const MAX_ENTRIES: usize = 20_000;

/// Sub-indices 1 to 6 of a communication parameter (CiA 301, 7.5.2.35 and 7.5.2.37).
const SUBS: [(&str, DataType); 6] = [
    ("COB-ID", DataType::Unsigned32),
    ("Transmission type", DataType::Unsigned8),
    ("Inhibit time", DataType::Unsigned16),
    ("Reserved", DataType::Unsigned8),
    ("Event timer", DataType::Unsigned16),
    ("SYNC start value", DataType::Unsigned8),
];

pub(crate) fn expand(device: &mut Device, facts: &mut Facts<'_>, out: &mut Findings) {
    let section = facts.section(SectionKind::DeviceInfo);
    let Some(pair) = section.and_then(|section| section.get("CompactPDO")) else { return };
    let span = facts.syntax.key_span(pair);
    let (mut parameters, mut entries) = (Vec::new(), 0);
    for direction in [Direction::Receive, Direction::Transmit] {
        for number in numbers(device, direction) {
            let pdo = Parameters { device, direction, number, span };
            let new = [pdo.communication(), pdo.mapping()].into_iter().filter(|object| is_new(device, object));
            for object in new {
                entries += object.entries.len();
                parameters.push(object);
            }
            if entries > MAX_ENTRIES {
                out.push(Kind::TooManyEntries(direction.communication_parameter(number)), span);
                return;
            }
        }
    }
    if parameters.is_empty() {
        return;
    }
    facts.objects.extend(parameters.iter().map(|object| ObjectFacts::implied(object.kind)));
    device.objects.append(&mut parameters);
    let mut both: Vec<_> = device.objects.drain(..).zip(facts.objects.drain(..)).collect();
    both.sort_by_key(|(object, _)| object.index);
    (device.objects, facts.objects) = both.into_iter().unzip();
}

fn is_new(device: &Device, object: &Object) -> bool {
    device.object(object.index).is_none()
}

/// The numbers of the PDOs that lack a parameter.
pub(crate) fn numbers(device: &Device, direction: Direction) -> Vec<u16> {
    if device.info.compact_pdo & DEFINED_BITS == 0 {
        return Vec::new();
    }
    let has = |index: u16| device.object(index).is_some();
    let halves =
        |number: u16| (has(direction.communication_parameter(number)), has(direction.mapping_parameter(number)));
    let described = (1..=MAX_PDOS).filter(|&number| halves(number) != (false, false)).count();
    let said = match direction {
        Direction::Receive => device.info.receive_pdos,
        Direction::Transmit => device.info.transmit_pdos,
    };
    let mut free = usize::from(said.unwrap_or(0)).saturating_sub(described);
    let is_left_out = |&number: &u16| match halves(number) {
        (false, false) if free > 0 => {
            free -= 1;
            true
        }
        (communication, mapping) => communication != mapping,
    };
    (1..=MAX_PDOS).filter(is_left_out).collect()
}

/// Makes the parameters of one PDO.
struct Parameters<'a> {
    device: &'a Device,
    direction: Direction,
    number: u16,
    span: Span,
}

impl Parameters<'_> {
    fn communication(&self) -> Object {
        let bits = self.device.info.compact_pdo & DEFINED_BITS;
        let index = self.direction.communication_parameter(self.number);
        let highest = u32::BITS - bits.leading_zeros();
        let mut object = self.object(index, "communication", AccessType::Const, highest.into());
        for ((name, data_type), sub) in SUBS.into_iter().zip(1_u8..) {
            if bits & 1 << (sub - 1) != 0 {
                let default = (sub == 1).then(|| self.cob_id());
                object.entries.push(self.entry(index, sub, name, data_type, default));
            }
        }
        object
    }

    fn mapping(&self) -> Object {
        let index = self.direction.mapping_parameter(self.number);
        let mut object = self.object(index, "mapping", AccessType::Rw, 0);
        let granularity = self.device.info.granularity.unwrap_or(8).clamp(1, 64);
        for sub in 1..=64 / granularity {
            let name = format!("Mapped object {sub}");
            let default = Some(Value::Integer(0));
            object.entries.push(self.entry(index, sub, &name, DataType::Unsigned32, default));
        }
        object
    }

    /// The first four PDOs of each direction have a COB-ID of the predefined connection set (CiA 301, 7.3.3); the
    /// others are disabled.
    fn cob_id(&self) -> Value {
        let predefined = self.direction.predefined_cob_id(self.number);
        predefined.map_or(Value::Integer(cia301::INVALID.into()), |id| Value::NodeIdPlus(id.into()))
    }

    /// A record that has only sub-index 0 yet.
    fn object(&self, index: u16, what: &str, access: AccessType, highest: i128) -> Object {
        let direction = if self.direction == Direction::Receive { "RPDO" } else { "TPDO" };
        let mut count = self.entry(index, 0, "Highest sub-index", DataType::Unsigned8, Some(Value::Integer(highest)));
        count.access = access;
        let name = format!("{direction} {} {what} parameter", self.number);
        Object { name, entries: vec![count], ..Object::new(index, ObjectKind::Record, self.span) }
    }

    fn entry(&self, index: u16, sub: u8, name: &str, data_type: DataType, default: Option<Value>) -> Entry {
        let access = AccessType::Rw;
        Entry { name: name.to_owned(), data_type, access, default, ..Entry::new(index, sub, self.span) }
    }
}
