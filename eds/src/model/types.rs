//! The data types of CiA 301 (7.4.7, table 44), and what else a data sheet may name.

use std::fmt;

macro_rules! data_types {
    ($($variant:ident = $code:literal, $name:literal, $bits:expr;)*) => {
        /// A data type that a data sheet names.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum DataType {
            $(#[doc = concat!($name, ".")] $variant,)*
            /// Any other index: a record type (20h to 3Fh), a type that the device defines itself (40h and up),
            /// or 0 where the data sheet names none.
            Other(u16),
        }

        impl DataType {
            /// The data types of CiA 301, by code.
            pub const ALL: &[DataType] = &[$(DataType::$variant),*];

            /// The type with the index `code` in the dictionary; total, what CiA 301 does not define is
            /// [`Other`](Self::Other).
            #[must_use]
            pub const fn from_code(code: u16) -> Self {
                match code { $($code => DataType::$variant,)* _ => DataType::Other(code) }
            }

            /// The index in the dictionary.
            #[must_use]
            pub const fn code(self) -> u16 {
                match self { $(DataType::$variant => $code,)* DataType::Other(code) => code }
            }

            /// The name in CiA 301: `UNSIGNED16`; the general `DEFTYPE`, `RECORD` or `UNKNOWN` for others, which
            /// [`Display`](fmt::Display) tells apart by their index.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self {
                    $(DataType::$variant => $name,)*
                    DataType::Other(code) => other_name(code),
                }
            }

            /// The size in bits, as a PDO maps it; `None` for types of no fixed or no known size.
            #[must_use]
            pub const fn bits(self) -> Option<u8> {
                match self { $(DataType::$variant => $bits,)* DataType::Other(_) => None }
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
    /// What the standard has in mind.
    #[must_use]
    pub const fn class(self) -> Class {
        use DataType as D;
        match self {
            D::Boolean => Class::Boolean,
            D::Integer8 | D::Integer16 | D::Integer24 | D::Integer32 => Class::Signed,
            D::Integer40 | D::Integer48 | D::Integer56 | D::Integer64 => Class::Signed,
            D::Unsigned8 | D::Unsigned16 | D::Unsigned24 | D::Unsigned32 => Class::Unsigned,
            D::Unsigned40 | D::Unsigned48 | D::Unsigned56 | D::Unsigned64 => Class::Unsigned,
            D::Real32 | D::Real64 => Class::Real,
            D::VisibleString | D::UnicodeString => Class::Text,
            D::OctetString | D::Domain => Class::Bytes,
            D::TimeOfDay | D::TimeDifference => Class::Time,
            D::Other(_) => Class::Other,
        }
    }

    /// The smallest and the largest number of an integer type, a BOOLEAN or a time.
    #[must_use]
    pub const fn range(self) -> Option<(i128, i128)> {
        let Some(bits) = self.bits() else { return None };
        match self.class() {
            Class::Signed => Some((-(1 << (bits - 1)), (1 << (bits - 1)) - 1)),
            Class::Unsigned | Class::Boolean | Class::Time => Some((0, (1 << bits) - 1)),
            _ => None,
        }
    }

    /// The number as one of this type; `None` when it is not. Data sheets write negative numbers as the hexadecimal of
    /// their two's complement.
    #[must_use]
    pub const fn fit(self, number: i128) -> Option<i128> {
        let (Some((low, high)), Some(bits)) = (self.range(), self.bits()) else { return None };
        if low <= number && number <= high {
            Some(number)
        } else if matches!(self.class(), Class::Signed) && high <= number && number < 1 << bits {
            Some(number - (1 << bits))
        } else {
            None
        }
    }

    /// The type with this name in CiA 301 (`UNSIGNED16`), in any case.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|data_type| data_type.name().eq_ignore_ascii_case(name))
    }

    /// Whether the data sheet names no type, or an index that no type can have.
    #[must_use]
    pub const fn is_unknown(self) -> bool {
        matches!(self, DataType::Other(code) if !matches!(code, 0x20..=0x25F))
    }
}

/// The classes of data types.
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
    /// What CiA 301 does not define.
    Other,
}

const fn other_name(code: u16) -> &'static str {
    match code {
        0x20 => "PDO_COMMUNICATION_PARAMETER",
        0x21 => "PDO_MAPPING",
        0x22 => "SDO_PARAMETER",
        0x23 => "IDENTITY",
        0x24 => "DEBUGGER_PAR",
        0x25 => "COMMAND_PAR",
        0x26..=0x3F => "RECORD",
        0x40..=0x25F => "DEFTYPE",
        _ => "UNKNOWN",
    }
}

impl fmt::Display for DataType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            DataType::Other(code @ (0 | 0x20..=0x25)) => f.pad(DataType::Other(*code).name()),
            DataType::Other(code) => write!(f, "{code:04X}h"),
            known => f.pad(known.name()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_comes_back() {
        for code in 0..=u16::MAX {
            assert_eq!(DataType::from_code(code).code(), code);
        }
        for &data_type in DataType::ALL {
            assert_eq!(DataType::from_name(data_type.name()), Some(data_type));
        }
    }

    #[test]
    fn ranges_are_those_of_twos_complement() {
        assert_eq!(DataType::Boolean.range(), Some((0, 1)));
        assert_eq!(DataType::Integer24.range(), Some((-0x80_0000, 0x7F_FFFF)));
        assert_eq!(DataType::Unsigned64.range(), Some((0, u64::MAX.into())));
        assert_eq!(DataType::Real32.range(), None);
        assert_eq!(DataType::Other(0x42).range(), None);
    }
}
