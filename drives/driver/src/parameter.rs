//! What an application may set, store and compare in a drive.

use lexican_runtime::object::{Address, DataType};

use crate::description::Number;

/// A parameter of a drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Parameter {
    /// The number in the manual.
    pub number: u8,
    /// The object that holds it.
    pub address: Address,
    /// An integer of one, two or four bytes.
    pub data_type: DataType,
    /// The set with which it is restored.
    pub set: ParameterSet,
}

/// Parameters that a drive restores together (1011h).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ParameterSet {
    /// Those of the control loops and ramps.
    Controller,
    /// Those of the application: units, limits, ways to travel.
    Standard,
}

impl Parameter {
    /// The object that holds it, as a number to read and write.
    #[must_use]
    pub const fn object(&self) -> Number {
        Number::new(self.address.index(), self.address.sub(), self.data_type)
    }
}
