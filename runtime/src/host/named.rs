//! Objects by name, for tools: names and meanings are those of the dictionary.

use core::fmt;
use std::borrow::ToOwned as _;
use std::string::{String, ToString as _};
use std::vec::Vec;

use super::AccessError;
use crate::object::{DataType, Name};

/// A dictionary has no object of a name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub struct UnknownName {
    /// What was asked for.
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

/// Finds an object. Letters and digits count: `position-actual-value` is "Position actual value".
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

/// What a node holds in an object.
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

    /// The number in wire form; `None` of a text, and of a value of another length than in the data sheet.
    #[must_use]
    pub fn raw(&self) -> Option<u64> {
        let mut raw = [0; 8];
        let size = self.name.data_type.size().filter(|size| *size == self.bytes.len())?;
        raw.get_mut(..size)?.copy_from_slice(&self.bytes);
        Some(u64::from_le_bytes(raw))
    }
}

/// By name and unit: `24.5 V`, `profile velocity (3)`, `ready to switch on + operation mode 2`. A text as it is, other bytes in
/// hexadecimal.
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

/// The bytes of a value that is written as text: see [`Name::parse`]; a text is its own bytes.
pub(super) fn encode(name: &'static Name, text: &str) -> Result<Vec<u8>, AccessError> {
    if name.data_type == DataType::VisibleString {
        return Ok(text.to_owned().into_bytes());
    }
    let &Name { address, name: of, data_type, .. } = name;
    let raw = name.parse(text).map_err(|why| AccessError::NoValue { address, name: of, why: why.to_string() })?;
    Ok(raw.to_le_bytes().into_iter().take(data_type.size().unwrap_or(8)).collect())
}
