//! EMCY: errors of a node (CiA 301, 7.2.7).

use core::fmt;
use core::ops::{BitAnd, BitOr, Not};

use crate::cia301::connection;
use crate::id::{CobId, NodeId};

/// An emergency error code (CiA 301, table 26). Profiles and vendors have further codes.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ErrorCode(pub u16);

macro_rules! error_codes {
    ($($name:ident = $code:literal: $text:literal;)*) => {
        impl ErrorCode {
            $(#[doc = concat!(stringify!($code), ": ", $text, ".")] pub const $name: ErrorCode = ErrorCode($code);)*

            /// The text of CiA 301 for this code; `None` if only its group has one.
            #[must_use]
            pub const fn text(self) -> Option<&'static str> {
                match self.0 { $($code => Some($text),)* _ => None }
            }
        }
    };
}

error_codes! {
    NO_ERROR = 0x0000: "error reset or no error";
    GENERIC = 0x1000: "generic error";
    CURRENT = 0x2000: "current";
    CURRENT_INPUT = 0x2100: "current, device input side";
    CURRENT_INSIDE = 0x2200: "current inside the device";
    CURRENT_OUTPUT = 0x2300: "current, device output side";
    VOLTAGE = 0x3000: "voltage";
    MAINS_VOLTAGE = 0x3100: "mains voltage";
    VOLTAGE_INSIDE = 0x3200: "voltage inside the device";
    OUTPUT_VOLTAGE = 0x3300: "output voltage";
    TEMPERATURE = 0x4000: "temperature";
    AMBIENT_TEMPERATURE = 0x4100: "ambient temperature";
    DEVICE_TEMPERATURE = 0x4200: "device temperature";
    HARDWARE = 0x5000: "device hardware";
    SOFTWARE = 0x6000: "device software";
    INTERNAL_SOFTWARE = 0x6100: "internal software";
    USER_SOFTWARE = 0x6200: "user software";
    DATA_SET = 0x6300: "data set";
    ADDITIONAL_MODULES = 0x7000: "additional modules";
    MONITORING = 0x8000: "monitoring";
    COMMUNICATION = 0x8100: "communication";
    CAN_OVERRUN = 0x8110: "CAN overrun (objects lost)";
    CAN_ERROR_PASSIVE = 0x8120: "CAN in error passive mode";
    LIFE_GUARD = 0x8130: "life guard error or heartbeat error";
    BUS_OFF_RECOVERED = 0x8140: "recovered from bus off";
    COB_ID_COLLISION = 0x8150: "CAN-ID collision";
    PROTOCOL = 0x8200: "protocol error";
    PDO_LENGTH = 0x8210: "PDO not processed due to length error";
    PDO_TOO_LONG = 0x8220: "PDO length exceeded";
    DAM_MPDO = 0x8230: "DAM MPDO not processed, destination object not available";
    SYNC_LENGTH = 0x8240: "unexpected SYNC data length";
    RPDO_TIMEOUT = 0x8250: "RPDO timeout";
    EXTERNAL = 0x9000: "external error";
    ADDITIONAL_FUNCTIONS = 0xF000: "additional functions";
    DEVICE_SPECIFIC = 0xFF00: "device specific";
}

impl ErrorCode {
    /// The group of the code, which CiA 301 has for all codes except some of profiles: 3120h is in 3100h, mains
    /// voltage, and 5530h in 5000h, device hardware.
    #[must_use]
    pub const fn group(self) -> Option<ErrorCode> {
        let group = ErrorCode(self.0 & 0xFF00);
        if group.text().is_some() {
            return Some(group);
        }
        let group = ErrorCode(self.0 & 0xF000);
        // 0000h means no error, and F000h is a group for F0xxh only.
        if group.0 != 0 && group.0 != 0xF000 && group.text().is_some() { Some(group) } else { None }
    }
}

/// `8210h: PDO not processed due to length error`, or with the text of the group `3120h: mains voltage (31xxh)`.
impl fmt::Display for ErrorCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:04X}h", self.0)?;
        let group = self.group();
        match (self.text(), group, group.and_then(ErrorCode::text)) {
            (Some(text), ..) => write!(f, ": {text}"),
            (None, Some(ErrorCode(code)), Some(text)) if code & 0x0F00 == 0 && self.0 & 0x0F00 != 0 => {
                write!(f, ": {text} ({:X}xxxh)", code >> 12)
            }
            (None, Some(ErrorCode(code)), Some(text)) => write!(f, ": {text} ({:02X}xxh)", code >> 8),
            _ => Ok(()),
        }
    }
}

impl fmt::Debug for ErrorCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "ErrorCode({:04X})", self.0)
    }
}

/// The error register, object 1001h (CiA 301, 7.5.2.2).
#[derive(Clone, Copy, Default, PartialEq, Eq, Hash)]
pub struct ErrorRegister(pub u8);

#[allow(missing_docs, reason = "the names say what it is")]
impl ErrorRegister {
    /// No error.
    pub const NONE: ErrorRegister = ErrorRegister(0x00);
    /// Generic error: set with every other error.
    pub const GENERIC: ErrorRegister = ErrorRegister(0x01);
    pub const CURRENT: ErrorRegister = ErrorRegister(0x02);
    pub const VOLTAGE: ErrorRegister = ErrorRegister(0x04);
    pub const TEMPERATURE: ErrorRegister = ErrorRegister(0x08);
    /// Communication: overrun, error passive, monitoring.
    pub const COMMUNICATION: ErrorRegister = ErrorRegister(0x10);
    /// Specific to the device profile.
    pub const PROFILE: ErrorRegister = ErrorRegister(0x20);
    /// Specific to the manufacturer.
    pub const MANUFACTURER: ErrorRegister = ErrorRegister(0x80);

    /// Whether all bits of `other` are set.
    #[must_use]
    pub const fn contains(self, other: ErrorRegister) -> bool {
        self.0 & other.0 == other.0
    }

    /// Whether no bit is set.
    #[must_use]
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }
}

impl BitOr for ErrorRegister {
    type Output = ErrorRegister;
    fn bitor(self, other: ErrorRegister) -> ErrorRegister {
        ErrorRegister(self.0 | other.0)
    }
}

impl BitAnd for ErrorRegister {
    type Output = ErrorRegister;
    fn bitand(self, other: ErrorRegister) -> ErrorRegister {
        ErrorRegister(self.0 & other.0)
    }
}

impl Not for ErrorRegister {
    type Output = ErrorRegister;
    fn not(self) -> ErrorRegister {
        ErrorRegister(!self.0)
    }
}

impl fmt::Debug for ErrorRegister {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "ErrorRegister({:02X})", self.0)
    }
}

/// The order in which a device sends the two bytes of the error code.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum CodeOrder {
    /// As in CiA 301.
    #[default]
    LowByteFirst,
    /// As in some devices.
    HighByteFirst,
}

/// An emergency message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Emergency {
    /// The error; [`ErrorCode::NO_ERROR`] if an error is over.
    pub code: ErrorCode,
    /// The error register after the event.
    pub register: ErrorRegister,
    /// Manufacturer-specific.
    pub vendor: [u8; 5],
}

impl Emergency {
    /// The COB-ID in the predefined connection set, 080h + node-ID.
    #[must_use]
    pub const fn cob_id(node: NodeId) -> CobId {
        CobId::of_node(connection::EMCY, node)
    }

    /// The node whose emergencies have this COB-ID in the predefined connection set.
    #[must_use]
    pub fn node(id: CobId) -> Option<NodeId> {
        let low = id.raw().checked_sub(connection::EMCY.into()).filter(|_| !id.is_extended())?;
        u8::try_from(low).ok().and_then(NodeId::new)
    }

    /// `None` if the data are not eight bytes.
    #[must_use]
    pub fn parse(data: &[u8], order: CodeOrder) -> Option<Self> {
        let &[first, second, register, ref vendor @ ..] = data else { return None };
        let code = match order {
            CodeOrder::LowByteFirst => u16::from_le_bytes([first, second]),
            CodeOrder::HighByteFirst => u16::from_be_bytes([first, second]),
        };
        let vendor = vendor.try_into().ok()?;
        Some(Emergency { code: ErrorCode(code), register: ErrorRegister(register), vendor })
    }

    /// The data on the wire.
    #[must_use]
    pub const fn emit(self, order: CodeOrder) -> [u8; 8] {
        let [first, second] = match order {
            CodeOrder::LowByteFirst => self.code.0.to_le_bytes(),
            CodeOrder::HighByteFirst => self.code.0.to_be_bytes(),
        };
        let [a, b, c, d, e] = self.vendor;
        [first, second, self.register.0, a, b, c, d, e]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_emitted_is_parsed_in_either_byte_order() {
        let emergency = Emergency { code: ErrorCode(0x3120), register: ErrorRegister(0x05), vendor: [1, 2, 3, 4, 5] };
        assert_eq!(emergency.emit(CodeOrder::LowByteFirst), [0x20, 0x31, 5, 1, 2, 3, 4, 5]);
        assert_eq!(emergency.emit(CodeOrder::HighByteFirst), [0x31, 0x20, 5, 1, 2, 3, 4, 5]);
        for order in [CodeOrder::LowByteFirst, CodeOrder::HighByteFirst] {
            assert_eq!(Emergency::parse(&emergency.emit(order), order), Some(emergency));
        }
    }

    #[test]
    fn every_code_of_cia_301_has_words() {
        let text = |code| std::format!("{}", ErrorCode(code));
        assert_eq!(text(0x8210), "8210h: PDO not processed due to length error");
        assert_eq!(text(0x3120), "3120h: mains voltage (31xxh)");
        assert_eq!(text(0x5530), "5530h: device hardware (5xxxh)");
        assert_eq!(text(0x8211), "8211h: protocol error (82xxh)");
        assert_eq!(text(0x9001), "9001h: external error (90xxh)");
        assert_eq!(text(0xF001), "F001h: additional functions (F0xxh)");
        assert_eq!(text(0xFF42), "FF42h: device specific (FFxxh)");
        assert_eq!(text(0x0000), "0000h: error reset or no error");
        // CiA 301, table 26: 1xxxh to 9xxxh, F0xxh, FFxxh.
        let named = (0x1000..=0x9FFF).chain(0xF000..=0xF0FF).chain(0xFF00..=0xFFFF);
        assert!(named.map(ErrorCode).all(|code| code.group().is_some()));
        assert_eq!(ErrorCode(0xA000).group(), None);
        assert_eq!(text(0xF100), "F100h");
    }

    #[test]
    fn anything_but_eight_bytes_is_none() {
        for len in (0..8).chain([9]) {
            assert_eq!(Emergency::parse(&std::vec![0; len], CodeOrder::LowByteFirst), None);
        }
    }
}
