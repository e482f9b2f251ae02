//! What the drive keeps without power, as a text and as a file.

use std::collections::BTreeMap;
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::Arc;

use lexican_runtime::host::kept::{KeptError, KeptFile, KeptFormat};
use lexican_runtime::object::Address;

use crate::od;

/// What survives without power: the EEPROM, and the absolute encoder with its battery.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct NonVolatile {
    /// The persistent entries, in wire form.
    pub eeprom: BTreeMap<Address, u64>,
    /// The position as 6064h shows it.
    pub position: i32,
}

const FORMAT: KeptFormat = KeptFormat { name: "lexican siko/ag03-1 eeprom", version: 1 };

/// The text that [`FromStr`] reads:
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
impl fmt::Display for NonVolatile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let entries = self.eeprom.iter().map(|(address, raw)| format!("{address} {raw:#x}"));
        let lines: Vec<String> = [format!("position {}", self.position)].into_iter().chain(entries).collect();
        f.write_str(&FORMAT.seal(&lines))
    }
}

impl FromStr for NonVolatile {
    type Err = EepromError;

    fn from_str(text: &str) -> Result<Self, EepromError> {
        let lines = FORMAT.unseal(text)?;
        let mut kept = NonVolatile::default();
        for (line, words) in (2..).zip(&lines) {
            kept.take(words).ok_or(EepromError::Line { line })?;
        }
        Ok(kept)
    }
}

impl NonVolatile {
    fn take(&mut self, line: &str) -> Option<()> {
        let (name, value) = line.split_once(' ')?;
        if name == "position" {
            self.position = value.parse().ok()?;
            return Some(());
        }
        let (index, sub) = name.split_once(':')?;
        let address = Address::new(u16::from_str_radix(index, 16).ok()?, u8::from_str_radix(sub, 16).ok()?);
        let raw = u64::from_str_radix(value.strip_prefix("0x")?, 16).ok()?;
        let kept = od::PERSISTENT.contains(&address);
        kept.then(|| self.eeprom.insert(address, raw))?;
        Some(())
    }
}

/// Why a text is not what a drive keeps.
#[derive(Clone, Debug, thiserror::Error)]
pub enum EepromError {
    /// There is nothing in it.
    #[error("{}", KeptError::Empty)]
    Empty,
    /// Something else has written it.
    #[error("not the EEPROM of a simulated AG03/1: {}", KeptError::Foreign(FORMAT))]
    Foreign,
    /// Another version of this program has written it.
    #[error("the EEPROM of a simulated AG03/1, but {}", KeptError::Version(FORMAT))]
    Version,
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
    file: KeptFile,
    path: PathBuf,
    /// What was saved last; `None` when that is not known.
    saved: Option<NonVolatile>,
    /// Why it could not be written the last time.
    trouble: Option<EepromError>,
}

impl EepromFile {
    /// The file, and what it holds; `None` when there is no such file yet.
    pub(super) fn open(path: &Path) -> Result<(Self, Option<NonVolatile>), EepromError> {
        let named = |error| EepromError::File { path: path.to_owned(), error: Box::new(error) };
        let (file, text) = KeptFile::open(path).map_err(|error| named(error.into()))?;
        let saved = text.map(|text| text.parse::<NonVolatile>().map_err(named)).transpose()?;
        let kept = saved.clone();
        Ok((EepromFile { file, path: path.to_owned(), saved, trouble: None }, kept))
    }

    /// Writes what is to be kept, unless the file holds it already.
    pub(super) fn save(&mut self, kept: NonVolatile) {
        if self.saved.as_ref() == Some(&kept) {
            return;
        }
        let written = self.file.save(kept.to_string());
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

impl From<KeptError> for EepromError {
    fn from(error: KeptError) -> Self {
        match error {
            KeptError::Empty => EepromError::Empty,
            KeptError::Foreign(_) => EepromError::Foreign,
            KeptError::Version(_) => EepromError::Version,
            KeptError::Torn => EepromError::Torn,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const HEAD: &str = "lexican siko/ag03-1 eeprom 1";

    fn kept() -> NonVolatile {
        NonVolatile { eeprom: BTreeMap::from([(Address::new(0x2410, 0x0A), 101)]), position: -5000 }
    }

    #[test]
    fn what_is_kept_reads_back_as_written() {
        let text = kept().to_string();
        assert!(text.starts_with("lexican siko/ag03-1 eeprom 1\nposition -5000\n2410:0A 0x65\nend 1 entries, crc32 "));
        assert_eq!(text.parse::<NonVolatile>().unwrap(), kept());
        assert_eq!(text.replace('\n', "\r\n").parse::<NonVolatile>().unwrap(), kept());
        assert_eq!(NonVolatile::default().to_string().parse::<NonVolatile>().unwrap(), NonVolatile::default());
    }

    #[track_caller]
    fn check(text: &str, expected: &str) {
        let found = text.parse::<NonVolatile>().expect_err(text).to_string();
        assert!(found.starts_with(expected), "{found}\nof {text:?}");
    }

    #[test]
    fn what_something_else_has_written_is_refused() {
        check("", "empty, as after a power failure; remove it");
        check("position -5000\n2410:01 0x64\n", "not the EEPROM");
        check("%PDF-1.4\n", "not the EEPROM");
        check(&kept().to_string().replace("eeprom 1", "eeprom 2"), "the EEPROM of a simulated AG03/1, but of another");
    }

    #[test]
    fn what_is_cut_off_anywhere_is_refused() {
        let text = kept().to_string();
        for end in HEAD.len()..text.len() {
            check(&text[..end], "cut off or changed");
        }
    }

    #[test]
    fn what_is_changed_anywhere_is_refused() {
        let text = kept().to_string();
        for at in 0..text.len() - 1 {
            let mut bytes = text.clone().into_bytes();
            bytes[at] = if bytes[at] == b'0' { b'1' } else { b'0' };
            assert!(String::from_utf8(bytes).unwrap().parse::<NonVolatile>().is_err(), "byte {at}");
        }
    }

    #[test]
    fn a_line_that_is_none_is_named() {
        for line in ["position x", "2410 0x1", "2410:01 1", "5555:00 0x1", ""] {
            check(&FORMAT.seal(&[line.to_owned()]), "line 2 is neither");
        }
    }

    proptest! {
        #[test]
        fn no_text_makes_it_panic(lines in prop::collection::vec("(position |[0-9A-F]{4}:|end |0x)?.{0,12}", 0..5)) {
            let text = format!("{HEAD}\n{}", lines.join("\n"));
            prop_assert!(text.parse::<NonVolatile>().is_err(), "without its checksum, it is torn");
        }
    }
}
