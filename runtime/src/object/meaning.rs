//! What a number means beyond being a number: names of values, names of bits, units. The generated
//! newtypes bring the tables; [`text`](super::text) reads and prints them.

use core::fmt;

use super::{Address, DataType, Value};

/// What tools show of an entry: one row of the generated `NAMES`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "the names say what it is")]
pub struct Name {
    pub address: Address,
    /// In the words of the data sheet; of an element or member, after that of its object and a colon.
    pub name: &'static str,
    pub data_type: DataType,
    pub meaning: Meaning<'static>,
}

impl Name {
    /// The name of the entry `index`:`sub`.
    #[must_use]
    pub const fn new(index: u16, sub: u8, name: &'static str, data_type: DataType, meaning: Meaning<'static>) -> Self {
        Name { address: Address::new(index, sub), name, data_type, meaning }
    }

    /// The row of an entry in `names`, which ascend by address.
    #[must_use]
    pub fn find(names: &'static [Name], address: Address) -> Option<&'static Name> {
        let row = names.binary_search_by_key(&address, |name| name.address).ok()?;
        names.get(row)
    }
}

/// What a number means.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Meaning<'a> {
    /// Just a number, or no number at all.
    Plain,
    /// A physical quantity in one of these units; in the first whose condition holds.
    Quantity(&'a [Unit<'a>]),
    /// One of these values.
    Enumeration(&'a [ValueName<'a>]),
    /// These bits.
    BitField(&'a [BitName<'a>]),
}

/// A newtype for named values.
pub trait Enumeration: Value {
    /// The named values, ascending.
    const NAMES: &'static [ValueName<'static>];
}

/// A newtype for a word of bits.
pub trait BitField: Value {
    /// The named bits, ascending.
    const BITS: &'static [BitName<'static>];
}

/// A newtype for a physical quantity.
pub trait Quantity: Value {
    /// The units; more than one only when other objects decide.
    const UNITS: &'static [Unit<'static>];
}

/// A value and its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ValueName<'a> {
    /// The value, in wire form.
    pub raw: u64,
    /// In the words of the data sheet.
    pub name: &'a str,
}

impl<'a> ValueName<'a> {
    /// A name for a value in wire form.
    #[must_use]
    pub const fn new(raw: u64, name: &'a str) -> Self {
        ValueName { raw, name }
    }
}

/// Neighbouring bits and their name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "the names say what it is")]
pub struct BitName<'a> {
    pub low: u8,
    pub width: u8,
    /// In the words of the data sheet.
    pub name: &'a str,
}

impl<'a> BitName<'a> {
    /// A name for `width` bits from bit `low` on.
    #[must_use]
    pub const fn new(low: u8, width: u8, name: &'a str) -> Self {
        BitName { low, width, name }
    }
}

/// A physical unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Unit<'a> {
    /// As people write it: `V`, `°C`, `rev/min`.
    pub symbol: &'a str,
    /// What one count is worth: `num / den` of the unit.
    pub num: i64,
    /// See `num`.
    pub den: i64,
    /// When it applies only sometimes.
    pub when: Option<super::Condition>,
}

impl<'a> Unit<'a> {
    /// A unit of which one count is worth `num / den`.
    #[must_use]
    pub const fn new(symbol: &'a str, num: i64, den: i64) -> Self {
        Unit { symbol, num, den, when: None }
    }

    /// Which applies only while `condition` holds.
    #[must_use]
    pub const fn when(self, condition: super::Condition) -> Self {
        Unit { when: Some(condition), ..self }
    }

    /// `counts` in this unit.
    #[must_use]
    pub fn scale(&self, counts: f64) -> f64 {
        // Multiply, then divide: 3 counts of 1/10 are 0.3, where 3 * 0.1 is not.
        counts * self.num as f64 / self.den as f64
    }
}

/// A number in the wire form of a data type: bits beyond the data type's are zero.
#[must_use]
pub const fn wire_form(data_type: DataType, number: i128) -> u64 {
    match data_type.bits() {
        Some(bits @ 1..64) => number as u64 & ((1 << bits) - 1),
        _ => number as u64,
    }
}

/// The name of a value of an enumeration.
#[must_use]
pub fn name_of<T: Enumeration>(value: T) -> Option<&'static str> {
    let raw = value.to_raw();
    T::NAMES.iter().find(|named| named.raw == raw).map(|named| named.name)
}

/// The value whose number of counts is nearest to `counts`, half away from zero; `None` when the data
/// type does not reach that far, or `counts` is not a number.
#[must_use]
pub fn nearest<T: Value>(counts: f64) -> Option<T> {
    nearest_raw(T::DATA_TYPE, counts).map(T::from_raw)
}

pub(super) fn nearest_raw(data_type: DataType, counts: f64) -> Option<u64> {
    match data_type {
        DataType::Real64 => return counts.is_finite().then(|| counts.to_bits()),
        DataType::Real32 => {
            let counts = counts as f32;
            return counts.is_finite().then(|| u64::from(counts.to_bits()));
        }
        _ => {}
    }
    // Casts truncate and saturate. 2^63 and 2^64 are exact in f64, so that what reaches them is out of range
    // and what lies below is not saturated.
    let bits = data_type.bits()?;
    let away = if counts < 0.0 { -0.5 } else { 0.5 };
    // From 2^52 on every f64 is whole, and adding a half would round to the neighbour.
    let whole = if counts.abs() < 4_503_599_627_370_496.0 { counts + away } else { counts };
    let (low, high) = match data_type.is_signed() {
        true => (-power_of_two(bits - 1), power_of_two(bits - 1)),
        false => (0.0, power_of_two(bits)),
    };
    if !((whole >= low || whole > low - 1.0) && whole < high) {
        return None;
    }
    let raw = if data_type.is_signed() { whole as i64 as u64 } else { whole as u64 };
    Some(raw & (u64::MAX >> (64 - u32::from(bits))))
}

fn power_of_two(exponent: u8) -> f64 {
    // The exponent of IEEE 754 is biased by 1023 and starts at bit 52.
    f64::from_bits((1023 + u64::from(exponent)) << 52)
}

/// An integer in wire form as its value.
pub(super) fn whole(data_type: DataType, raw: u64) -> i128 {
    let up = 64 - u32::from(data_type.bits().unwrap_or(64));
    if data_type.is_signed() { i128::from(((raw << up) as i64) >> up) } else { i128::from(raw) }
}

/// A number in wire form as its value.
pub(super) fn counts(data_type: DataType, raw: u64) -> f64 {
    match data_type {
        DataType::Real32 => f64::from(f32::from_bits(raw as u32)),
        DataType::Real64 => f64::from_bits(raw),
        _ => whole(data_type, raw) as f64,
    }
}

/// Prints a value of an enumeration: `Mode(1 velocity)`.
pub fn debug_enumeration<T: Enumeration>(
    f: &mut fmt::Formatter<'_>,
    type_name: &str,
    value: T,
    number: impl fmt::Display,
) -> fmt::Result {
    match name_of(value) {
        Some(name) => write!(f, "{type_name}({number} {name})"),
        None => write!(f, "{type_name}({number})"),
    }
}

#[cfg(test)]
mod tests {
    #![allow(unreachable_pub, reason = "generated types are public")]

    use super::*;
    use crate::object::{I24, U24};
    use proptest::prelude::*;
    use std::format;

    #[test]
    fn the_nearest_value_is_rounded_half_away_from_zero() {
        assert_eq!(nearest::<i16>(2.5), Some(3));
        assert_eq!(nearest::<i16>(-2.5), Some(-3));
        assert_eq!(nearest::<u8>(0.49), Some(0));
        assert_eq!(nearest::<u8>(-0.4), Some(0));
        assert_eq!(nearest::<u64>(9_007_199_254_740_993.0), Some(9_007_199_254_740_992));
        assert_eq!(nearest::<f32>(0.5), Some(0.5));
    }

    #[test]
    fn what_the_type_cannot_hold_is_none() {
        assert_eq!(nearest::<u8>(255.4), Some(255));
        assert_eq!(nearest::<u8>(255.5), None);
        assert_eq!(nearest::<u8>(-0.5), None);
        assert_eq!(nearest::<i8>(-128.4), Some(-128));
        assert_eq!(nearest::<i8>(-128.5), None);
        assert_eq!(nearest::<I24>(8_388_608.0), None);
        assert_eq!(nearest::<U24>(16_777_215.0), Some(U24::MAX));
        assert_eq!(nearest::<u64>(18_446_744_073_709_551_616.0), None);
        assert_eq!(nearest::<i64>(-9_223_372_036_854_775_808.0), Some(i64::MIN));
        for counts in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert_eq!((nearest::<i64>(counts), nearest::<f32>(counts)), (None, None));
        }
    }

    proptest! {
        #[test]
        fn every_value_is_nearest_to_itself(value: i32) {
            prop_assert_eq!(nearest::<i32>(f64::from(value)), Some(value));
        }
    }

    #[test]
    fn a_wire_form_is_read_as_its_type() {
        assert_eq!(counts(DataType::Integer24, 0xFF_FFFE), -2.0);
        assert_eq!(counts(DataType::Unsigned64, u64::MAX), 18_446_744_073_709_551_615.0);
        assert_eq!(counts(DataType::Real32, 0x3FC0_0000), 1.5);
    }

    #[test]
    fn powers_of_two_are_exact() {
        assert_eq!(power_of_two(0), 1.0);
        assert_eq!(power_of_two(63), 9_223_372_036_854_775_808.0);
    }

    crate::bit_field! {
        /// Bits.
        pub struct Word(u16): Unsigned16 {
            ready: bool = 0, "ready";
            mode: u8 = 8..=9, "mode";
        }
    }

    crate::enumeration! {
        /// Values.
        pub struct Mode(u16): Unsigned16 {
            VELOCITY = 2, "velocity";
        }
    }

    crate::quantity! {
        /// Units.
        pub struct Voltage(u16): Unsigned16 {
            /// In V, 1/10 per count.
            volts, from_volts = "V", 1 / 10;
        }
    }

    #[test]
    fn values_print_in_the_words_of_the_data_sheet() {
        assert_eq!(format!("{:?}", Word(0x0201)), "Word(0x0201 ready + mode 2)");
        assert_eq!(format!("{:?}", Word(0)), "Word(0x0000)");
        assert_eq!((Word(0x0201).ready(), Word(0x0201).mode()), (true, 2));
        assert_eq!((format!("{}", Voltage(243)), format!("{:.2}", Voltage(243))), ("24.3 V".into(), "24.30 V".into()));
        assert_eq!((Voltage(243).volts(), Voltage::from_volts(24.3)), (24.3, Some(Voltage(243))));
        assert_eq!(
            (format!("{:?}", Mode::VELOCITY), format!("{:?}", Mode(7))),
            ("Mode(2 velocity)".into(), "Mode(7)".into())
        );
    }
}
