//! Parameters of interfaces other than CANopen, such as a serial port or PROFIBUS-DP.

use std::fmt;

use super::{Condition, Entry, Named};
use crate::model::types::DataType;
use crate::text::Span;

/// Another interface of the device, whose parameters mostly are objects under other numbers.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Interface {
    /// What it is.
    pub description: Option<String>,
    /// The parameters, in the order of the overlay.
    pub parameters: Vec<Parameter>,
    /// Where the overlay describes it.
    pub span: Span,
}

/// A parameter of another interface.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// What the interface calls it.
    pub number: ParameterNumber,
    /// What it is: the object that it equals, with what differs. Its index is 0, which no object has, if it equals none.
    pub entry: Entry,
    /// How many elements it has: those of an ARRAY, from sub-index 1 on; else 1.
    pub elements: u8,
    /// The data type that the interface has for it; the numbers mean what those of the object do.
    pub data_type: DataType,
    /// The numbers that the interface has for values of the enumeration, by their names; none where they are the same.
    pub values: Vec<Named<i128>>,
    /// When this is what the number stands for, if it stands for several things.
    pub when: Option<Condition>,
    /// Where the overlay describes it.
    pub span: Span,
}

/// How an interface addresses a parameter.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ParameterNumber {
    /// By a number, such as a PNU.
    Number(u16),
    /// By a text, such as the commands that read and write it.
    Text(String),
}

impl Interface {
    pub(super) fn clear_spans(&mut self) {
        self.span = Span::default();
        for parameter in &mut self.parameters {
            (parameter.span, parameter.entry.span) = (Span::default(), Span::default());
        }
    }
}

impl Parameter {
    /// Index and sub-index of the object that it equals; of an ARRAY, of its first element.
    #[must_use]
    pub fn object(&self) -> Option<(u16, u8)> {
        (self.entry.index > 0).then_some((self.entry.index, self.entry.sub))
    }
}

/// `1016`, or `E1/F1`.
impl fmt::Display for ParameterNumber {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ParameterNumber::Number(number) => number.fmt(f),
            ParameterNumber::Text(text) => text.fmt(f),
        }
    }
}
