//! Data types that the device itself defines with DEFTYPE objects in the data type area (CiA 301, 7.4.7).
//!
//! A DEFTYPE states only a length in bits; whether the bits have a sign or a fraction is unknown. So a value becomes an
//! unsigned number of whole bytes, as an SDO transfers it, limited to this length. The members of a DEFSTRUCT do not
//! even state a length, and stay bytes.

use lexican_eds::model::{Device, Entry, Value};
use lexican_eds::types::DataType;

/// Replaces such types in all entries by the UNSIGNED type that holds their bits.
pub(crate) fn resolve(device: &mut Device) {
    let lengths: Vec<Option<u8>> = device.entries().map(|entry| length(device, entry)).collect();
    let entries = device.objects.iter_mut().flat_map(|object| &mut object.entries);
    for (entry, bits) in entries.zip(lengths) {
        if let Some(bits) = bits {
            apply(entry, bits);
        }
    }
}

fn length(device: &Device, entry: &Entry) -> Option<u8> {
    matches!(entry.data_type, DataType::Other(_)).then(|| device.bits(entry.data_type))?
}

fn apply(entry: &mut Entry, bits: u8) {
    let plural = if bits == 1 { "" } else { "s" };
    let text = format!("The device defines its data type {} as {bits} bit{plural}.", entry.data_type);
    entry.description = Some(match entry.description.take() {
        Some(description) => format!("{description} {text}"),
        None => text,
    });
    entry.default = entry.default.take().and_then(|value| as_bits(value, bits));
    entry.configured = entry.configured.take().and_then(|value| as_bits(value, bits));
    if [&entry.low, &entry.high].into_iter().flatten().any(is_negative) {
        // They limit a signed number, not its bits.
        (entry.low, entry.high) = (None, None);
    }
    if !bits.is_multiple_of(8) && entry.high.is_none() {
        entry.high = Some(Value::Integer((1 << bits) - 1));
    }
    entry.data_type = unsigned(bits);
}

/// The value as unsigned bits; `None` if it has more bits, which the reader has reported.
fn as_bits(value: Value, bits: u8) -> Option<Value> {
    match value {
        Value::Integer(number @ ..0) => Some(Value::Integer(number + (1 << bits))).filter(|value| !is_negative(value)),
        Value::Integer(number) if number >= 1 << bits => None,
        other => Some(other),
    }
}

fn is_negative(value: &Value) -> bool {
    value.as_integer().is_some_and(i128::is_negative)
}

/// The smallest UNSIGNED that holds `bits` bits, 1 to 64.
fn unsigned(bits: u8) -> DataType {
    match bits {
        0..=8 => DataType::Unsigned8,
        9..=16 => DataType::Unsigned16,
        17..=24 => DataType::Unsigned24,
        25..=32 => DataType::Unsigned32,
        33..=40 => DataType::Unsigned40,
        41..=48 => DataType::Unsigned48,
        49..=56 => DataType::Unsigned56,
        _ => DataType::Unsigned64,
    }
}
