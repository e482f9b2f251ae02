//! Objects by name, for tools: names and meanings come from the dictionary.

use core::fmt;
use std::borrow::ToOwned as _;
use std::string::{String, ToString as _};
use std::vec::Vec;

use super::AccessError;
use crate::object::{DataType, Name};

/// A dictionary has no object with this name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub struct UnknownName {
    /// The name that was asked for.
    pub name: String,
    /// Names that contain it.
    pub near: Vec<&'static str>,
}

impl fmt::Display for UnknownName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the dictionary has no object {:?}", self.name)?;
        match self.near.as_slice() {
            [] => Ok(()),
            near => write!(f, "; there is {}", near.join(", ")),
        }
    }
}

/// Finds an object by its letters and digits: `position-actual-value` is "Position actual value".
pub(super) fn find(names: &'static [Name], text: &str) -> Result<&'static Name, UnknownName> {
    let wanted = plain(text);
    if let Some(name) = names.iter().find(|name| plain(name.name) == wanted) {
        return Ok(name);
    }
    let near = names.iter().map(|name| name.name).filter(|name| plain(name).contains(&wanted)).take(3).collect();
    Err(UnknownName { name: text.to_owned(), near })
}

fn plain(text: &str) -> String {
    text.chars().filter(|letter| letter.is_alphanumeric()).flat_map(char::to_lowercase).collect()
}

/// The value of an object that was read from a node.
#[derive(Clone, Debug, PartialEq)]
pub struct Reading {
    name: &'static Name,
    bytes: Vec<u8>,
}

impl Reading {
    pub(super) const fn new(name: &'static Name, bytes: Vec<u8>) -> Self {
        Reading { name, bytes }
    }

    /// The bytes as they came.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// The number in wire form; `None` for a text, or if the length differs from the data sheet.
    #[must_use]
    pub fn raw(&self) -> Option<u64> {
        let mut raw = [0; 8];
        let size = self.name.data_type.size().filter(|size| *size == self.bytes.len())?;
        raw.get_mut(..size)?.copy_from_slice(&self.bytes);
        Some(u64::from_le_bytes(raw))
    }
}

/// With names and units: `24.5 V`, `profile velocity (3)`, `ready to switch on + operation mode 2`. A text is shown as
/// it is, other bytes in hexadecimal.
impl fmt::Display for Reading {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(raw) = self.raw() {
            return self.name.show(raw).fmt(f);
        }
        match (self.name.data_type, core::str::from_utf8(&self.bytes)) {
            (DataType::VisibleString, Ok(text)) => f.pad(text.trim_end_matches('\0')),
            _ => self.bytes.iter().try_for_each(|byte| write!(f, "{byte:02X}")),
        }
    }
}

/// The bytes of a value given as text: see [`Name::parse`]; a text object takes the text itself.
pub(super) fn encode(name: &'static Name, text: &str) -> Result<Vec<u8>, AccessError> {
    if name.data_type == DataType::VisibleString {
        return Ok(text.to_owned().into_bytes());
    }
    let &Name { address, name: of, data_type, .. } = name;
    let raw = name.parse(text).map_err(|why| AccessError::NoValue { address, name: of, why: why.to_string() })?;
    Ok(raw.to_le_bytes().into_iter().take(data_type.size().unwrap_or(8)).collect())
}
