//! Bits of the drive's words: 1002h (table 1), 6041h (table 21), 6040h (table 23), 2420h.

/// Bits of the system status word 1002h (table 1).
pub mod system {
    #![allow(missing_docs, reason = "the names say what the manual's table says")]
    /// In the AG02.
    pub const LIMIT_SWITCH_1: u16 = 1 << 0;
    /// In the AG02.
    pub const LIMIT_SWITCH_2: u16 = 1 << 1;
    /// In the AG02.
    pub const CALIBRATION_SWITCH: u16 = 1 << 2;
    pub const IN_POSITION: u16 = 1 << 3;
    pub const MOVING: u16 = 1 << 4;
    pub const ABOVE_UPPER_LIMIT: u16 = 1 << 5;
    pub const BELOW_LOWER_LIMIT: u16 = 1 << 6;
    /// Without torque. The English manual calls it "enabled".
    pub const MOTOR_RELEASED: u16 = 1 << 7;
    pub const FAULT: u16 = 1 << 8;
    pub const AGAINST_APPROACH: u16 = 1 << 9;
    pub const NO_SUPPLY: u16 = 1 << 10;
    /// In the AG02, which has an enable input.
    pub const ENABLE_INACTIVE: u16 = 1 << 10;
    pub const NOT_READY: u16 = 1 << 11;
    pub const BATTERY_LOW: u16 = 1 << 12;
    pub const OVERCURRENT: u16 = 1 << 13;
    pub const POSITIONING: u16 = 1 << 14;
    pub const LAG_ERROR: u16 = 1 << 15;
}

/// Bits of the status word 6041h beyond those of the state (table 21).
pub mod status {
    #![allow(missing_docs, reason = "the names say what the manual's table says")]
    pub const VOLTAGE_ENABLED: u16 = 1 << 4;
    pub const WARNING: u16 = 1 << 7;
    pub const READY: u16 = 1 << 8;
    pub const REMOTE: u16 = 1 << 9;
    pub const TARGET_REACHED: u16 = 1 << 10;
    pub const INTERNAL_LIMIT: u16 = 1 << 11;
    /// Positioning mode: setpoint acknowledged.
    pub const ACKNOWLEDGED: u16 = 1 << 12;
    /// Velocity mode: the drive stands still.
    pub const STANDSTILL: u16 = 1 << 12;
    pub const POSITIONING: u16 = 1 << 14;
    pub const MOVING: u16 = 1 << 15;
}

/// Bits of the control word 6040h beyond those of the commands (table 23).
pub mod control {
    #![allow(missing_docs, reason = "the names say what the manual's table says")]
    pub const NEW_SETPOINT: u16 = 1 << 4;
    pub const FAULT_RESET: u16 = 1 << 7;
    pub const STOP: u16 = 1 << 8;
    pub const INCHING_1: u16 = 1 << 13;
    pub const INCHING_2_POSITIVE: u16 = 1 << 14;
    pub const INCHING_2_NEGATIVE: u16 = 1 << 15;
}

/// Bits of the generic status register 2420h.
pub mod generic {
    #![allow(missing_docs, reason = "the names say what the manual's table says")]
    pub const SUPPLY_PRESENT: u8 = 1 << 4;
    pub const TORQUE_DEACTIVATED: u8 = 1 << 7;
}
