//! The bits of control word (6040h) and status word (6041h) that all modes share.

/// Bits of the control word (CiA 402-2, 8.4.1).
#[allow(missing_docs, reason = "the names say what it is")]
pub mod control {
    pub const SWITCH_ON: u16 = 1 << 0;
    pub const ENABLE_VOLTAGE: u16 = 1 << 1;
    /// Cleared to command a quick stop.
    pub const QUICK_STOP: u16 = 1 << 2;
    pub const ENABLE_OPERATION: u16 = 1 << 3;
    /// New set-point (profile position mode).
    pub const NEW_SET_POINT: u16 = 1 << 4;
    /// Homing operation start (homing mode).
    pub const HOMING_OPERATION_START: u16 = 1 << 4;
    /// Enable interpolation (interpolated position mode).
    pub const ENABLE_INTERPOLATION: u16 = 1 << 4;
    /// Change set immediately (profile position mode).
    pub const CHANGE_IMMEDIATELY: u16 = 1 << 5;
    /// The target position is relative (profile position mode).
    pub const RELATIVE: u16 = 1 << 6;
    /// Fault reset, by its rising edge.
    pub const FAULT_RESET: u16 = 1 << 7;
    pub const HALT: u16 = 1 << 8;
    /// Change on set-point (profile position mode).
    pub const CHANGE_ON_SET_POINT: u16 = 1 << 9;
}

/// Bits of the status word (CiA 402-2, 8.4.2).
#[allow(missing_docs, reason = "the names say what it is")]
pub mod status {
    pub const READY_TO_SWITCH_ON: u16 = 1 << 0;
    pub const SWITCHED_ON: u16 = 1 << 1;
    pub const OPERATION_ENABLED: u16 = 1 << 2;
    pub const FAULT: u16 = 1 << 3;
    pub const VOLTAGE_ENABLED: u16 = 1 << 4;
    /// Cleared during a quick stop.
    pub const QUICK_STOP: u16 = 1 << 5;
    pub const SWITCH_ON_DISABLED: u16 = 1 << 6;
    pub const WARNING: u16 = 1 << 7;
    /// Remote: the control word is obeyed.
    pub const REMOTE: u16 = 1 << 9;
    pub const TARGET_REACHED: u16 = 1 << 10;
    /// Internal limit active.
    pub const INTERNAL_LIMIT: u16 = 1 << 11;
    /// Set-point acknowledge (profile position mode); speed is zero (profile velocity mode).
    pub const SET_POINT_ACKNOWLEDGE: u16 = 1 << 12;
    /// Homing attained (homing mode).
    pub const HOMING_ATTAINED: u16 = 1 << 12;
    /// Homing error (homing mode).
    pub const HOMING_ERROR: u16 = 1 << 13;
    /// Following error (profile position mode).
    pub const FOLLOWING_ERROR: u16 = 1 << 13;
}
