//! What people write in TOML.

use serde::Deserialize;

/// Reads a text. On failure, the line and the reason: `:3: unknown field`.
pub(crate) fn parse<T: for<'de> Deserialize<'de>>(text: &str) -> Result<T, String> {
    toml::from_str(text).map_err(|error| {
        let line = error.span().map(|span| format!(":{}", line(text, span.start))).unwrap_or_default();
        format!("{line}: {}", error.message())
    })
}

/// The line of a place in a text, from 1.
pub(crate) fn line(text: &str, at: usize) -> usize {
    text.get(..at).map_or(0, |before| before.matches('\n').count()) + 1
}
