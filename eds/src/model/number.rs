//! Numbers of a data sheet as values of a data type.

use super::Value;
use super::types::{Class, DataType};

/// A value of a fixed-size data type.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Number {
    /// An integer, a BOOLEAN or a time.
    Integer(i128),
    /// A REAL32 or REAL64.
    Real(f64),
}

impl Number {
    /// Whether it is less than another; false for numbers of different kinds.
    #[must_use]
    pub fn is_below(self, other: Number) -> bool {
        match (self, other) {
            (Number::Integer(a), Number::Integer(b)) => a < b,
            (Number::Real(a), Number::Real(b)) => a < b,
            _ => false,
        }
    }
}

/// The value in the range of `data_type`; `None` if it is outside or of another kind.
#[must_use]
pub fn fitting(value: &Value, data_type: DataType) -> Option<Number> {
    match (value, data_type.class()) {
        (&Value::Integer(integer), Class::Real) => real(integer as f64, data_type),
        (&Value::Integer(integer), _) => data_type.fit(integer).map(Number::Integer),
        (&Value::Real(number), Class::Real) => real(number, data_type),
        _ => None,
    }
}

/// Whether `base` plus the node-ID is in the range of `data_type` for every node-ID.
#[must_use]
pub fn fits_every_node(base: i64, data_type: DataType) -> bool {
    let base = i128::from(base);
    data_type.range().is_some_and(|(low, high)| low <= base + 1 && base + 127 <= high)
}

/// `None` if a REAL32 would round the number to infinity.
fn real(number: f64, data_type: DataType) -> Option<Number> {
    let held = if data_type == DataType::Real32 { f64::from(number as f32) } else { number };
    held.is_finite().then_some(Number::Real(number))
}

/// The wire form, a little-endian number; bits beyond the data type are zero.
#[must_use]
pub fn raw(number: Number, data_type: DataType) -> u64 {
    let bits = u32::from(data_type.bits().unwrap_or(64));
    match (number, data_type) {
        (Number::Real(real), DataType::Real32) => u64::from((real as f32).to_bits()),
        (Number::Real(real), _) => real.to_bits(),
        (Number::Integer(integer), _) => integer as u64 & (u64::MAX >> (64 - bits)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integers_take_the_form_of_their_type() {
        let check = |integer, data_type, expected: Option<i128>| {
            assert_eq!(fitting(&Value::Integer(integer), data_type), expected.map(Number::Integer));
        };
        check(0xFFFF, DataType::Integer16, Some(-1));
        check(0x8000, DataType::Integer16, Some(-0x8000));
        check(0x1_0000, DataType::Integer16, None);
        check(-1, DataType::Unsigned8, None);
        check(2, DataType::Boolean, None);
        check(1, DataType::VisibleString, None);
        let reals =
            |number| [DataType::Real32, DataType::Real64].map(|real| fitting(&Value::Real(number), real).is_some());
        assert_eq!(reals(3.4e38), [true, true]);
        assert_eq!((reals(-1e39), reals(f64::INFINITY)), ([false, true], [false, false]));
        assert_eq!(fitting(&Value::Integer(i128::MAX), DataType::Real32), Some(Number::Real(i128::MAX as f64)));
        assert_eq!(raw(Number::Integer(-2), DataType::Integer24), 0xFF_FFFE);
        assert_eq!(raw(Number::Real(-1.5), DataType::Real32), 0xBFC0_0000);
    }
}
