//! Files that people name: reading them, and saying why they cannot be read.

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use lexican_eds::Source;

/// A file cannot be read.
#[derive(Debug, thiserror::Error)]
#[error("cannot read {}: {}", path.display(), reason(error))]
pub struct ReadError {
    /// The file.
    pub path: PathBuf,
    /// What the operating system says.
    #[source]
    pub error: io::Error,
}

/// Reads a text file in any encoding.
///
/// # Errors
///
/// [`ReadError`]. A text that is too large for a data sheet is cut, and says so when it is parsed.
pub fn read(path: &Path) -> Result<Source, ReadError> {
    // One byte beyond the bound, so that the file is reported as too large.
    let bytes = read_up_to(path, lexican_eds::text::MAX_BYTES + 1)?;
    Ok(Source::from_bytes(path.display().to_string(), &bytes))
}

/// Reads the first bytes of a file, which may be larger than the memory, or have no end.
///
/// # Errors
///
/// [`ReadError`].
pub fn read_up_to(path: &Path, bound: usize) -> Result<Vec<u8>, ReadError> {
    let failed = |error| ReadError { path: path.to_owned(), error };
    let file = File::open(path).map_err(failed)?;
    let mut bytes = Vec::new();
    file.take(bound as u64).read_to_end(&mut bytes).map_err(failed)?;
    Ok(bytes)
}

/// The message of the operating system, in lower case and without its number.
#[must_use]
pub fn reason(error: &io::Error) -> String {
    let text = error.to_string();
    let text = text.split(" (os error").next().unwrap_or_default();
    let mut letters = text.chars();
    letters.next().map(|first| first.to_lowercase().chain(letters).collect()).unwrap_or_default()
}
