//! The objects of CiA 301 and CiA 402-2 as the standards define them.

use crate::model::ObjectKind;
use crate::model::types::DataType;

/// An object of a standard.
pub(crate) struct Standard {
    /// `CiA 301`.
    pub(crate) source: &'static str,
    pub(crate) kind: ObjectKind,
    /// Whether ARRAY and RECORD are both seen in good company.
    pub(crate) loose: bool,
    types: Types,
}

#[derive(Clone, Copy)]
enum Types {
    /// Of the single value, or of all entries but sub-index 0.
    All(DataType),
    /// Of sub-index 1 and on.
    Each(&'static [DataType]),
}

impl Standard {
    /// The data type of a sub-index, where the standard fixes it.
    pub(crate) fn data_type(&self, sub: u8) -> Option<DataType> {
        match (self.kind.has_subs(), sub, self.types) {
            (true, 0, _) => Some(DataType::Unsigned8),
            (true, 0xFF, _) => None,
            (_, _, Types::All(data_type)) => Some(data_type),
            (_, sub, Types::Each(types)) => types.get(usize::from(sub) - 1).copied(),
        }
    }
}

/// The object with this index in CiA 301, or in the profile of the device.
pub(crate) fn object(index: u16, profile: Option<u16>) -> Option<Standard> {
    match index {
        0x1000..=0x1FFF => cia301(index),
        0x6000..=0x9FFF if profile == Some(402) => cia402(0x6000 + (index - 0x6000) % 0x800),
        _ => None,
    }
}

/// CiA 301, 7.5.2.
fn cia301(index: u16) -> Option<Standard> {
    use DataType as D;
    const PDO: &[DataType] = &[D::Unsigned32, D::Unsigned8, D::Unsigned16, D::Unsigned8, D::Unsigned16, D::Unsigned8];
    const SDO: &[DataType] = &[D::Unsigned32, D::Unsigned32, D::Unsigned8];
    const COMMAND: &[DataType] = &[D::OctetString, D::Unsigned8, D::OctetString];
    let (kind, types) = match index {
        0x1000 | 0x1002 | 0x1005..=0x1007 | 0x1012..=0x1014 => variable(D::Unsigned32),
        0x1001 | 0x100D | 0x1019 | 0x1024 => variable(D::Unsigned8),
        0x1008..=0x100A => variable(D::VisibleString),
        0x100C | 0x1015 | 0x1017 => variable(D::Unsigned16),
        0x1003 | 0x1010 | 0x1011 | 0x1016 | 0x1020 | 0x1028 => array(D::Unsigned32),
        0x1026 | 0x1029 => array(D::Unsigned8),
        0x1027 => array(D::Unsigned16),
        0x1018 => (ObjectKind::Record, Types::All(D::Unsigned32)),
        0x1023 | 0x1025 => (ObjectKind::Record, Types::Each(COMMAND)),
        0x1200..=0x12FF => (ObjectKind::Record, Types::Each(SDO)),
        0x1400..=0x15FF | 0x1800..=0x19FF => (ObjectKind::Record, Types::Each(PDO)),
        0x1600..=0x17FF | 0x1A00..=0x1BFF => (ObjectKind::Record, Types::All(D::Unsigned32)),
        _ => return None,
    };
    // Mappings are lists of equal words, and many data sheets make them arrays.
    let loose = matches!(index, 0x1600..=0x17FF | 0x1A00..=0x1BFF);
    Some(Standard { source: "CiA 301", kind, loose, types })
}

/// CiA 402-2, by the index of the first axis.
fn cia402(index: u16) -> Option<Standard> {
    use DataType as D;
    const RAMP: &[DataType] = &[D::Unsigned32, D::Unsigned16];
    const INTERPOLATION_TIME: &[DataType] = &[D::Unsigned8, D::Integer8];
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
    Some(Standard { source: "CiA 402", kind, loose: true, types })
}

fn variable(data_type: DataType) -> (ObjectKind, Types) {
    (ObjectKind::Variable, Types::All(data_type))
}

fn array(data_type: DataType) -> (ObjectKind, Types) {
    (ObjectKind::Array, Types::All(data_type))
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
        check(0x1800, 9, None);
        check(0x1A00, 64, Some(DataType::Unsigned32));
        check(0x6060, 0, Some(DataType::Integer8));
        check(0x6860, 0, Some(DataType::Integer8));
        check(0x6048, 2, Some(DataType::Unsigned16));
        check(0x2000, 0, None);
    }
}
