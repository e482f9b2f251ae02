//! Files that users name: reading them, with useful errors, and not overwriting them by accident.

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
/// A text that is too large for a data sheet is cut off, which parsing reports.
pub fn read(path: &Path) -> Result<Source, ReadError> {
    // One byte more than allowed, so that parsing reports the file as too large.
    let bytes = read_up_to(path, lexican_eds::text::MAX_BYTES + 1)?;
    Ok(Source::from_bytes(path.display().to_string(), &bytes))
}

/// Reads at most `bound` bytes of a file, which may be larger than the memory, or endless.
pub fn read_up_to(path: &Path, bound: usize) -> Result<Vec<u8>, ReadError> {
    let failed = |error| ReadError { path: path.to_owned(), error };
    let file = File::open(path).map_err(failed)?;
    let mut bytes = Vec::new();
    file.take(bound as u64).read_to_end(&mut bytes).map_err(failed)?;
    Ok(bytes)
}

/// What to do with an existing file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Existing {
    /// Keep it, and write nothing.
    #[default]
    Keep,
    /// Replace it.
    Replace,
}

impl Existing {
    /// Checks whether a file may be written: pipes and devices always, files in `read` never. Errors:
    /// [`io::ErrorKind::AlreadyExists`] if it exists and is to be kept, [`io::ErrorKind::ResourceBusy`] if it is being
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

/// Whether two paths are the same file.
#[cfg(unix)]
fn is_same(a: &Path, b: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let inode = |path: &Path| std::fs::metadata(path).ok().map(|data| (data.dev(), data.ino()));
    inode(a).is_some_and(|a| Some(a) == inode(b))
}

/// Whether two paths are the same file.
#[cfg(not(unix))]
fn is_same(a: &Path, b: &Path) -> bool {
    let whole = |path: &Path| std::fs::canonicalize(path).ok();
    whole(a).is_some_and(|a| Some(a) == whole(b))
}

/// The operating system's message, in lower case and without the error number.
#[must_use]
pub fn reason(error: &io::Error) -> String {
    let text = error.to_string();
    let text = text.split(" (os error").next().unwrap_or_default();
    let mut letters = text.chars();
    letters.next().map(|first| first.to_lowercase().chain(letters).collect()).unwrap_or_default()
}
