//! Numbers and types of leaves, as a data sheet prints them.

use lexican_eds::model::{Condition, Entry, Value};
use lexican_eds::types::DataType;

use super::context::Context;
use crate::plan::{Number, Type, fitting, raw};

/// `0x1018, 0x01`.
pub(super) fn address(index: u16, sub: u8) -> String {
    format!("0x{index:04X}, 0x{sub:02X}")
}

/// `4..=6`, or `7`.
pub(super) fn bits(low: u8, high: u8) -> String {
    if low == high { low.to_string() } else { format!("{low}..={high}") }
}

/// A code in hexadecimal, a quantity in decimal.
pub(super) fn integer(number: i128, in_hex: bool) -> String {
    if in_hex && number > 9 { format!("0x{number:X}") } else { number.to_string() }
}

/// A number as the wire has it, which in Rust is a `u64`.
pub(super) fn wire_form(context: &Context<'_>, entry: &Entry, number: Number) -> String {
    let raw = raw(number, entry.data_type);
    match (number, entry.data_type.bits()) {
        (Number::Integer(negative @ ..0), Some(bits @ (8 | 16 | 32))) => {
            format!("{negative}_i{bits} as u{bits} as u64")
        }
        (Number::Integer(negative @ ..0), Some(64)) => format!("{negative}_i64 as u64"),
        (Number::Integer(integer @ 0..), _) => self::integer(integer, context.is_hex(entry)),
        _ => format!("0x{raw:X}"),
    }
}

/// A condition, with the number in the wire form of the entry that decides.
pub(super) fn condition(context: &Context<'_>, condition: &Condition) -> String {
    let value = context.plan.entry(condition.index, condition.sub).and_then(|entry| {
        let number = fitting(&Value::Integer(condition.value), entry.data_type)?;
        Some(wire_form(context, entry, number))
    });
    let value = value.unwrap_or_else(|| (condition.value as u64).to_string());
    let address = address(condition.index, condition.sub);
    format!("{}::new({address}, {}, {value})", context.object("Condition"), condition.equal)
}

/// The Rust type of a data type.
pub(super) fn rust_type(context: &Context<'_>, data_type: DataType) -> String {
    use DataType as D;
    let primitive = match data_type {
        D::Boolean => "bool",
        D::Integer8 => "i8",
        D::Integer16 => "i16",
        D::Integer32 => "i32",
        D::Integer64 => "i64",
        D::Unsigned8 => "u8",
        D::Unsigned16 => "u16",
        D::Unsigned32 => "u32",
        D::Unsigned64 => "u64",
        D::Real32 => "f32",
        D::Real64 => "f64",
        other => return context.object(runtime_type(other)),
    };
    primitive.to_owned()
}

/// The variant of the runtime's `DataType`.
pub(super) fn data_type(data_type: DataType) -> String {
    match data_type {
        DataType::Other(_) => "OctetString".to_owned(),
        known => format!("{known:?}"),
    }
}

fn runtime_type(data_type: DataType) -> &'static str {
    use DataType as D;
    match data_type {
        D::Integer24 => "I24",
        D::Integer40 => "I40",
        D::Integer48 => "I48",
        D::Integer56 => "I56",
        D::Unsigned24 => "U24",
        D::Unsigned40 => "U40",
        D::Unsigned48 => "U48",
        D::Unsigned56 => "U56",
        D::VisibleString => "VisibleString",
        D::UnicodeString => "UnicodeString",
        D::Domain => "Domain",
        D::TimeOfDay => "TimeOfDay",
        D::TimeDifference => "TimeDifference",
        _ => "OctetString",
    }
}

impl Context<'_> {
    /// A type, as a path.
    pub(super) fn r#type(&self, r#type: Type) -> String {
        match r#type {
            Type::Plain(data_type) => rust_type(self, data_type),
            Type::Newtype(row) => self.plan.newtypes[row].ident.clone(),
        }
    }

    /// A value of a type; integers in hexadecimal where the data sheet has them so.
    pub(super) fn value(&self, r#type: Type, number: Number, in_hex: bool) -> String {
        match r#type {
            Type::Plain(data_type) => self.plain_value(data_type, number, in_hex),
            Type::Newtype(row) => {
                let newtype = &self.plan.newtypes[row];
                format!("{}({})", newtype.ident, self.plain_value(newtype.data_type, number, in_hex))
            }
        }
    }

    fn plain_value(&self, data_type: DataType, number: Number, in_hex: bool) -> String {
        let integer = match number {
            Number::Real(real) => return float(data_type, real),
            Number::Integer(integer) => integer,
        };
        match data_type {
            DataType::Boolean => (integer != 0).to_string(),
            DataType::TimeOfDay | DataType::TimeDifference => {
                let name = rust_type(self, data_type);
                let (days, ms) = (integer >> 32 & 0xFFFF, integer & 0x0FFF_FFFF);
                format!("{name} {{ days: {days}, ms: {ms} }}")
            }
            _ => {
                let digits = self::integer(integer, in_hex);
                let in_a_type_of_the_runtime = runtime_type(data_type).starts_with(['I', 'U']);
                if in_a_type_of_the_runtime {
                    format!("{}::literal({digits})", rust_type(self, data_type))
                } else {
                    digits
                }
            }
        }
    }
}

/// A finite number.
fn float(data_type: DataType, real: f64) -> String {
    if data_type == DataType::Real32 { format!("{:?}", real as f32) } else { format!("{real:?}") }
}
