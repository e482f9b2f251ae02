//! Reactions of the drive that an option code chooses.

use std::fmt;

use lexican_runtime::object::DataType;

use super::number::Number;

/// A situation in which an option code chooses what the drive does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Reaction {
    /// On the command Quick Stop (605Ah).
    QuickStop,
    /// On the command Shutdown (605Bh).
    Shutdown,
    /// On the command Disable Operation (605Ch).
    DisableOperation,
    /// On Halt (605Dh).
    Halt,
    /// On a fault (605Eh).
    Fault,
}

impl Reaction {
    /// The option codes of CiA 402-2.
    pub const CIA_402: &'static [(Reaction, Number)] = &[
        (Reaction::QuickStop, Number::new(0x605A, 0x00, DataType::Integer16)),
        (Reaction::Shutdown, Number::new(0x605B, 0x00, DataType::Integer16)),
        (Reaction::DisableOperation, Number::new(0x605C, 0x00, DataType::Integer16)),
        (Reaction::Halt, Number::new(0x605D, 0x00, DataType::Integer16)),
        (Reaction::Fault, Number::new(0x605E, 0x00, DataType::Integer16)),
    ];
}

impl fmt::Display for Reaction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Reaction::QuickStop => "Quick Stop",
            Reaction::Shutdown => "Shutdown",
            Reaction::DisableOperation => "Disable Operation",
            Reaction::Halt => "Halt",
            Reaction::Fault => "a fault",
        })
    }
}
