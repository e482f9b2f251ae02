//! What the drive keeps without power, as a text and as a file.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use lexican_runtime::host::kept::{KeptError, KeptFile};
use lexican_runtime::object::Address;

use super::model::Model;

/// What survives without power: the EEPROM, and the absolute encoder with its battery.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct NonVolatile {
    /// The persistent entries, in wire form.
    pub eeprom: BTreeMap<Address, u64>,
    /// The position as 6064h shows it.
    pub position: i32,
    /// Parameter 25 of a drive that has no object for it: how inching operation 2 stops, 0 with full deceleration, 1 with
    /// its own.
    pub inching_stop: u8,
}

impl NonVolatile {
    /// As a text, which is what the file holds:
    ///
    /// ```text
    /// lexican siko/ag03-1 eeprom 1
    /// position -5000
    /// 2410:01 0x64
    /// end 1 entries, crc32 3B0D4C1F
    /// ```
    ///
    /// The first line says what the file is, and the last one that it is whole: a file that was cut off, edited without
    /// the checksum, or written by something else is refused, and is never taken for a new drive.
    ///
    /// A drive without 2416h has a line `inching_stop 1` behind the position.
    #[must_use]
    pub fn to_text(&self, model: &Model) -> String {
        let position = format!("position {}", self.position);
        let inching_stop = (!model.has_inching_stop()).then(|| format!("{INCHING_STOP} {}", self.inching_stop));
        let entries = self.eeprom.iter().map(|(address, raw)| format!("{address} {raw:#x}"));
        let lines: Vec<String> = [position].into_iter().chain(inching_stop).chain(entries).collect();
        model.eeprom.seal(&lines)
    }

    /// What a text holds.
    ///
    /// # Errors
    ///
    /// It is not the text of such a drive, or not whole.
    pub fn from_text(model: &Model, text: &str) -> Result<Self, EepromError> {
        let lines = model.eeprom.unseal(text).map_err(|error| EepromError::of(error, model))?;
        let mut kept = NonVolatile::default();
        for (line, words) in (2..).zip(&lines) {
            kept.take(model, words).ok_or(EepromError::Line { line })?;
        }
        Ok(kept)
    }

    fn take(&mut self, model: &Model, line: &str) -> Option<()> {
        let (name, value) = line.split_once(' ')?;
        if name == "position" {
            self.position = value.parse().ok()?;
            return Some(());
        }
        if name == INCHING_STOP && !model.has_inching_stop() {
            self.inching_stop = value.parse().ok().filter(|stop| *stop <= 1)?;
            return Some(());
        }
        let (index, sub) = name.split_once(':')?;
        let address = Address::new(u16::from_str_radix(index, 16).ok()?, u8::from_str_radix(sub, 16).ok()?);
        let raw = u64::from_str_radix(value.strip_prefix("0x")?, 16).ok()?;
        let kept = model.persistent.contains(&address);
        kept.then(|| self.eeprom.insert(address, raw))?;
        Some(())
    }
}

/// What a line begins with that has parameter 25.
const INCHING_STOP: &str = "inching_stop";

/// Why a text is not what a drive keeps.
#[derive(Clone, Debug, thiserror::Error)]
pub enum EepromError {
    /// There is nothing in it.
    #[error("{}", KeptError::Empty)]
    Empty,
    /// Something else has written it.
    #[error("not the EEPROM of a simulated {model}: {error}")]
    Foreign {
        /// Which drive it is not of.
        model: &'static str,
        /// What is wrong.
        error: KeptError,
    },
    /// Another version of this program has written it.
    #[error("the EEPROM of a simulated {model}, but {error}")]
    Version {
        /// Which drive it is of.
        model: &'static str,
        /// What is wrong.
        error: KeptError,
    },
    /// Its end is missing, or its checksum is that of another text.
    #[error("{}", KeptError::Torn)]
    Torn,
    /// A line is neither the position nor an entry that the drive keeps.
    #[error("line {line} is neither `position -5000` nor an entry that the drive keeps, such as `2410:01 0x64`")]
    Line {
        /// Which line, counted from 1.
        line: u32,
    },
    /// The file cannot be read or written.
    #[error("{error}")]
    Io {
        /// What the operating system says.
        error: Arc<io::Error>,
    },
    /// Which file it is about.
    #[error("{}: {error}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        error: Box<EepromError>,
    },
}

/// A file that holds what a drive keeps.
#[derive(Clone, Debug)]
pub(super) struct EepromFile {
    model: &'static Model,
    file: KeptFile,
    path: PathBuf,
    /// What was saved last; `None` when that is not known.
    saved: Option<NonVolatile>,
    /// Why it could not be written the last time.
    trouble: Option<EepromError>,
}

impl EepromFile {
    /// The file, and what it holds; `None` when there is no such file yet.
    pub(super) fn open(model: &'static Model, path: &Path) -> Result<(Self, Option<NonVolatile>), EepromError> {
        let named = |error| EepromError::File { path: path.to_owned(), error: Box::new(error) };
        let (file, text) = KeptFile::open(path).map_err(|error| named(error.into()))?;
        let saved = text.map(|text| NonVolatile::from_text(model, &text).map_err(named)).transpose()?;
        let kept = saved.clone();
        Ok((EepromFile { model, file, path: path.to_owned(), saved, trouble: None }, kept))
    }

    /// Writes what is to be kept, unless the file holds it already.
    pub(super) fn save(&mut self, kept: NonVolatile) {
        if self.saved.as_ref() == Some(&kept) {
            return;
        }
        let written = self.file.save(kept.to_text(self.model));
        // Also when it could not be written: it is tried again when something is new.
        self.saved = Some(kept);
        self.trouble =
            written.err().map(|error| EepromError::File { path: self.path.clone(), error: Box::new(error.into()) });
    }

    pub(super) fn saved(&self) -> Option<&NonVolatile> {
        self.saved.as_ref()
    }

    pub(super) fn trouble(&self) -> Option<&EepromError> {
        self.trouble.as_ref()
    }
}

impl From<io::Error> for EepromError {
    fn from(error: io::Error) -> Self {
        EepromError::Io { error: Arc::new(error) }
    }
}

impl EepromError {
    fn of(error: KeptError, model: &Model) -> Self {
        let model = model.name;
        match error {
            KeptError::Empty => EepromError::Empty,
            KeptError::Foreign(_) => EepromError::Foreign { model, error },
            KeptError::Version(_) => EepromError::Version { model, error },
            KeptError::Torn => EepromError::Torn,
        }
    }
}
