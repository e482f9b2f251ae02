//! The PDOs that the communication and mapping parameters describe (CiA 301, 7.5.2.35 to 7.5.2.38).

use crate::model::{Device, Direction, Entry, Mapped, Object, Pdo, Value};
use lexican_cia::cia301::{self, connection};

/// The most PDOs of one direction: there are indices for no more.
pub(crate) const MAX_PDOS: u16 = 512;

/// The PDOs that have a communication or mapping parameter in the dictionary.
pub(crate) fn pdos(device: &Device) -> Vec<Pdo> {
    let mut pdos = Vec::new();
    for direction in [Direction::Receive, Direction::Transmit] {
        let first = direction.communication_parameter(1);
        let start = device.objects.partition_point(|object| object.index < first);
        let end = device.objects.partition_point(|object| object.index < first + 2 * cia301::TO_MAPPING);
        let mut numbers: Vec<u16> =
            device.objects[start..end].iter().map(|object| (object.index - first) % cia301::TO_MAPPING + 1).collect();
        numbers.sort_unstable();
        numbers.dedup();
        pdos.extend(numbers.into_iter().map(|number| pdo(device, direction, number)));
    }
    pdos
}

impl Device {
    /// Derives the PDOs again after values of their parameters were changed.
    pub fn describe_pdos(&mut self) {
        self.pdos = pdos(self);
    }
}

impl Direction {
    /// The index of the communication parameter of a PDO: 1400h for the first receive PDO.
    #[must_use]
    pub fn communication_parameter(self, number: u16) -> u16 {
        let first = if self == Direction::Receive { cia301::RPDO_1 } else { cia301::TPDO_1 };
        first + (number.clamp(1, MAX_PDOS) - 1)
    }

    /// The index of the mapping parameter of a PDO: 1600h for the first receive PDO.
    #[must_use]
    pub fn mapping_parameter(self, number: u16) -> u16 {
        self.communication_parameter(number) + cia301::TO_MAPPING
    }

    /// The COB-ID without node-ID in the predefined connection set (CiA 301, 7.3.3), which has the first four PDOs.
    #[must_use]
    pub fn predefined_cob_id(self, number: u16) -> Option<u16> {
        let first = if self == Direction::Receive { connection::RPDO_1 } else { connection::TPDO_1 };
        (1..=4).contains(&number).then(|| first + 0x100 * (number - 1))
    }
}

/// The value of an entry: as configured by a DCF, else the default.
pub(crate) fn held(entry: &Entry) -> Option<&Value> {
    entry.configured.as_ref().or(entry.default.as_ref())
}

/// Decodes an entry of a mapping parameter: index, sub-index and length.
pub(crate) fn mapped(word: i128) -> Option<Mapped> {
    let word = u32::try_from(word).ok().filter(|&word| word != 0)?;
    Some(Mapped { index: (word >> 16) as u16, sub: (word >> 8) as u8, bits: word as u8 })
}

fn pdo(device: &Device, direction: Direction, number: u16) -> Pdo {
    let communication = device.object(direction.communication_parameter(number));
    let mapping = device.object(direction.mapping_parameter(number));
    let held = |sub: u8| held(communication?.entry(sub)?);
    Pdo {
        direction,
        number,
        cob_id: held(1).cloned(),
        transmission_type: held(2).and_then(Value::as_integer).and_then(|value| u8::try_from(value).ok()),
        mapping: mapping.map(mapping_of).unwrap_or_default(),
        dynamic: mapping.and_then(|mapping| mapping.entry(0)).is_some_and(|count| count.access.writable()),
    }
}

/// The mapped objects: as many as sub-index 0 says, or without it, those before the first empty entry.
fn mapping_of(object: &Object) -> Vec<Mapped> {
    let number = |sub: u8| held(object.entry(sub)?)?.as_integer();
    // 254 and 255 mark a multiplexed PDO (CiA 301), which has no mapping.
    let count = number(0).unwrap_or(0x40).clamp(0, 0xFF) as u8;
    let count = if count > 0x40 { 0 } else { count };
    (1..=count).map_while(|sub| mapped(number(sub)?)).collect()
}
