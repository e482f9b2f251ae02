//! The faults of table 2 and the emergency codes of table 20, as one table.
//!
//! The manual prints the bytes of an emergency code as "byte 0 (high byte), byte 1 (low byte)", which is
//! not the order of CiA 301 (7.2.7.1: least significant byte first). Which one the hardware uses can only
//! be seen on a bus. So the order is data: the simulated drive follows CiA 301 unless its
//! [`Behaviour`](lexican_runtime::device::Behaviour) says otherwise, and [`CODES`] understand both, which is
//! safe because no code of the table is another one's mirror image.

use core::fmt;

pub use lexican_driver::Cause;
use lexican_driver::{ByteOrder, Code, Codes};

/// A cause of the state FAULT (table 2).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fault {
    /// The letter of the fault buffer.
    pub letter: char,
    /// How often the green status LED blinks.
    pub blinks: u8,
    /// The emergency code (table 20), also the entry of 1003h.
    pub code: u16,
    /// The bits of the error register 1001h.
    pub register: u8,
    /// What happened.
    pub text: &'static str,
}

/// Bits of the error register 1001h.
pub mod register {
    /// Any error.
    pub const GENERAL: u8 = 1 << 0;
    /// Current.
    pub const CURRENT: u8 = 1 << 1;
    /// Voltage.
    pub const VOLTAGE: u8 = 1 << 2;
    /// Temperature.
    pub const TEMPERATURE: u8 = 1 << 3;
    /// Data transfer.
    pub const COMMUNICATION: u8 = 1 << 4;
    /// The shaft is blocked. CiA 301 has "device profile specific" here.
    pub const SHAFT_BLOCKED: u8 = 1 << 5;
    /// Anything else.
    pub const MANUFACTURER: u8 = 1 << 7;
}

macro_rules! faults {
    ($($name:ident = $letter:literal, $blinks:literal, $code:literal, $register:ident, $text:literal;)*) => {
        impl Fault {
            $(
                #[doc = concat!($letter, ": ", $text, ".")]
                pub const $name: Fault = Fault {
                    letter: $letter,
                    blinks: $blinks,
                    code: $code,
                    register: register::GENERAL | register::$register,
                    text: $text,
                };
            )*

            /// All faults, by letter.
            pub const ALL: &[Fault] = &[$(Fault::$name),*];
        }

        const FAULTS: &[Code] = &[$(Code { number: $code, label: concat!($letter), text: $text }),*];
    };
}

faults! {
    UNDERVOLTAGE = 'A', 1, 0x3120, VOLTAGE, "supply voltage too low";
    SHAFT_BLOCKED = 'B', 2, 0x7121, SHAFT_BLOCKED, "drive shaft blocked";
    OVERCURRENT = 'C', 3, 0x2100, CURRENT, "motor current too high";
    OVERTEMPERATURE = 'D', 4, 0x4310, TEMPERATURE, "output stage too hot";
    SENSOR = 'E', 5, 0x7300, MANUFACTURER, "position sensor: sine/cosine monitoring";
    INTERNAL = 'F', 6, 0xFF01, MANUFACTURER, "internal error";
    OVERVOLTAGE = 'G', 7, 0x3210, VOLTAGE, "intermediate circuit voltage too high";
    BUS_PASSIVE = 'H', 8, 0xFF02, COMMUNICATION, "CAN controller error passive during a positioning";
    BUS_OFF = 'I', 9, 0xFF03, COMMUNICATION, "CAN controller bus off";
    BATTERY = 'J', 10, 0xFF09, VOLTAGE, "battery voltage below 2.2 V";
}

/// No error: sent when a fault has been reset.
pub const NO_ERROR: u16 = 0x0000;
/// The CAN controller has become error passive. Not stored, and no fault by itself.
pub const ERROR_PASSIVE: u16 = 0x8120;
/// The CAN controller is back from bus off. Not stored, and no fault by itself.
pub const RECOVERED_FROM_BUS_OFF: u16 = 0x8140;

/// What the driver has to know of emergency codes.
pub const CODES: Codes = Codes {
    faults: FAULTS,
    notices: &[
        Code { number: ERROR_PASSIVE, label: "", text: "CAN controller error passive" },
        Code { number: RECOVERED_FROM_BUS_OFF, label: "", text: "recovered from bus off" },
    ],
    order: ByteOrder::Either,
};

/// What an emergency code, or an entry of 1003h, says; in whichever order its bytes came.
#[must_use]
pub fn cause_of(code: u16) -> Cause {
    CODES.cause(code)
}

impl Fault {
    /// The fault that an emergency code stands for.
    #[must_use]
    pub fn of(code: Code) -> Option<Fault> {
        Fault::ALL.iter().copied().find(|fault| fault.code == code.number)
    }
}

/// What the driver tells when the drive has this fault.
impl From<Fault> for Cause {
    fn from(fault: Fault) -> Self {
        cause_of(fault.code)
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({:04X}): {}", self.letter, self.code, self.text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_and_blinks_count_up() {
        for (row, fault) in Fault::ALL.iter().enumerate() {
            assert_eq!(fault.blinks as usize, row + 1);
            assert_eq!(fault.letter, (b'A' + row as u8) as char);
        }
    }

    #[test]
    fn every_code_is_understood_in_both_orders() {
        for fault in Fault::ALL {
            for cause in [cause_of(fault.code), cause_of(fault.code.swap_bytes())] {
                let Cause::Fault(code) = cause else { panic!("{cause}") };
                assert_eq!(Fault::of(code), Some(*fault));
                assert_eq!(cause.to_string(), fault.to_string());
            }
        }
        assert_eq!(cause_of(0x2081).to_string(), "CAN controller error passive");
        assert_eq!(cause_of(0x4081).to_string(), "recovered from bus off");
        assert_eq!(cause_of(0x1234), Cause::Unknown(0x1234));
    }

    #[test]
    fn a_fault_prints_letter_code_and_cause() {
        assert_eq!(Fault::SHAFT_BLOCKED.to_string(), "B (7121): drive shaft blocked");
    }
}
