//! Parameters by their PROFIBUS number (PNU, table 15), as data.

use lexican_profibus::pkw::{Access, Format, Parameter};
use lexican_runtime::object::Address;

/// A parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Row {
    /// How it goes through the PKW.
    pub wire: Parameter,
    /// Its name, as the English manual has it.
    pub name: &'static str,
    /// Its unit: `position` is increments, or 1/100 mm with a spindle pitch.
    pub unit: &'static str,
    /// Its number in the chapter that describes parameters.
    pub parameter: Option<u8>,
    /// What it holds.
    pub content: Content,
    /// What single values mean.
    pub values: &'static [(u16, &'static str)],
}

/// What a parameter holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Content {
    /// What a CANopen object holds, with the same numbers.
    Object(Address),
    /// 6060h with other numbers: 1 and 2 change places.
    Mode,
    /// 1003h:01 to :0A, as letters instead of codes, from index 0.
    Faults,
    /// The address of the slave. 2101h is that of CAN.
    Address,
    /// The version of the firmware in BCD; that of PROFIBUS is another one than 100Ah.
    Version,
    /// What 1011h does with a signature, and clearing 1003h: by numbers.
    Load,
    /// Parameter 25, for which the AG02 has no object.
    InchingStop,
}

include!(concat!(env!("OUT_DIR"), "/ag02.rs"));
include!(concat!(env!("OUT_DIR"), "/ag03-1.rs"));

/// The row with this number.
#[must_use]
pub fn find(table: &'static [Row], number: u16) -> Option<&'static Row> {
    table.iter().find(|row| row.wire.number == number)
}
