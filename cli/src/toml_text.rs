//! What people write in TOML.

use lexican_toolbox::text::toml_text::TomlError;
use serde::de::DeserializeOwned;

/// Reads a text. On failure, the line and the reason: `:3: unknown field`.
pub(crate) fn parse<T: DeserializeOwned>(text: &str) -> Result<T, String> {
    lexican_toolbox::text::toml_text::parse(text).map_err(|TomlError { line, reason }| format!(":{line}: {reason}"))
}
