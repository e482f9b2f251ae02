//! The data types of CiA 301 (7.4.7, table 44), and other types that a data sheet may name.

use std::fmt;

pub use lexican_cia::Class;

macro_rules! define {
    ($($variant:ident = $code:literal, $name:literal, $bits:expr, $class:ident;)*) => {
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

            /// The data type with this index in the dictionary; [`Other`](Self::Other) if CiA 301 does not define it.
            #[must_use]
            pub const fn from_code(code: u16) -> Self {
                match code { $($code => DataType::$variant,)* _ => DataType::Other(code) }
            }

            /// The index in the dictionary.
            #[must_use]
            pub const fn code(self) -> u16 {
                match self { $(DataType::$variant => $code,)* DataType::Other(code) => code }
            }

            /// The type of CiA 301; `None` for [`Other`](Self::Other).
            #[must_use]
            pub const fn known(self) -> Option<lexican_cia::DataType> {
                match self { $(DataType::$variant => Some(lexican_cia::DataType::$variant),)* DataType::Other(_) => None }
            }
        }
    };
}

lexican_cia::data_types!(define);

impl DataType {
    /// The name in CiA 301: `UNSIGNED16`; for other types `DEFTYPE`, `RECORD` or `UNKNOWN`. [`Display`](fmt::Display)
    /// adds the index to these.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.known().map_or_else(|| other_name(self.code()), lexican_cia::DataType::name)
    }

    /// The size in bits, as a PDO maps it; `None` if it is not fixed or not known.
    #[must_use]
    pub fn bits(self) -> Option<u8> {
        self.known()?.bits()
    }

    /// The kind of the values.
    #[must_use]
    pub fn class(self) -> Class {
        self.known().map_or(Class::Other, lexican_cia::DataType::class)
    }

    /// The smallest and the largest number of an integer type, a BOOLEAN or a time.
    #[must_use]
    pub fn range(self) -> Option<(i128, i128)> {
        let bits = self.bits()?;
        match self.class() {
            Class::Signed => Some((-(1 << (bits - 1)), (1 << (bits - 1)) - 1)),
            Class::Unsigned | Class::Boolean | Class::Time => Some((0, (1 << bits) - 1)),
            _ => None,
        }
    }

    /// The number in the range of this type; `None` if it is outside. A number whose sign bit is set counts as
    /// negative: data sheets write negative numbers as hexadecimal two's complement.
    #[must_use]
    pub fn fit(self, number: i128) -> Option<i128> {
        let ((low, high), bits) = (self.range()?, self.bits()?);
        if low <= number && number <= high {
            Some(number)
        } else if matches!(self.class(), Class::Signed) && high <= number && number < 1 << bits {
            Some(number - (1 << bits))
        } else {
            None
        }
    }

    /// The data type with this name in CiA 301 (`UNSIGNED16`), in upper or lower case.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|data_type| data_type.name().eq_ignore_ascii_case(name))
    }

    /// Whether the data sheet names no type, or an index that cannot be a type.
    #[must_use]
    pub const fn is_unknown(self) -> bool {
        matches!(self, DataType::Other(code) if !matches!(code, 0x20..=0x25F))
    }
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
