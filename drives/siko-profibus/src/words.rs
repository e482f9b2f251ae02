//! Control word (STW) and status word (ZSW) of these drives (tables 11 to 14): bits of PROFIDRIVE, some of which are
//! missing, and bits of SIKO.

pub use lexican_profibus::profidrive::{control, status};

/// Control word, positioning mode: inching 2 goes in negative direction.
pub const INCHING_NEGATIVE: u16 = 1 << 15;
/// Status word, positioning mode: the position is beyond a limit.
pub const BEYOND_LIMIT: u16 = 1 << 14;
/// Status word: ready to travel.
pub const READY_TO_TRAVEL: u16 = 1 << 15;

/// The control words of figures 13 and 14 (AG02).
pub mod order {
    /// OFF 1: the motor is released.
    pub const OFF: u16 = 0x0000;
    /// Enables operation. In velocity mode it stops, in positioning mode it discards a travel.
    pub const ENABLE: u16 = 0x000B;
    /// Ready to travel: an edge of bit 6 starts.
    pub const READY: u16 = 0x003B;
    /// The bit whose edges start a travel.
    pub const START: u16 = super::control::START;
    /// An intermediate stop, to be followed by [`READY`].
    pub const INTERMEDIATE_STOP: u16 = 0x001B;
    /// Inching 1.
    pub const INCHING_1: u16 = 0x010B;
    /// Inching 2 in positive direction.
    pub const INCHING_2_POSITIVE: u16 = 0x020B;
    /// Inching 2 in negative direction.
    pub const INCHING_2_NEGATIVE: u16 = 0x820B;
    /// Velocity mode: turns with the target velocity.
    pub const TURN: u16 = 0x004B;
    /// Acknowledges a fault.
    pub const ACKNOWLEDGE: u16 = super::control::ACKNOWLEDGE;
}
