//! The drive's surroundings: supply, battery, temperature, load, bus, keys. They can be set, so that every warning and
//! every fault of chapter 5 can be provoked.

use crate::fault::FaultKind;

/// The surroundings of a drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Inputs {
    /// Supply of the output stage, in 0.1 V.
    pub output_stage_supply_100mv: u16,
    /// Supply of the control, in 0.1 V.
    pub control_supply_100mv: u16,
    /// Temperature of the output stage, in 0.1 degC.
    pub temperature_100mdegc: i16,
    /// Voltage of the battery of the absolute encoder, in 10 mV.
    pub battery_10mv: i16,
    /// Current of the motor while it moves.
    pub load_ma: u16,
    /// Whether something holds the shaft.
    pub shaft: Shaft,
    /// The velocity that the load allows, in rev/min; if less than ordered, there is a lag error. `None` is no limit.
    pub attainable_rpm: Option<u8>,
    /// Whether sine and cosine of the position sensor are inconsistent.
    pub sensor_fails: bool,
    /// Whether the drive detects an internal error.
    pub internal_error: bool,
    /// The state of the CAN controller.
    pub bus: BusState,
    /// The error that the CAN controller has detected in a frame, which some drives report.
    pub bus_error: Option<BusError>,
    /// The bit rate of the bus, in bit/s: a drive with another one neither hears nor is heard. `None` is always the
    /// drive's own.
    pub bus_bit_rate: Option<u32>,
    /// Whether the enable input is active, in drives that have one.
    pub enable: bool,
    /// Whether limit switches 1 and 2 are active, in drives that have them. Switch 1 is taken to be at the high end of
    /// positions; the manual does not say.
    pub limit_switches: [bool; 2],
    /// Whether the calibration switch is active, in drives that have one.
    pub calibration_switch: bool,
    /// Which operator key is pressed.
    pub key: Option<Key>,
    /// Faults whose cause is forced, independent of the other inputs, in the order of [`FaultKind`].
    pub forced: [bool; FaultKind::ALL.len()],
}

/// The operator keys (2.2.1.2). The sense of rotation (parameter 18) decides in which direction they count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Key {
    /// Key 1: the shaft turns clockwise.
    Clockwise,
    /// Key 2: the shaft turns counter-clockwise, which counts up when the sense of rotation is 'i'.
    CounterClockwise,
}

/// Whether the shaft can turn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Shaft {
    /// It follows.
    #[default]
    Free,
    /// Something holds it.
    Blocked,
}

/// Fault confinement of the CAN controller (ISO 11898-1).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BusState {
    /// Error active: normal operation.
    #[default]
    Active,
    /// Error passive: the drive does not communicate any more (table 20).
    Passive,
    /// Bus off.
    Off,
}

/// An error that a CAN controller detects in a frame (table 20 of the AG02).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusError {
    /// No other node has acknowledged the frame.
    Acknowledgement,
    /// A field of fixed form is wrong.
    Form,
    /// Its checksum is wrong.
    Crc,
    /// More than five equal bits follow each other.
    Stuff,
}

impl BusError {
    /// All errors with their names in scripts.
    pub const ALL: &[(BusError, &str)] = &[
        (BusError::Acknowledgement, "acknowledgement"),
        (BusError::Form, "form"),
        (BusError::Crc, "crc"),
        (BusError::Stuff, "stuff"),
    ];

    /// The emergency code (table 20 of the AG02).
    #[must_use]
    pub const fn code(self) -> u16 {
        0x8001 + self as u16
    }
}

/// 24 V, 25 degC, a fresh battery, a light load.
impl Default for Inputs {
    fn default() -> Self {
        Inputs {
            output_stage_supply_100mv: 240,
            control_supply_100mv: 240,
            temperature_100mdegc: 250,
            battery_10mv: 360,
            load_ma: 600,
            shaft: Shaft::Free,
            attainable_rpm: None,
            sensor_fails: false,
            internal_error: false,
            bus: BusState::Active,
            bus_error: None,
            bus_bit_rate: None,
            enable: true,
            limit_switches: [false; 2],
            calibration_switch: false,
            key: None,
            forced: [false; FaultKind::ALL.len()],
        }
    }
}

impl Inputs {
    /// Below this voltage the output stage, or the control, counts as not supplied. The manual gives no number: an
    /// assumption.
    pub const SUPPLY_PRESENT_100MV: u16 = 100;
    /// Fault A, together with a motor current above [`Inputs::UNDERVOLTAGE_CURRENT_MA`] (table 2).
    pub const UNDERVOLTAGE_100MV: u16 = 180;
    /// See [`Inputs::UNDERVOLTAGE_100MV`].
    pub const UNDERVOLTAGE_CURRENT_MA: u16 = 200;
    /// Fault G above it (table 2).
    pub const OVERVOLTAGE_100MV: u16 = 350;
    /// Fault D above it (table 2).
    pub const OVERTEMPERATURE_100MDEGC: i16 = 900;
    /// Fault J below it (table 2).
    pub const BATTERY_EMPTY_10MV: i16 = 220;
    /// Warning below it (table 1, bit 12). The manual gives no number: an assumption.
    pub const BATTERY_LOW_10MV: i16 = 260;
    /// Warning above it, and fault C after four seconds (table 2).
    pub const OVERCURRENT_MA: u16 = 2400;
    /// The current that torque deactivation counts as 100 %. The manual gives no number; with this one the largest
    /// threshold, 124 %, is just above the current that causes a fault anyway.
    pub const RATED_CURRENT_MA: u16 = 2000;
    /// The current of a motor that holds its position. The manual gives no number: an assumption.
    pub const HOLDING_CURRENT_MA: u16 = 50;

    /// Forces the cause of a fault, so that the fault comes at once and cannot be reset.
    pub fn force(&mut self, kind: FaultKind) {
        self.forced[kind as usize] = true;
    }

    /// Removes the cause of a fault, forced or not: the inputs behind it are as in [`Inputs::default`] again.
    pub fn clear(&mut self, kind: FaultKind) {
        let well = Inputs::default();
        self.forced[kind as usize] = false;
        match kind {
            FaultKind::Undervoltage | FaultKind::Overvoltage => {
                self.output_stage_supply_100mv = well.output_stage_supply_100mv;
            }
            FaultKind::ShaftBlocked => self.shaft = well.shaft,
            FaultKind::Overcurrent => self.load_ma = well.load_ma,
            FaultKind::Overtemperature => self.temperature_100mdegc = well.temperature_100mdegc,
            FaultKind::Sensor => self.sensor_fails = well.sensor_fails,
            FaultKind::Internal => self.internal_error = well.internal_error,
            FaultKind::BusPassive | FaultKind::BusOff => (self.bus, self.bus_error) = (well.bus, well.bus_error),
            FaultKind::Battery => self.battery_10mv = well.battery_10mv,
        }
    }

    /// Whether the control is supplied; otherwise the drive is off.
    #[must_use]
    pub const fn control_is_supplied(&self) -> bool {
        self.control_supply_100mv >= Self::SUPPLY_PRESENT_100MV
    }

    /// Whether the output stage is supplied (table 1, bit 10).
    #[must_use]
    pub const fn supply_is_present(&self) -> bool {
        self.output_stage_supply_100mv >= Self::SUPPLY_PRESENT_100MV
    }

    /// Whether the supply is within its tolerance (table 21, bit 4).
    #[must_use]
    pub const fn supply_is_good(&self) -> bool {
        self.output_stage_supply_100mv >= Self::UNDERVOLTAGE_100MV
            && self.output_stage_supply_100mv <= Self::OVERVOLTAGE_100MV
    }

    /// Whether the battery should be replaced (table 1, bit 12).
    #[must_use]
    pub const fn battery_is_low(&self) -> bool {
        self.battery_10mv < Self::BATTERY_LOW_10MV
    }
}
