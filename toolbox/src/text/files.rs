//! Files that people name: reading them, saying why they cannot be read, and not replacing them by accident.

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
/// A text that is too large for a data sheet is cut, and says so when it is parsed.
pub fn read(path: &Path) -> Result<Source, ReadError> {
    // One byte beyond the bound, so that the file is reported as too large.
    let bytes = read_up_to(path, lexican_eds::text::MAX_BYTES + 1)?;
    Ok(Source::from_bytes(path.display().to_string(), &bytes))
}

/// Reads the first bytes of a file, which may be larger than the memory, or have no end.
pub fn read_up_to(path: &Path, bound: usize) -> Result<Vec<u8>, ReadError> {
    let failed = |error| ReadError { path: path.to_owned(), error };
    let file = File::open(path).map_err(failed)?;
    let mut bytes = Vec::new();
    file.take(bound as u64).read_to_end(&mut bytes).map_err(failed)?;
    Ok(bytes)
}

/// What becomes of an existing file that is to be written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Existing {
    /// It stays, and nothing is written.
    #[default]
    Keep,
    /// It is replaced.
    Replace,
}

impl Existing {
    /// Whether a file may be written. Pipes and devices always may, those that are `read` meanwhile never.
    ///
    /// Errors: [`io::ErrorKind::AlreadyExists`] if there is a file that stays, [`io::ErrorKind::ResourceBusy`] if it is
    /// read.
    pub fn guard<'a>(self, path: &Path, read: impl IntoIterator<Item = &'a Path>) -> io::Result<()> {
        if !path.is_file() {
            return Ok(());
        }
        if read.into_iter().any(|read| is_same(read, path)) {
            return Err(io::Error::new(io::ErrorKind::ResourceBusy, "it is read at the same time"));
        }
        match self {
            Existing::Keep => Err(io::Error::new(io::ErrorKind::AlreadyExists, "it is there already")),
            Existing::Replace => Ok(()),
        }
    }
}

/// Whether two paths lead to one file.
#[cfg(unix)]
fn is_same(a: &Path, b: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let inode = |path: &Path| std::fs::metadata(path).ok().map(|data| (data.dev(), data.ino()));
    inode(a).is_some_and(|a| Some(a) == inode(b))
}

/// Whether two paths lead to one file.
#[cfg(not(unix))]
fn is_same(a: &Path, b: &Path) -> bool {
    let whole = |path: &Path| std::fs::canonicalize(path).ok();
    whole(a).is_some_and(|a| Some(a) == whole(b))
}

/// The message of the operating system, in lower case and without its number.
#[must_use]
pub fn reason(error: &io::Error) -> String {
    let text = error.to_string();
    let text = text.split(" (os error").next().unwrap_or_default();
    let mut letters = text.chars();
    letters.next().map(|first| first.to_lowercase().chain(letters).collect()).unwrap_or_default()
}
