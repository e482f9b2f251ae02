//! Numbers and types of leaves, as a data sheet prints them.

use std::f64::consts;

use lexican_eds::types::DataType;
use proc_macro2::{Literal, TokenStream};
use quote::{format_ident, quote};

use super::Context;
use crate::plan::{Number, Type};

/// `0x1018`.
pub(super) fn hex(value: impl Into<u64>, digits: usize) -> Literal {
    parse(&format!("0x{:0digits$X}", value.into()))
}

/// A number without a type suffix.
pub(super) fn decimal(value: i128) -> TokenStream {
    let digits = Literal::u128_unsuffixed(value.unsigned_abs());
    if value < 0 { quote!(-#digits) } else { quote!(#digits) }
}

/// The Rust type of a data type.
pub(super) fn rust_type(object: &TokenStream, data_type: DataType) -> TokenStream {
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
        other => {
            let name = format_ident!("{}", runtime_type(other));
            return quote!(#object::#name);
        }
    };
    let primitive = format_ident!("{primitive}");
    quote!(#primitive)
}

/// The variant of the runtime's `DataType`.
pub(super) fn data_type(object: &TokenStream, data_type: DataType) -> TokenStream {
    let name = match data_type {
        DataType::Other(_) => "OctetString".to_owned(),
        known => format!("{known:?}"),
    };
    let name = format_ident!("{name}");
    quote!(#object::DataType::#name)
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

/// Whether the number stands in a type of the runtime, and not in one of the language.
pub(super) fn is_wrapped(data_type: DataType) -> bool {
    runtime_type(data_type).starts_with(['I', 'U'])
}

impl Context<'_> {
    /// A value of a type; integers in hexadecimal where the data sheet has them so.
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

    pub(super) fn plain_value(&self, data_type: DataType, number: Number, in_hex: bool) -> TokenStream {
        let integer = match number {
            Number::Real(real) => return float(data_type, real),
            Number::Integer(integer) => integer,
        };
        let object = &self.object;
        match data_type {
            DataType::Boolean if integer != 0 => quote!(true),
            DataType::Boolean => quote!(false),
            DataType::TimeOfDay | DataType::TimeDifference => {
                let name = rust_type(object, data_type);
                let (days, ms) = (decimal(integer >> 32 & 0xFFFF), decimal(integer & 0x0FFF_FFFF));
                quote!(#name { days: #days, ms: #ms })
            }
            _ => {
                let digits = match u64::try_from(integer) {
                    Ok(value) if in_hex => {
                        let hex = hex(value, data_type.bits().map_or(1, |bits| usize::from(bits).div_ceil(4)));
                        quote!(#hex)
                    }
                    _ => decimal(integer),
                };
                if !is_wrapped(data_type) {
                    return digits;
                }
                let name = rust_type(object, data_type);
                quote!(#name::literal(#digits))
            }
        }
    }
}

/// A finite number.
fn float(data_type: DataType, real: f64) -> TokenStream {
    let is_single = data_type == DataType::Real32;
    // clippy takes a number near a famous constant for that constant (`approx_constant`).
    let is_famous = FAMOUS.iter().any(|famous| (real.abs() - famous).abs() < 0.01) && real.fract() != 0.0;
    if is_famous && is_single {
        let bits = hex((real as f32).to_bits(), 8);
        quote!(f32::from_bits(#bits))
    } else if is_famous {
        let bits = hex(real.to_bits(), 16);
        quote!(f64::from_bits(#bits))
    } else {
        let magnitude = if is_single { format!("{:?}", (real as f32).abs()) } else { format!("{:?}", real.abs()) };
        let digits = parse(&magnitude);
        if real.is_sign_negative() { quote!(-#digits) } else { quote!(#digits) }
    }
}

/// The constants that clippy knows.
const FAMOUS: &[f64] = &[
    consts::E,
    consts::FRAC_1_PI,
    consts::FRAC_1_SQRT_2,
    consts::FRAC_2_PI,
    consts::FRAC_2_SQRT_PI,
    consts::FRAC_PI_2,
    consts::FRAC_PI_3,
    consts::FRAC_PI_4,
    consts::FRAC_PI_6,
    consts::FRAC_PI_8,
    consts::LN_2,
    consts::LN_10,
    consts::LOG10_2,
    consts::LOG10_E,
    consts::LOG2_10,
    consts::LOG2_E,
    consts::PI,
    consts::SQRT_2,
    consts::TAU,
    // The golden ratio and the constant of Euler and Mascheroni are not stable in std yet.
    1.618_033_988_749_895,
    0.577_215_664_901_532_9,
];

fn parse(digits: &str) -> Literal {
    digits.parse().expect("digits are a literal")
}
