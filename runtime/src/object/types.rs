//! The static data types of CiA 301 (7.4.7, table 44).

use core::fmt;

macro_rules! data_types {
    ($($variant:ident = $code:literal, $name:literal, $bits:expr;)*) => {
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

            /// The type with the index `code` in the data type area of the dictionary.
            #[must_use]
            pub const fn from_code(code: u16) -> Option<Self> {
                match code { $($code => Some(DataType::$variant),)* _ => None }
            }

            /// The name in CiA 301: `UNSIGNED16`.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self { $(DataType::$variant => $name,)* }
            }

            /// The size in bits, as a PDO maps it; `None` for types of no fixed size.
            #[inline]
            #[must_use]
            pub const fn bits(self) -> Option<u8> {
                // A table, because as a match this becomes a jump, at several places of each SDO segment.
                const BITS: [Option<u8>; 32] = {
                    let mut bits = [None; 32];
                    $(bits[$code] = $bits;)*
                    bits
                };
                BITS[self as usize & 31]
            }
        }
    };
}

data_types! {
    Boolean = 0x01, "BOOLEAN", Some(1);
    Integer8 = 0x02, "INTEGER8", Some(8);
    Integer16 = 0x03, "INTEGER16", Some(16);
    Integer32 = 0x04, "INTEGER32", Some(32);
    Unsigned8 = 0x05, "UNSIGNED8", Some(8);
    Unsigned16 = 0x06, "UNSIGNED16", Some(16);
    Unsigned32 = 0x07, "UNSIGNED32", Some(32);
    Real32 = 0x08, "REAL32", Some(32);
    VisibleString = 0x09, "VISIBLE_STRING", None;
    OctetString = 0x0A, "OCTET_STRING", None;
    UnicodeString = 0x0B, "UNICODE_STRING", None;
    TimeOfDay = 0x0C, "TIME_OF_DAY", Some(48);
    TimeDifference = 0x0D, "TIME_DIFFERENCE", Some(48);
    Domain = 0x0F, "DOMAIN", None;
    Integer24 = 0x10, "INTEGER24", Some(24);
    Real64 = 0x11, "REAL64", Some(64);
    Integer40 = 0x12, "INTEGER40", Some(40);
    Integer48 = 0x13, "INTEGER48", Some(48);
    Integer56 = 0x14, "INTEGER56", Some(56);
    Integer64 = 0x15, "INTEGER64", Some(64);
    Unsigned24 = 0x16, "UNSIGNED24", Some(24);
    Unsigned40 = 0x18, "UNSIGNED40", Some(40);
    Unsigned48 = 0x19, "UNSIGNED48", Some(48);
    Unsigned56 = 0x1A, "UNSIGNED56", Some(56);
    Unsigned64 = 0x1B, "UNSIGNED64", Some(64);
}

impl DataType {
    /// The size in bytes, as an SDO transfers it (a BOOLEAN takes one); `None` without a fixed size.
    #[inline]
    #[must_use]
    pub const fn size(self) -> Option<usize> {
        match self.bits() {
            Some(bits) => Some((bits as usize).div_ceil(8)),
            None => None,
        }
    }

    /// Whether this is a number of which no bit is a sign.
    #[must_use]
    pub const fn is_unsigned(self) -> bool {
        use DataType as D;
        matches!(
            self,
            D::Unsigned8
                | D::Unsigned16
                | D::Unsigned24
                | D::Unsigned32
                | D::Unsigned40
                | D::Unsigned48
                | D::Unsigned56
                | D::Unsigned64
        )
    }

    /// Whether the most significant bit is a sign.
    #[must_use]
    pub const fn is_signed(self) -> bool {
        use DataType as D;
        matches!(
            self,
            D::Integer8
                | D::Integer16
                | D::Integer24
                | D::Integer32
                | D::Integer40
                | D::Integer48
                | D::Integer56
                | D::Integer64
        )
    }
}

impl fmt::Display for DataType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}
