//! Values of entries in reports.

use lexican_eds::types::{Class, DataType};

use crate::sdo;
use crate::tester::Tester;

impl Tester<'_> {
    /// A value of an entry in words, by the data type of the data sheet.
    pub(crate) fn shown(&self, (index, sub): (u16, u8), bytes: &[u8]) -> String {
        let entry = self.sheet.device.entry(index, sub);
        shown(entry.map_or(DataType::Domain, |entry| entry.data_type), bytes)
    }
}

/// A value in words: `4096 (1000h)`, `"LXC"`; as bytes if the type is one of bytes, or has another length.
fn shown(data_type: DataType, bytes: &[u8]) -> String {
    let has_length = data_type.bits().is_none_or(|bits| usize::from(bits.div_ceil(8)) == bytes.len());
    let raw = sdo::number(bytes);
    match data_type.class() {
        _ if !has_length => format!("{bytes:02X?}"),
        Class::Signed => number(data_type.fit(raw.into()).unwrap_or_default(), raw),
        Class::Boolean | Class::Unsigned | Class::Time => number(raw.into(), raw),
        Class::Real if bytes.len() == 4 => f32::from_bits(raw as u32).to_string(),
        Class::Real => f64::from_bits(raw).to_string(),
        Class::Text if data_type == DataType::VisibleString => {
            format!("{:?}", bytes.iter().map(|byte| char::from(*byte)).collect::<String>())
        }
        Class::Text => {
            let units = bytes.chunks(2).map(|two| u16::from_le_bytes([two[0], two.get(1).copied().unwrap_or(0)]));
            format!("{:?}", String::from_utf16_lossy(&units.collect::<Vec<_>>()))
        }
        Class::Bytes | Class::Other => format!("{bytes:02X?}"),
    }
}

/// A number, also in hexadecimal where that differs.
fn number(number: i128, raw: u64) -> String {
    if (0..10).contains(&number) { number.to_string() } else { format!("{number} ({raw:X}h)") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_shown_by_their_type() {
        for (data_type, bytes, text) in [
            (DataType::Unsigned32, &[0, 0x10, 0, 0][..], "4096 (1000h)"),
            (DataType::Unsigned8, &[9], "9"),
            (DataType::Boolean, &[1], "1"),
            (DataType::Integer16, &[0xFE, 0xFF], "-2 (FFFEh)"),
            (DataType::Integer64, &[0xFF; 8], "-1 (FFFFFFFFFFFFFFFFh)"),
            (DataType::Integer24, &[7, 0, 0], "7"),
            (DataType::Real32, &[0, 0, 0xC0, 0x3F], "1.5"),
            (DataType::Real64, &[0, 0, 0, 0, 0, 0, 0xF8, 0xBF], "-1.5"),
            (DataType::VisibleString, b"a \"b\"\xB5\0", "\"a \\\"b\\\"\u{B5}\\0\""),
            (DataType::VisibleString, b"", "\"\""),
            (DataType::UnicodeString, b"L\0x\0", "\"Lx\""),
            (DataType::TimeOfDay, &[16, 0, 0, 0, 0, 0], "16 (10h)"),
            (DataType::OctetString, &[1, 2], "[01, 02]"),
            (DataType::Domain, &[], "[]"),
            (DataType::Unsigned16, &[1], "[01]"),
            (DataType::Integer8, &[], "[]"),
            (DataType::Other(0x40), &[1], "[01]"),
        ] {
            assert_eq!(shown(data_type, bytes), text, "{data_type}");
        }
    }
}
