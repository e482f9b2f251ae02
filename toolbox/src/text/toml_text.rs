//! Parses TOML, with errors by line.

use serde::de::DeserializeOwned;

/// The text is no TOML, or has unknown keys or invalid values.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {reason}")]
pub struct TomlError {
    /// From 1.
    pub line: usize,
    /// What is wrong.
    pub reason: String,
}

/// Reads a text.
pub fn parse<T: DeserializeOwned>(text: &str) -> Result<T, TomlError> {
    toml::from_str(text).map_err(|error| {
        let line = line(text, error.span().map_or(0, |span| span.start));
        TomlError { line, reason: error.message().to_owned() }
    })
}

/// The line (from 1) of a byte offset.
#[must_use]
pub fn line(text: &str, at: usize) -> usize {
    text.get(..at).map_or(0, |before| before.matches('\n').count()) + 1
}
