//! SDO abort codes (CiA 301, 7.2.4.3.17, table 22).

use core::fmt;

/// The reason why an SDO transfer was aborted. A device may send codes that the standard
/// does not have; they are kept as they are.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct AbortCode(pub u32);

macro_rules! abort_codes {
    ($($(#[doc = $doc:literal])* $name:ident = $code:literal: $text:literal;)*) => {
        impl AbortCode {
            $(#[doc = concat!(stringify!($code), ": ", $text, ".")] pub const $name: AbortCode = AbortCode($code);)*

            /// All codes of the table, ascending.
            pub const ALL: &[AbortCode] = &[$(AbortCode::$name),*];

            /// What the code means; `None` for a code that CiA 301 does not have.
            #[must_use]
            pub const fn text(self) -> Option<&'static str> {
                match self.0 { $($code => Some($text),)* _ => None }
            }
        }
    };
}

abort_codes! {
    TOGGLE_BIT = 0x0503_0000: "toggle bit not alternated";
    TIMED_OUT = 0x0504_0000: "SDO protocol timed out";
    UNKNOWN_COMMAND = 0x0504_0001: "command specifier not valid or unknown";
    INVALID_BLOCK_SIZE = 0x0504_0002: "invalid block size";
    INVALID_SEQUENCE_NUMBER = 0x0504_0003: "invalid sequence number";
    CRC_ERROR = 0x0504_0004: "CRC error";
    OUT_OF_MEMORY = 0x0504_0005: "out of memory";
    UNSUPPORTED_ACCESS = 0x0601_0000: "unsupported access to an object";
    WRITE_ONLY = 0x0601_0001: "attempt to read a write only object";
    READ_ONLY = 0x0601_0002: "attempt to write a read only object";
    NO_SUCH_OBJECT = 0x0602_0000: "object does not exist in the object dictionary";
    NOT_MAPPABLE = 0x0604_0041: "object cannot be mapped to the PDO";
    PDO_LENGTH_EXCEEDED = 0x0604_0042: "mapped objects would exceed the PDO length";
    PARAMETER_INCOMPATIBLE = 0x0604_0043: "general parameter incompatibility";
    DEVICE_INCOMPATIBLE = 0x0604_0047: "general internal incompatibility in the device";
    HARDWARE_ERROR = 0x0606_0000: "access failed due to a hardware error";
    LENGTH_MISMATCH = 0x0607_0010: "data type does not match, length of service parameter does not match";
    LENGTH_TOO_HIGH = 0x0607_0012: "data type does not match, length of service parameter too high";
    LENGTH_TOO_LOW = 0x0607_0013: "data type does not match, length of service parameter too low";
    NO_SUCH_SUB_INDEX = 0x0609_0011: "sub-index does not exist";
    INVALID_VALUE = 0x0609_0030: "invalid value for parameter";
    VALUE_TOO_HIGH = 0x0609_0031: "value of parameter written too high";
    VALUE_TOO_LOW = 0x0609_0032: "value of parameter written too low";
    MAXIMUM_BELOW_MINIMUM = 0x0609_0036: "maximum value is less than minimum value";
    RESOURCE_NOT_AVAILABLE = 0x060A_0023: "resource not available: SDO connection";
    GENERAL = 0x0800_0000: "general error";
    CANNOT_TRANSFER = 0x0800_0020: "data cannot be transferred or stored to the application";
    LOCAL_CONTROL = 0x0800_0021: "data cannot be transferred or stored to the application because of local control";
    DEVICE_STATE = 0x0800_0022: "data cannot be transferred or stored to the application because of the present device state";
    NO_OBJECT_DICTIONARY = 0x0800_0023: "object dictionary dynamic generation fails or no object dictionary is present";
    NO_DATA = 0x0800_0024: "no data available";
}

/// The code as the standard groups it, and what it means: `0609 0011: sub-index does not exist`.
impl fmt::Display for AbortCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let text = self.text().unwrap_or("code unknown to CiA 301");
        write!(f, "{:04X} {:04X}: {text}", self.0 >> 16, self.0 & 0xFFFF)
    }
}

impl fmt::Debug for AbortCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "AbortCode({self})")
    }
}
