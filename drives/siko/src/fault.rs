//! Faults and emergency codes of all drives.
//!
//! The manuals print the bytes of an emergency code as "byte 0 (high byte), byte 1 (low byte)", which is not the order
//! of CiA 301 (7.2.7.1: least significant byte first). Which one the hardware uses is not known. So the order is data:
//! a simulated drive follows CiA 301 unless its [`Behaviour`](lexican_runtime::device::Behaviour) says otherwise, and
//! the drivers' [`Codes`](lexican_driver::Codes) understand both, since no code of a drive is the byte-swapped form of
//! another.

use core::fmt;

use lexican_driver::Cause;
#[doc(hidden)]
pub use lexican_driver::Code;

/// A cause of the state FAULT, and how the drive reports it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fault {
    /// What causes it.
    pub kind: FaultKind,
    /// How many times the green status LED blinks.
    pub blinks: u8,
    /// The bits of the error register 1001h.
    pub register: u8,
    /// The emergency code, also the entry of 1003h; its label is the letter.
    pub code: Code,
}

/// What makes a drive fail.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaultKind {
    /// The supply is too low while the motor takes current.
    Undervoltage,
    /// The shaft does not turn.
    ShaftBlocked,
    /// The motor has taken too much current for too long.
    Overcurrent,
    /// The output stage is too hot.
    Overtemperature,
    /// The position cannot be read.
    Sensor,
    /// The drive finds something wrong with itself.
    Internal,
    /// The supply is too high.
    Overvoltage,
    /// The CAN controller has become error passive during a positioning.
    BusPassive,
    /// The CAN controller is bus off.
    BusOff,
    /// The battery of the absolute encoder is empty.
    Battery,
}

impl FaultKind {
    /// All kinds with the names that scripts use.
    pub const ALL: &[(FaultKind, &str)] = &[
        (FaultKind::Undervoltage, "undervoltage"),
        (FaultKind::ShaftBlocked, "shaft blocked"),
        (FaultKind::Overcurrent, "overcurrent"),
        (FaultKind::Overtemperature, "overtemperature"),
        (FaultKind::Sensor, "sensor"),
        (FaultKind::Internal, "internal"),
        (FaultKind::Overvoltage, "overvoltage"),
        (FaultKind::BusPassive, "bus passive"),
        (FaultKind::BusOff, "bus off"),
        (FaultKind::Battery, "battery"),
    ];
}

/// Bits of the error register 1001h.
#[allow(missing_docs, reason = "the names say what it is")]
pub mod register {
    /// Any error.
    pub const GENERAL: u8 = 1 << 0;
    pub const CURRENT: u8 = 1 << 1;
    pub const VOLTAGE: u8 = 1 << 2;
    pub const TEMPERATURE: u8 = 1 << 3;
    /// Data transfer.
    pub const COMMUNICATION: u8 = 1 << 4;
    /// The shaft is blocked. CiA 301 has "device profile specific" here.
    pub const SHAFT_BLOCKED: u8 = 1 << 5;
    /// Anything else.
    pub const MANUFACTURER: u8 = 1 << 7;
}

/// Defines a constant for each row, and a table of all, with the name and the length given first.
#[doc(hidden)]
#[macro_export]
macro_rules! faults {
    (
        $all:ident[$count:literal];
        $($name:ident = $kind:ident, $letter:literal, $blinks:literal, $code:expr, $register:ident, $text:literal;)*
    ) => {
        $(
            #[doc = concat!($letter, ": ", $text, ".")]
            pub const $name: $crate::fault::Fault = $crate::fault::Fault {
                kind: $crate::fault::FaultKind::$kind,
                blinks: $blinks,
                register: $crate::fault::register::GENERAL | $crate::fault::register::$register,
                code: $crate::fault::Code { number: $code, label: $letter, text: $text },
            };
        )*

        /// All faults, by letter.
        pub const $all: &[$crate::fault::Fault; $count] = &[$($name),*];
    };
}

/// No error: sent when a fault has been reset.
pub const NO_ERROR: u16 = 0x0000;
/// The CAN controller has become error passive. Not stored, and not a fault by itself.
pub const ERROR_PASSIVE: u16 = 0x8120;
/// The CAN controller is back from bus off. Not stored, and not a fault by itself.
pub const RECOVERED_FROM_BUS_OFF: u16 = 0x8140;

impl Fault {
    /// The letter of the fault in the fault buffer.
    #[must_use]
    pub fn letter(&self) -> char {
        self.code.label.chars().next().unwrap_or(' ')
    }

    /// The codes of a table of faults, for the description of the drive.
    #[must_use]
    pub const fn codes<const N: usize>(faults: &[Fault; N]) -> [Code; N] {
        let mut codes = [Code { number: 0, label: "", text: "" }; N];
        let mut row = 0;
        while row < N {
            codes[row] = faults[row].code;
            row += 1;
        }
        codes
    }
}

/// The cause that the driver reports for this fault.
impl From<Fault> for Cause {
    fn from(fault: Fault) -> Self {
        Cause::Fault(fault.code)
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.code.fmt(f)
    }
}
