//! Which parameter of chapter 8 is which object, and how the port's numbers for it differ from the object's.

use lexican_runtime::object::Address;

use crate::command::{Long, Mode, PosType, Short, Turning};

/// Parameter 18.
pub const SENSE_OF_ROTATION: Address = Address::new(0x607E, 0x00);
/// Parameter 19.
pub const POS_TYPE: Address = Address::new(0x2413, 0x00);
/// Parameter 20.
pub const MODE: Address = Address::new(0x6060, 0x00);

impl Long {
    /// The object that has the same number in the same unit. Which one the setpoint is, depends on the mode.
    #[must_use]
    pub const fn object(self, mode: Mode) -> Address {
        match (self, mode) {
            (Long::Setpoint, Mode::Positioning) => Address::new(0x607A, 0x00),
            (Long::Setpoint, Mode::Velocity) => Address::new(0x60FF, 0x00),
            // The port has the upper limit first, the object the lower one.
            (Long::UpperLimit, _) => Address::new(0x607D, 0x02),
            (Long::LowerLimit, _) => Address::new(0x607D, 0x01),
            (Long::CalibrationValue, _) => Address::new(0x607C, 0x00),
            (Long::DeltaJog, _) => Address::new(0x2415, 0x00),
        }
    }
}

impl Short {
    /// The object that has the same number in the same unit.
    #[must_use]
    pub const fn object(self) -> Address {
        match self {
            // Sub-index 07h is reserved like number 06.
            Short::ControllerP
            | Short::ControllerI
            | Short::ControllerD
            | Short::APos
            | Short::VPos
            | Short::ARot
            | Short::AJog
            | Short::VJog => Address::new(0x2410, self as u8 + 1),
            Short::Window => Address::new(0x6067, 0x00),
            Short::GearNumerator => Address::new(0x6091, 0x01),
            Short::GearDenominator => Address::new(0x6091, 0x02),
            Short::BitRate => Address::new(0x2100, 0x00),
            Short::SpindlePitch => Address::new(0x2412, 0x00),
            Short::BusAddress => Address::new(0x2101, 0x00),
        }
    }
}

impl PosType {
    /// The number in [`POS_TYPE`], which is that of the port.
    #[must_use]
    pub const fn in_object(self) -> u8 {
        self as u8
    }
}

impl Turning {
    /// The number in [`SENSE_OF_ROTATION`], if it is about that. No object of the AG02 has parameter 25.
    #[must_use]
    pub const fn in_object(self) -> Option<u8> {
        match self {
            Turning::SenseI => Some(0),
            Turning::SenseE => Some(1),
            Turning::JogStopsFully | Turning::JogStopsByRamp => None,
        }
    }
}

impl Mode {
    /// The number in [`MODE`]: one more than that of the port.
    #[must_use]
    pub const fn in_object(self) -> u8 {
        match self {
            Mode::Positioning => 1,
            Mode::Velocity => 2,
        }
    }
}
