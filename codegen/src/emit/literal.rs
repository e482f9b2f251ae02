//! Literals of numbers, and paths of leaf types, in the notation of the data sheet.

use lexican_eds::model::number::{Number, fitting, raw};
use lexican_eds::model::{Condition, Entry, Value};
use lexican_eds::types::DataType;
use proc_macro2::{Ident, Literal, TokenStream};
use quote::{format_ident, quote};

use super::context::Context;
use crate::plan::Type;

/// A literal from its spelling.
pub(super) fn number(spelled: &str) -> Literal {
    spelled.parse().expect("a number that was formatted is a literal")
}

/// `0x1018, 0x01`.
pub(super) fn address(index: u16, sub: u8) -> TokenStream {
    let (index, sub) = (number(&format!("0x{index:04X}")), number(&format!("0x{sub:02X}")));
    quote!(#index, #sub)
}

/// `4..=6`, or `7`.
pub(super) fn bits(low: u8, high: u8) -> TokenStream {
    let [first, last] = [low, high].map(Literal::u8_unsuffixed);
    if low == high { quote!(#first) } else { quote!(#first..=#last) }
}

/// Codes are hexadecimal, quantities decimal.
pub(super) fn integer(number: i128, in_hex: bool) -> String {
    if in_hex && number > 9 { format!("0x{number:X}") } else { number.to_string() }
}

/// The wire form of a number, a `u64` in Rust.
pub(super) fn wire_form(context: &Context<'_>, entry: &Entry, number: Number) -> TokenStream {
    let raw = raw(number, entry.data_type);
    match (number, entry.data_type.bits()) {
        (Number::Integer(negative @ ..0), Some(bits @ (8 | 16 | 32))) => {
            let (literal, unsigned) = (self::number(&format!("{negative}_i{bits}")), format_ident!("u{bits}"));
            quote!(#literal as #unsigned as u64)
        }
        (Number::Integer(negative @ ..0), Some(64)) => {
            let literal = self::number(&format!("{negative}_i64"));
            quote!(#literal as u64)
        }
        (Number::Integer(integer @ 0..), _) => spelled(integer, context.is_hex(entry)),
        _ => spelled(raw.into(), true),
    }
}

/// The integer as a literal, spelled as by [`integer`].
pub(super) fn spelled(number: i128, in_hex: bool) -> TokenStream {
    let literal = self::number(&integer(number, in_hex));
    quote!(#literal)
}

/// A condition; the number is in the wire form of the entry that it compares.
pub(super) fn condition(context: &Context<'_>, condition: &Condition) -> TokenStream {
    let value = context.plan.entry(condition.index, condition.sub).and_then(|entry| {
        let number = fitting(&Value::Integer(condition.value), entry.data_type)?;
        Some(wire_form(context, entry, number))
    });
    let value = value.unwrap_or_else(|| spelled((condition.value as u64).into(), false));
    let (path, address, equal) =
        (context.object("Condition"), address(condition.index, condition.sub), condition.equal);
    quote!(#path::new(#address, #equal, #value))
}

pub(super) fn rust_type(context: &Context<'_>, data_type: DataType) -> TokenStream {
    use DataType as D;
    match data_type {
        D::Boolean => quote!(bool),
        D::Integer8 => quote!(i8),
        D::Integer16 => quote!(i16),
        D::Integer32 => quote!(i32),
        D::Integer64 => quote!(i64),
        D::Unsigned8 => quote!(u8),
        D::Unsigned16 => quote!(u16),
        D::Unsigned32 => quote!(u32),
        D::Unsigned64 => quote!(u64),
        D::Real32 => quote!(f32),
        D::Real64 => quote!(f64),
        other => context.object(runtime_type(other)),
    }
}

/// The variant of the runtime's `DataType`.
pub(super) fn data_type(data_type: DataType) -> Ident {
    match data_type {
        DataType::Other(_) => format_ident!("OctetString"),
        known => format_ident!("{}", format!("{known:?}")),
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
    /// The path of a type.
    pub(super) fn r#type(&self, r#type: Type) -> TokenStream {
        match r#type {
            Type::Plain(data_type) => rust_type(self, data_type),
            Type::Newtype(row) => {
                let ident = format_ident!("{}", self.plan.newtypes[row].ident);
                quote!(#ident)
            }
        }
    }

    /// A value of a type; integers in hexadecimal if the data sheet writes them so.
    pub(super) fn value(&self, r#type: Type, number: Number, in_hex: bool) -> TokenStream {
        match r#type {
            Type::Plain(data_type) => self.plain_value(data_type, number, in_hex),
            Type::Newtype(row) => {
                let newtype = &self.plan.newtypes[row];
                let ident = format_ident!("{}", newtype.ident);
                let value = self.plain_value(newtype.data_type, number, in_hex);
                quote!(#ident(#value))
            }
        }
    }

    fn plain_value(&self, data_type: DataType, number: Number, in_hex: bool) -> TokenStream {
        let integer = match number {
            Number::Real(real) => return float(data_type, real),
            Number::Integer(integer) => integer,
        };
        match data_type {
            DataType::Boolean => {
                let is_true = integer != 0;
                quote!(#is_true)
            }
            DataType::TimeOfDay | DataType::TimeDifference => {
                let name = rust_type(self, data_type);
                let [days, ms] = [integer >> 32 & 0xFFFF, integer & 0x0FFF_FFFF].map(|it| spelled(it, false));
                quote!(#name { days: #days, ms: #ms })
            }
            _ => {
                let digits = spelled(integer, in_hex);
                let in_a_type_of_the_runtime = runtime_type(data_type).starts_with(['I', 'U']);
                if in_a_type_of_the_runtime {
                    let name = rust_type(self, data_type);
                    quote!(#name::literal(#digits))
                } else {
                    digits
                }
            }
        }
    }
}

/// A literal of a finite number.
fn float(data_type: DataType, real: f64) -> TokenStream {
    let digits = if data_type == DataType::Real32 { format!("{:?}", real as f32) } else { format!("{real:?}") };
    let literal = number(&digits);
    quote!(#literal)
}
