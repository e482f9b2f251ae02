//! Converts values to and from wire form.

use lexican_eds::model::{Device, Value};
use lexican_eds::types::{Class, DataType};

/// The value in these bytes; `None` if their length is not that of the type.
pub fn parse(data_type: DataType, bytes: &[u8]) -> Option<Value> {
    let size = data_type.bits().map(|bits| usize::from(bits.div_ceil(8)));
    if size.is_some_and(|size| size != bytes.len()) {
        return None;
    }
    Some(match data_type.class() {
        Class::Boolean | Class::Unsigned | Class::Time => Value::Integer(unsigned(bytes)),
        Class::Signed => Value::Integer(sign_extended(unsigned(bytes), bytes.len() as u32 * 8)),
        Class::Real => match *bytes {
            [a, b, c, d] => Value::Real(f32::from_le_bytes([a, b, c, d]).into()),
            [a, b, c, d, e, f, g, h] => Value::Real(f64::from_le_bytes([a, b, c, d, e, f, g, h])),
            _ => return None,
        },
        Class::Text => Value::Text(text(data_type, bytes)),
        Class::Bytes | Class::Other => Value::Bytes(bytes.to_vec()),
    })
}

/// The same for an SDO transfer, which may be padded: see [`fitting`].
pub fn parse_padded(data_type: DataType, data: &[u8]) -> Option<Value> {
    parse(data_type, fitting(data_type, data))
}

/// The bytes without padding: a server that does not indicate the size (42h) sends four bytes for any type.
pub fn fitting(data_type: DataType, data: &[u8]) -> &[u8] {
    let size = data_type.bits().map_or(data.len(), |bits| usize::from(bits.div_ceil(8)));
    if data.len() == 4 { data.get(..size).unwrap_or(data) } else { data }
}

/// The bytes to write by SDO, padded to four if the device requires that.
pub fn written(device: Option<&Device>, mut data: Vec<u8>) -> Vec<u8> {
    if device.is_some_and(|device| device.sdo_writes_four_bytes) && (1..4).contains(&data.len()) {
        data.resize(4, 0);
    }
    data
}

/// The value in `bits` bits of a PDO.
pub fn of_bits(data_type: DataType, bits: u8, raw: u64) -> Value {
    let raw = i128::from(raw);
    match data_type.class() {
        Class::Signed => Value::Integer(sign_extended(raw, bits.into())),
        Class::Real if bits == 32 => Value::Real(f32::from_bits(raw as u32).into()),
        Class::Real if bits == 64 => Value::Real(f64::from_bits(raw as u64)),
        _ => Value::Integer(raw),
    }
}

/// The value in the runtime's wire form of a number.
pub(super) fn number_of(data_type: DataType, raw: u64) -> Value {
    of_bits(data_type, data_type.bits().unwrap_or(64), raw)
}

fn unsigned(bytes: &[u8]) -> i128 {
    bytes.iter().rev().fold(0, |number, byte| number << 8 | i128::from(*byte))
}

fn sign_extended(number: i128, bits: u32) -> i128 {
    let up = 128 - bits.clamp(1, 128);
    number << up >> up
}

fn text(data_type: DataType, bytes: &[u8]) -> String {
    if data_type == DataType::UnicodeString {
        let units = bytes.chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]]));
        return char::decode_utf16(units).map(|letter| letter.unwrap_or(char::REPLACEMENT_CHARACTER)).collect();
    }
    // ISO 646 by the standard; UTF-8 or code page 1252 in practice. Some devices pad with zeros.
    let text =
        std::str::from_utf8(bytes).map_or_else(|_| bytes.iter().map(|&b| char::from(b)).collect(), str::to_owned);
    text.trim_end_matches('\0').to_owned()
}

/// The bytes of a value; `None` if the type cannot hold it.
pub fn encode(data_type: DataType, value: &Value) -> Option<Vec<u8>> {
    let size = data_type.bits().map(|bits| usize::from(bits.div_ceil(8)));
    match (value, data_type.class()) {
        (Value::Integer(number), Class::Boolean | Class::Signed | Class::Unsigned | Class::Time) => {
            let (low, high) = data_type.range()?;
            let bytes = number.to_le_bytes();
            (low..=high).contains(number).then(|| bytes.get(..size?).map(<[u8]>::to_vec))?
        }
        (Value::Real(number), Class::Real) if size == Some(4) => Some((*number as f32).to_le_bytes().to_vec()),
        (Value::Real(number), Class::Real) => Some(number.to_le_bytes().to_vec()),
        (Value::Integer(number), Class::Real) => encode(data_type, &Value::Real(*number as f64)),
        (Value::Text(text), _) if data_type == DataType::UnicodeString => {
            Some(text.encode_utf16().flat_map(u16::to_le_bytes).collect())
        }
        (Value::Text(text), Class::Text) => Some(text.as_bytes().to_vec()),
        (Value::Bytes(bytes), _) if size.is_none_or(|size| size == bytes.len()) => Some(bytes.clone()),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_values_of_their_type_or_nothing() {
        let integer = |number| Some(Value::Integer(number));
        assert_eq!(parse(DataType::Integer32, &[0x78, 0xEC, 0xFF, 0xFF]), integer(-5000));
        assert_eq!(parse(DataType::Unsigned24, &[1, 2, 3]), integer(0x03_0201));
        assert_eq!(parse(DataType::Integer8, &[0xFF]), integer(-1));
        assert_eq!(parse(DataType::Unsigned64, &[0xFF; 8]), integer(u64::MAX.into()));
        assert_eq!(parse(DataType::Unsigned16, &[0]), None);
        assert_eq!(parse(DataType::Real32, &1.5_f32.to_le_bytes()), Some(Value::Real(1.5)));
        assert_eq!(parse(DataType::VisibleString, b"AG03\0\0"), Some(Value::Text("AG03".to_owned())));
        assert_eq!(parse(DataType::VisibleString, b"Gr\xF6\xDFe"), Some(Value::Text("Größe".to_owned())));
        assert_eq!(parse(DataType::UnicodeString, &[0x41, 0, 0xFC, 0]), Some(Value::Text("Aü".to_owned())));
    }

    #[test]
    fn four_bytes_are_written_where_the_device_takes_no_others() {
        let four = Device { sdo_writes_four_bytes: true, ..Device::default() };
        for (device, data, bytes) in [
            (Some(&four), vec![2], vec![2, 0, 0, 0]),
            (Some(&four), vec![1, 2], vec![1, 2, 0, 0]),
            (Some(&four), vec![1, 2, 3, 4, 5], vec![1, 2, 3, 4, 5]),
            (Some(&four), vec![], vec![]),
            (Some(&Device::default()), vec![2], vec![2]),
            (None, vec![2], vec![2]),
        ] {
            assert_eq!(written(device, data), bytes);
        }
    }

    #[test]
    fn what_is_encoded_is_parsed() {
        let check = |data_type, value: Value| {
            let bytes = encode(data_type, &value).unwrap();
            assert_eq!(parse(data_type, &bytes), Some(value));
        };
        for &data_type in DataType::ALL {
            let Some((low, high)) = data_type.range() else { continue };
            check(data_type, Value::Integer(low));
            check(data_type, Value::Integer(high));
            assert_eq!(encode(data_type, &Value::Integer(high + 1)), None, "{data_type}");
            assert_eq!(encode(data_type, &Value::Integer(low - 1)), None, "{data_type}");
        }
        check(DataType::Real64, Value::Real(-0.1));
        check(DataType::VisibleString, Value::Text("AG03".to_owned()));
        check(DataType::UnicodeString, Value::Text("Aü€".to_owned()));
        check(DataType::Domain, Value::Bytes(vec![1, 2, 3]));
    }
}
