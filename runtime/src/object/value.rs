//! Values of objects: what a Rust type means on the wire.
//!
//! Every value of a fixed size fits into 64 bits. So its wire form is a `u64` of which the low
//! [`DataType::size`] bytes travel, little-endian (CiA 301, 7.1.4), and one place converts it.

use core::fmt;

use super::DataType;

/// What an object can be typed as: a [`Value`], or a marker such as [`VisibleString`].
pub trait Type: Copy + 'static {
    /// The data type of CiA 301.
    const DATA_TYPE: DataType;
}

/// A value of a fixed size.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a value of a fixed size",
    label = "text, bytes and domains have no such value",
    note = "read or write its bytes instead"
)]
pub trait Value: Type + PartialOrd + fmt::Debug {
    /// The bytes that an SDO transfers.
    const SIZE: usize = match Self::DATA_TYPE.size() {
        Some(size) => size,
        None => panic!("a value has a fixed size"),
    };

    /// The wire form; bits beyond the data type's are zero.
    fn to_raw(self) -> u64;

    /// The value of a wire form; bits beyond the data type's are ignored.
    fn from_raw(raw: u64) -> Self;

    /// The bytes of an SDO transfer: the first [`Value::SIZE`] of them.
    fn to_bytes(self) -> [u8; 8] {
        self.to_raw().to_le_bytes()
    }

    /// The value of exactly [`Value::SIZE`] bytes.
    fn from_bytes(bytes: &[u8]) -> Result<Self, LengthMismatch> {
        let mut raw = [0; 8];
        match raw.get_mut(..bytes.len()) {
            Some(low) if bytes.len() == Self::SIZE => low.copy_from_slice(bytes),
            _ => return Err(LengthMismatch { expected: Self::SIZE, got: bytes.len() }),
        }
        Ok(Self::from_raw(u64::from_le_bytes(raw)))
    }
}

/// The bytes do not have the length of the data type.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[error("expected {expected} bytes, got {got}")]
#[allow(missing_docs, reason = "the names say what it is")]
pub struct LengthMismatch {
    pub expected: usize,
    pub got: usize,
}

macro_rules! integers {
    ($($ty:ty, $unsigned:ty, $data_type:ident;)*) => {$(
        impl Type for $ty {
            const DATA_TYPE: DataType = DataType::$data_type;
        }
        impl Value for $ty {
            #[inline]
            fn to_raw(self) -> u64 {
                // Through the unsigned type of the same width: a sign must not reach the upper bytes.
                u64::from(self as $unsigned)
            }
            #[inline]
            fn from_raw(raw: u64) -> Self {
                raw as $ty
            }
        }
    )*};
}

integers! {
    i8, u8, Integer8;
    i16, u16, Integer16;
    i32, u32, Integer32;
    i64, u64, Integer64;
    u8, u8, Unsigned8;
    u16, u16, Unsigned16;
    u32, u32, Unsigned32;
    u64, u64, Unsigned64;
}

impl Type for bool {
    const DATA_TYPE: DataType = DataType::Boolean;
}
/// A BOOLEAN is one bit; on the wire of an SDO any other bits of its byte are ignored.
impl Value for bool {
    fn to_raw(self) -> u64 {
        u64::from(self)
    }
    fn from_raw(raw: u64) -> Self {
        raw & 1 != 0
    }
}

impl Type for f32 {
    const DATA_TYPE: DataType = DataType::Real32;
}
impl Value for f32 {
    fn to_raw(self) -> u64 {
        u64::from(self.to_bits())
    }
    fn from_raw(raw: u64) -> Self {
        f32::from_bits(raw as u32)
    }
}

impl Type for f64 {
    const DATA_TYPE: DataType = DataType::Real64;
}
impl Value for f64 {
    fn to_raw(self) -> u64 {
        self.to_bits()
    }
    fn from_raw(raw: u64) -> Self {
        f64::from_bits(raw)
    }
}

macro_rules! odd_integers {
    ($($name:ident($repr:ty), $bits:literal, $data_type:ident, $doc:literal;)*) => {$(
        #[doc = $doc]
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        pub struct $name($repr);

        impl $name {
            /// The smallest value.
            pub const MIN: $name = $name(<$repr>::MIN >> (<$repr>::BITS - $bits));
            /// The largest value.
            pub const MAX: $name = $name(<$repr>::MAX >> (<$repr>::BITS - $bits));

            /// `None` when `value` does not fit.
            pub const fn new(value: $repr) -> Option<Self> {
                if value >= Self::MIN.0 && value <= Self::MAX.0 { Some($name(value)) } else { None }
            }

            /// A value written in the source.
            ///
            /// # Panics
            ///
            /// When `value` does not fit: at compile time in a constant.
            #[must_use]
            pub const fn literal(value: $repr) -> Self {
                match $name::new(value) {
                    Some(value) => value,
                    None => panic!(concat!("the value does not fit into ", stringify!($bits), " bits")),
                }
            }

            /// The value of a wire form; upper bits are ignored.
            #[must_use]
            pub const fn from_low_bits(raw: u64) -> Self {
                // Shifting up and down again extends the sign, where there is one.
                let up = <$repr>::BITS - $bits;
                $name(((raw as $repr) << up) >> up)
            }

            /// The number.
            #[must_use]
            pub const fn get(self) -> $repr {
                self.0
            }
        }

        impl Type for $name {
            const DATA_TYPE: DataType = DataType::$data_type;
        }
        impl Value for $name {
            fn to_raw(self) -> u64 {
                (self.0 as u64) & (u64::MAX >> (64 - $bits))
            }
            fn from_raw(raw: u64) -> Self {
                $name::from_low_bits(raw)
            }
        }
        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                fmt::Display::fmt(&self.0, f)
            }
        }
    )*};
}

odd_integers! {
    I24(i32), 24, Integer24, "An INTEGER24.";
    I40(i64), 40, Integer40, "An INTEGER40.";
    I48(i64), 48, Integer48, "An INTEGER48.";
    I56(i64), 56, Integer56, "An INTEGER56.";
    U24(u32), 24, Unsigned24, "An UNSIGNED24.";
    U40(u64), 40, Unsigned40, "An UNSIGNED40.";
    U48(u64), 48, Unsigned48, "An UNSIGNED48.";
    U56(u64), 56, Unsigned56, "An UNSIGNED56.";
}

macro_rules! times {
    ($($name:ident, $data_type:ident, $days:literal, $doc:literal;)*) => {$(
        #[doc = $doc]
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        pub struct $name {
            #[doc = $days]
            pub days: u16,
            /// Milliseconds; the wire has 28 bits for them.
            pub ms: u32,
        }

        impl Type for $name {
            const DATA_TYPE: DataType = DataType::$data_type;
        }
        impl Value for $name {
            fn to_raw(self) -> u64 {
                u64::from(self.ms & 0x0FFF_FFFF) | u64::from(self.days) << 32
            }
            fn from_raw(raw: u64) -> Self {
                $name { days: (raw >> 32) as u16, ms: raw as u32 & 0x0FFF_FFFF }
            }
        }
    )*};
}

times! {
    TimeOfDay, TimeOfDay, "Days since 1 January 1984.", "A point in time (CiA 301, 7.1.6.5).";
    TimeDifference, TimeDifference, "Whole days.", "A span of time (CiA 301, 7.1.6.6).";
}

macro_rules! markers {
    ($($name:ident, $doc:literal;)*) => {$(
        #[doc = $doc]
        #[derive(Clone, Copy, Debug)]
        pub enum $name {}
        impl Type for $name {
            const DATA_TYPE: DataType = DataType::$name;
        }
    )*};
}

markers! {
    VisibleString, "Marks objects that hold text in ISO 646 or, in practice, ISO 8859-1.";
    OctetString, "Marks objects that hold bytes.";
    UnicodeString, "Marks objects that hold text in UCS-2.";
    Domain, "Marks objects that hold a block of data of any size.";
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check<T: Value>(value: T, bytes: &[u8]) {
        assert_eq!(&value.to_bytes()[..T::SIZE], bytes);
        assert_eq!(value.to_bytes()[T::SIZE..], [0; 8][T::SIZE..]);
        assert_eq!(T::from_bytes(bytes), Ok(value));
    }

    #[test]
    fn values_travel_little_endian() {
        check(-5000_i32, &[0x78, 0xEC, 0xFF, 0xFF]);
        check(-1_i8, &[0xFF]);
        check(0x9C4_u16, &[0xC4, 0x09]);
        check(I24::literal(-2), &[0xFE, 0xFF, 0xFF]);
        check(U56::MAX, &[0xFF; 7]);
        check(true, &[1]);
        check(1.0_f32, &[0, 0, 0x80, 0x3F]);
        check(TimeOfDay { days: 0x0102, ms: 0x0304_0506 }, &[6, 5, 4, 3, 2, 1]);
    }

    #[test]
    fn a_wrong_length_is_an_error() {
        assert_eq!(u16::from_bytes(&[1]), Err(LengthMismatch { expected: 2, got: 1 }));
        assert_eq!(u16::from_bytes(&[1; 9]), Err(LengthMismatch { expected: 2, got: 9 }));
    }

    #[test]
    fn odd_widths_know_their_range() {
        assert_eq!((I24::MIN.get(), I24::MAX.get()), (-8_388_608, 8_388_607));
        assert_eq!(U24::new(1 << 24), None);
        assert_eq!(I56::new(i64::MIN), None);
    }
}
