//! Positions that inputs latch.

use std::fmt;

use lexican_runtime::object::DataType;

use super::number::Number;

/// Positions that inputs latch (touch probe).
#[derive(Clone, Copy, Debug)]
pub struct Latches {
    /// The register that arms latches.
    pub control: Number,
    /// The register that says which have latched.
    pub status: Number,
    /// One latch each.
    pub rows: &'static [Latch],
}

/// A latch.
#[derive(Clone, Copy, Debug)]
pub struct Latch {
    /// What makes it latch.
    pub trigger: Trigger,
    /// The bits that arm it.
    pub enable: i64,
    /// The status bit that says that it has latched.
    pub valid: i64,
    /// The latched position.
    pub position: Number,
}

/// What latches a position.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Trigger {
    /// A rising edge of the input with this number in the drive.
    Rising(u8),
    /// A falling edge of the input with this number.
    Falling(u8),
    /// The index pulse of the encoder.
    Index,
}

impl Latches {
    /// Two inputs, with either edge, as in CiA 402-2 (60B8h to 60BDh).
    pub const CIA_402: Latches = Latches {
        control: Number::new(0x60B8, 0x00, DataType::Unsigned16),
        status: Number::new(0x60B9, 0x00, DataType::Unsigned16),
        rows: &[
            Latch { trigger: Trigger::Rising(1), enable: 0x0011, valid: 0x0002, position: position(0x60BA) },
            Latch { trigger: Trigger::Falling(1), enable: 0x0021, valid: 0x0004, position: position(0x60BB) },
            Latch { trigger: Trigger::Rising(2), enable: 0x1100, valid: 0x0200, position: position(0x60BC) },
            Latch { trigger: Trigger::Falling(2), enable: 0x2100, valid: 0x0400, position: position(0x60BD) },
        ],
    };
}

const fn position(index: u16) -> Number {
    Number::new(index, 0x00, DataType::Integer32)
}

impl fmt::Display for Trigger {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Trigger::Rising(input) => write!(f, "rising edge of input {input}"),
            Trigger::Falling(input) => write!(f, "falling edge of input {input}"),
            Trigger::Index => f.write_str("index pulse"),
        }
    }
}
