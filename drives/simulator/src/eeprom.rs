//! A file for the data that a device keeps without power.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use lexican_runtime::host::kept::{KeptError, KeptFile, KeptFormat};
use lexican_runtime::object::Address;

/// The kind of device that a file belongs to.
#[derive(Clone, Copy, Debug)]
pub struct EepromFormat {
    /// The format of the text.
    pub text: KeptFormat,
    /// The name of the device in messages.
    pub device: &'static str,
    /// What a line holds, for a message: "the position, or an entry that the drive keeps".
    pub line: &'static str,
}

impl EepromFormat {
    /// Hands each line of a text to `take`, which returns `None` for a line that does not belong to this device.
    pub fn read(&self, text: &str, mut take: impl FnMut(&str) -> Option<()>) -> Result<(), EepromError> {
        let device = self.device;
        let lines = self.text.unseal(text).map_err(|error| match error {
            KeptError::Empty => EepromError::Empty,
            KeptError::Foreign(_) => EepromError::Foreign { device, error },
            KeptError::Version(_) => EepromError::Version { device, error },
            KeptError::Torn => EepromError::Torn,
        })?;
        for (line, text) in (2..).zip(&lines) {
            take(text).ok_or_else(|| EepromError::Line { line, text: text.clone(), wanted: self.line })?;
        }
        Ok(())
    }
}

/// The entry and the rest of a line such as `2410:01 64 00`.
#[must_use]
pub fn entry_of_line(line: &str) -> Option<(Address, &str)> {
    let (name, value) = line.split_once(' ').unwrap_or((line, ""));
    let (index, sub) = name.split_once(':')?;
    let address = Address::new(u16::from_str_radix(index, 16).ok()?, u8::from_str_radix(sub, 16).ok()?);
    Some((address, value))
}

/// Why a text does not hold the data of a device.
#[derive(Clone, Debug, thiserror::Error)]
#[allow(missing_docs, reason = "the names say what it is")]
pub enum EepromError {
    /// It is empty.
    #[error("{}", KeptError::Empty)]
    Empty,
    /// Something else has written it.
    #[error("not the EEPROM of a simulated {device}: {error}")]
    Foreign { device: &'static str, error: KeptError },
    /// Another version of this program has written it.
    #[error("the EEPROM of a simulated {device}, but {error}")]
    Version { device: &'static str, error: KeptError },
    /// Its end is missing, or its checksum does not match.
    #[error("{}", KeptError::Torn)]
    Torn,
    /// A line does not belong to this device.
    #[error(
        "line {line}: `{text}` is neither {wanted}; name another file, or remove this one to begin with a new device"
    )]
    Line {
        /// Counted from 1.
        line: u32,
        text: String,
        wanted: &'static str,
    },
    /// The file cannot be read or written.
    #[error("{error}")]
    Io { error: Arc<io::Error> },
    /// An error of the file at this path.
    #[error("{}: {error}", path.display())]
    File { path: PathBuf, error: Box<EepromError> },
}

impl From<io::Error> for EepromError {
    fn from(error: io::Error) -> Self {
        EepromError::Io { error: Arc::new(error) }
    }
}

impl EepromError {
    fn of(self, path: &Path) -> Self {
        EepromError::File { path: path.to_owned(), error: Box::new(self) }
    }
}

/// A file that holds the data of a device, of type `K`.
#[derive(Clone, Debug)]
pub struct EepromFile<K> {
    file: KeptFile,
    path: PathBuf,
    /// What was saved last; `None` if that is not known.
    saved: Option<K>,
    /// Why the last write failed.
    trouble: Option<EepromError>,
}

impl<K: Clone + PartialEq> EepromFile<K> {
    /// Opens the file, and reads its content by `read`; `None` if there is no such file yet.
    pub fn open(
        path: &Path,
        read: impl FnOnce(&str) -> Result<K, EepromError>,
    ) -> Result<(Self, Option<K>), EepromError> {
        let (file, text) = KeptFile::open(path).map_err(|error| EepromError::from(error).of(path))?;
        let kept = text.map(|text| read(&text)).transpose().map_err(|error| error.of(path))?;
        Ok((EepromFile { file, path: path.to_owned(), saved: kept.clone(), trouble: None }, kept))
    }

    /// Writes `kept`, unless the file holds it already. After a failure, the next attempt is made when `kept` has
    /// changed.
    pub fn save(&mut self, kept: &K, text: impl FnOnce(&K) -> String) -> Result<(), EepromError> {
        if self.saved.as_ref() != Some(kept) {
            self.trouble = self.file.save(text(kept)).err().map(|error| EepromError::from(error).of(&self.path));
            self.saved = Some(kept.clone());
        }
        self.trouble.clone().map_or(Ok(()), Err)
    }

    /// What was saved last.
    #[must_use]
    pub fn saved(&self) -> Option<&K> {
        self.saved.as_ref()
    }

    /// Why the last write failed; `None` if it did not.
    #[must_use]
    pub fn trouble(&self) -> Option<&EepromError> {
        self.trouble.as_ref()
    }
}
