//! The static data types of CiA 301 (7.4.7, table 44).

use core::fmt;
use core::num::NonZeroU8;

/// Passes the rows of all data types, ascending by code, to a macro: `name = code, name in CiA 301, bits, class;`.
#[doc(hidden)]
#[macro_export]
macro_rules! data_types {
    ($then:ident) => {
        $then! {
            Boolean = 0x01, "BOOLEAN", Some(1), Boolean;
            Integer8 = 0x02, "INTEGER8", Some(8), Signed;
            Integer16 = 0x03, "INTEGER16", Some(16), Signed;
            Integer32 = 0x04, "INTEGER32", Some(32), Signed;
            Unsigned8 = 0x05, "UNSIGNED8", Some(8), Unsigned;
            Unsigned16 = 0x06, "UNSIGNED16", Some(16), Unsigned;
            Unsigned32 = 0x07, "UNSIGNED32", Some(32), Unsigned;
            Real32 = 0x08, "REAL32", Some(32), Real;
            VisibleString = 0x09, "VISIBLE_STRING", None, Text;
            OctetString = 0x0A, "OCTET_STRING", None, Bytes;
            UnicodeString = 0x0B, "UNICODE_STRING", None, Text;
            TimeOfDay = 0x0C, "TIME_OF_DAY", Some(48), Time;
            TimeDifference = 0x0D, "TIME_DIFFERENCE", Some(48), Time;
            Domain = 0x0F, "DOMAIN", None, Bytes;
            Integer24 = 0x10, "INTEGER24", Some(24), Signed;
            Real64 = 0x11, "REAL64", Some(64), Real;
            Integer40 = 0x12, "INTEGER40", Some(40), Signed;
            Integer48 = 0x13, "INTEGER48", Some(48), Signed;
            Integer56 = 0x14, "INTEGER56", Some(56), Signed;
            Integer64 = 0x15, "INTEGER64", Some(64), Signed;
            Unsigned24 = 0x16, "UNSIGNED24", Some(24), Unsigned;
            Unsigned40 = 0x18, "UNSIGNED40", Some(40), Unsigned;
            Unsigned48 = 0x19, "UNSIGNED48", Some(48), Unsigned;
            Unsigned56 = 0x1A, "UNSIGNED56", Some(56), Unsigned;
            Unsigned64 = 0x1B, "UNSIGNED64", Some(64), Unsigned;
        }
    };
}

macro_rules! define {
    ($($variant:ident = $code:literal, $name:literal, $bits:expr, $class:ident;)*) => {
        /// A static data type of CiA 301.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        #[repr(u8)]
        pub enum DataType {
            $(#[doc = concat!($name, ".")] $variant = $code,)*
        }

        impl DataType {
            /// All data types, by code.
            pub const ALL: &[DataType] = &[$(DataType::$variant),*];

            /// The type with this index in the data type area of the dictionary.
            #[must_use]
            pub const fn from_code(code: u16) -> Option<Self> {
                match code { $($code => Some(DataType::$variant),)* _ => None }
            }

            /// The name in CiA 301: `UNSIGNED16`.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self { $(DataType::$variant => $name,)* }
            }

            /// The size in bits, as a PDO maps it; `None` if it is not fixed.
            #[inline]
            #[must_use]
            pub const fn bits(self) -> Option<u8> {
                Self::bits_of_code(self as u16)
            }

            /// The size of the type with this index, below 20h; `None` if it is not fixed or there is no such type.
            #[inline]
            #[must_use]
            pub const fn bits_of_code(code: u16) -> Option<u8> {
                // A table, because a `match` would be inlined as a jump table at several places of each SDO segment.
                const BITS: [Option<NonZeroU8>; 32] = {
                    let mut bits: [Option<NonZeroU8>; 32] = [None; 32];
                    $(bits[$code] = if let Some(bits) = $bits { NonZeroU8::new(bits) } else { None };)*
                    bits
                };
                match BITS[code as usize & 31] {
                    Some(bits) => Some(bits.get()),
                    None => None,
                }
            }

            /// The kind of its values.
            #[inline]
            #[must_use]
            pub const fn class(self) -> Class {
                match self { $(DataType::$variant => Class::$class,)* }
            }
        }
    };
}

data_types!(define);

impl DataType {
    /// The size in bytes, as an SDO transfers it (one for BOOLEAN); `None` if it is not fixed.
    #[inline]
    #[must_use]
    pub const fn size(self) -> Option<usize> {
        match self.bits() {
            Some(bits) => Some((bits as usize).div_ceil(8)),
            None => None,
        }
    }

    /// Whether it is one of UNSIGNED8 to UNSIGNED64.
    #[inline]
    #[must_use]
    pub const fn is_unsigned(self) -> bool {
        matches!(self.class(), Class::Unsigned)
    }

    /// Whether the most significant bit is a sign.
    #[inline]
    #[must_use]
    pub const fn is_signed(self) -> bool {
        matches!(self.class(), Class::Signed)
    }
}

impl fmt::Display for DataType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// A kind of values, of any size.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Class {
    /// BOOLEAN.
    Boolean,
    /// INTEGER8 to INTEGER64.
    Signed,
    /// UNSIGNED8 to UNSIGNED64.
    Unsigned,
    /// REAL32 and REAL64.
    Real,
    /// VISIBLE_STRING and UNICODE_STRING.
    Text,
    /// OCTET_STRING and DOMAIN.
    Bytes,
    /// TIME_OF_DAY and TIME_DIFFERENCE.
    Time,
    /// Types that CiA 301 does not define; no [`DataType`] has this class.
    Other,
}
