//! An object that holds a whole number of any width.

use lexican_runtime::object::{Address, DataType, Object, OutOfRange, Type};

/// An object that holds a whole number: address, width, sign, and the limits of the data sheet.
///
/// Drives keep the same quantity in different types (1002h has 16 or 32 bits), so the sequences calculate in `i64`.
/// [`Number::of`] makes a `Number` of a generated handle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Number {
    address: Address,
    data_type: DataType,
    range: Option<(i64, i64)>,
}

impl Number {
    /// A number at an address.
    ///
    /// # Panics
    ///
    /// If the data type is not an integer of 1, 2, 4 or 8 bytes. In a constant this is a compile error.
    #[must_use]
    pub const fn new(index: u16, sub: u8, data_type: DataType) -> Self {
        assert!(is_whole(data_type), "a number is an integer of one, two, four or eight bytes");
        Number { address: Address::new(index, sub), data_type, range: None }
    }

    /// The number of a handle, without its limits: see [`Number::within`].
    ///
    /// # Panics
    ///
    /// As [`Number::new`].
    #[must_use]
    pub const fn of<T: Type, A, M, D>(object: Object<T, A, M, D>) -> Self {
        Number::new(object.address().index(), object.address().sub(), T::DATA_TYPE)
    }

    /// With the limits of the data sheet.
    #[must_use]
    pub const fn within(self, low: i64, high: i64) -> Self {
        Number { range: Some((low, high)), ..self }
    }

    /// The number at another sub-index of the same object.
    #[must_use]
    pub const fn at_sub(self, sub: u8) -> Self {
        Number { address: Address::new(self.address.index(), sub), ..self }
    }

    /// Index and sub-index.
    #[must_use]
    pub const fn address(&self) -> Address {
        self.address
    }

    /// In bytes on the wire: 1, 2, 4 or 8.
    #[must_use]
    pub const fn size(&self) -> usize {
        match self.data_type.size() {
            Some(size) => size,
            None => 4,
        }
    }

    /// Whether the data sheet allows `value` and the data type can hold it.
    pub fn check(&self, value: i64) -> Result<(), OutOfRange> {
        let (low, high) = self.type_range();
        let (low, high) = self.range.map_or((low, high), |(least, most)| (low.max(least), high.min(most)));
        match value {
            value if value < low => Err(OutOfRange { address: self.address, above: false }),
            value if value > high => Err(OutOfRange { address: self.address, above: true }),
            _ => Ok(()),
        }
    }

    /// Whether an `i32` can hold every value of the data type, as the driver has positions and velocities.
    pub(super) fn fits_i32(&self) -> bool {
        let (low, high) = self.type_range();
        low >= i32::MIN.into() && high <= i32::MAX.into()
    }

    /// What the data type can hold. Eight bytes hold every `i64`; an UNSIGNED64 above `i64::MAX` becomes a negative
    /// number, and is encoded to the same bytes again.
    fn type_range(&self) -> (i64, i64) {
        let bits = 8 * self.size() as u32;
        match self.data_type.is_signed() {
            _ if bits == 64 => (i64::MIN, i64::MAX),
            true => (-1 << (bits - 1), (1 << (bits - 1)) - 1),
            false => (0, (1 << bits) - 1),
        }
    }

    /// The number that has this wire form, which is little-endian in the low bytes.
    pub(crate) fn decode(self, raw: u64) -> i64 {
        let unused = 64 - 8 * self.size() as u32;
        if self.data_type.is_signed() { (raw << unused) as i64 >> unused } else { (raw << unused >> unused) as i64 }
    }

    /// The wire form of a number.
    pub(crate) fn encode(self, value: i64) -> u64 {
        let unused = 64 - 8 * self.size() as u32;
        (value as u64) << unused >> unused
    }
}

const fn is_whole(data_type: DataType) -> bool {
    use DataType as D;
    matches!(
        data_type,
        D::Integer8
            | D::Integer16
            | D::Integer32
            | D::Integer64
            | D::Unsigned8
            | D::Unsigned16
            | D::Unsigned32
            | D::Unsigned64
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sign_is_extended_and_cut_off_again() {
        for (data_type, raw, value) in [
            (DataType::Integer8, 0xFF, -1),
            (DataType::Unsigned8, 0xFF, 255),
            (DataType::Integer16, 0x8000, -0x8000),
            (DataType::Integer32, 0xFFFF_EC78, -5000),
            (DataType::Unsigned32, 0xFFFF_FFFF, 0xFFFF_FFFF),
            (DataType::Integer64, u64::MAX, -1),
        ] {
            let number = Number::new(0x2000, 0x00, data_type);
            assert_eq!((number.decode(raw), number.encode(value)), (value, raw), "{data_type}");
        }
        assert_eq!(Number::new(0x2000, 0x00, DataType::Unsigned16).decode(0xFFFF_1234), 0x1234, "upper bits");
    }

    #[test]
    fn what_the_data_type_has_no_room_for_is_not_cut_off_but_refused() {
        for (data_type, low, high) in [
            (DataType::Integer8, -0x80, 0x7F),
            (DataType::Unsigned8, 0, 0xFF),
            (DataType::Unsigned16, 0, 0xFFFF),
            (DataType::Integer32, i32::MIN.into(), i32::MAX.into()),
            (DataType::Unsigned32, 0, u32::MAX.into()),
        ] {
            let number = Number::new(0x2000, 0x00, data_type);
            let beyond = |above| Err(OutOfRange { address: number.address(), above });
            assert_eq!((number.check(low), number.check(high)), (Ok(()), Ok(())), "{data_type}");
            assert_eq!((number.check(low - 1), number.check(high + 1)), (beyond(false), beyond(true)), "{data_type}");
        }
        let number = Number::new(0x2000, 0x00, DataType::Unsigned8).within(-10, 1000);
        assert_eq!(number.check(256), Err(OutOfRange { address: number.address(), above: true }));
        assert_eq!(Number::new(0x2000, 0x00, DataType::Unsigned64).check(-1), Ok(()));
    }

    #[test]
    fn limits_are_checked_before_anything_is_sent() {
        let number = Number::new(0x607A, 0x00, DataType::Integer32).within(-10, 10);
        assert_eq!(number.check(10), Ok(()));
        assert_eq!(number.check(11), Err(OutOfRange { address: number.address(), above: true }));
        assert_eq!(number.check(-11), Err(OutOfRange { address: number.address(), above: false }));
    }
}
