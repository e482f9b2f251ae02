//! What the drive keeps without power, as a text and as a file.

use std::collections::BTreeMap;
use std::fmt::{self, Write as _};
use std::io;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::Arc;

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

const HEAD: &str = "lexican siko/ag03-1 eeprom ";
const VERSION: u32 = 1;

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
        let mut body = format!("{HEAD}{VERSION}\nposition {}\n", self.position);
        for (address, raw) in &self.eeprom {
            writeln!(body, "{address} {raw:#x}")?;
        }
        writeln!(f, "{body}end {} entries, crc32 {:08X}", self.eeprom.len(), crc32(body.as_bytes()))
    }
}

impl FromStr for NonVolatile {
    type Err = EepromError;

    fn from_str(text: &str) -> Result<Self, EepromError> {
        // Windows' line ends are not what makes a file foreign.
        let text = text.replace("\r\n", "\n");
        let version = text.lines().next().and_then(|first| first.strip_prefix(HEAD)).ok_or(EepromError::Foreign)?;
        if version != VERSION.to_string() {
            return Err(EepromError::Version);
        }
        let (body, end) = text.trim_end().rsplit_once('\n').ok_or(EepromError::Torn)?;
        let body = format!("{body}\n");
        let mut kept = NonVolatile::default();
        for (line, words) in (1..).zip(body.lines()).skip(1) {
            kept.take(words).ok_or(if end.starts_with("end ") {
                EepromError::Line { line }
            } else {
                EepromError::Torn
            })?;
        }
        let whole = format!("end {} entries, crc32 {:08X}", kept.eeprom.len(), crc32(body.as_bytes()));
        if end == whole { Ok(kept) } else { Err(EepromError::Torn) }
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
    /// Something else has written it.
    #[error("not the EEPROM of a simulated AG03/1: the first line is not `{HEAD}{VERSION}`; name another file")]
    Foreign,
    /// Another version of this program has written it.
    #[error(
        "the EEPROM of a simulated AG03/1, but of another version than {VERSION}; name another file, or remove this one"
    )]
    Version,
    /// Its end is missing, or its checksum is that of another text.
    #[error(
        "cut off or changed: the last line and its checksum do not fit the rest; remove it to begin with a new drive"
    )]
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
    path: PathBuf,
    /// What it holds; `None` when that is not known.
    saved: Option<NonVolatile>,
    /// Why it could not be written the last time.
    trouble: Option<EepromError>,
}

impl EepromFile {
    /// The file, and what it holds; `None` when there is no such file yet.
    pub(super) fn open(path: &Path) -> Result<(Self, Option<NonVolatile>), EepromError> {
        let named = |error| EepromError::File { path: path.to_owned(), error: Box::new(error) };
        let saved = match std::fs::read(path) {
            Ok(bytes) => {
                let text = String::from_utf8(bytes).map_err(|_| named(EepromError::Foreign))?;
                Some(text.parse::<NonVolatile>().map_err(named)?)
            }
            Err(error) if error.kind() == io::ErrorKind::NotFound => None,
            Err(error) => return Err(named(error.into())),
        };
        let kept = saved.clone();
        Ok((EepromFile { path: path.to_owned(), saved, trouble: None }, kept))
    }

    /// Writes what is to be kept, unless the file holds it already. The old file stays whole until the new one is.
    pub(super) fn save(&mut self, kept: NonVolatile) {
        if self.saved.as_ref() == Some(&kept) {
            return;
        }
        let mut new = self.path.clone().into_os_string();
        new.push(".new");
        let written = std::fs::write(&new, kept.to_string()).and_then(|()| std::fs::rename(&new, &self.path));
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

/// CRC-32 as in IEEE 802.3.
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(u32::MAX, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| if crc & 1 == 0 { crc >> 1 } else { crc >> 1 ^ 0xEDB8_8320 })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn kept() -> NonVolatile {
        NonVolatile { eeprom: BTreeMap::from([(Address::new(0x2410, 0x0A), 101)]), position: -5000 }
    }

    #[test]
    fn the_checksum_is_the_common_one() {
        assert_eq!(crc32(b"123456789"), 0xCBF4_3926);
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
        check("", "not the EEPROM");
        check("position -5000\n2410:01 0x64\n", "not the EEPROM");
        check("%PDF-1.4\n", "not the EEPROM");
        check(&kept().to_string().replace("eeprom 1", "eeprom 2"), "the EEPROM of a simulated AG03/1, but of another");
    }

    #[test]
    fn what_is_cut_off_anywhere_is_refused() {
        let text = kept().to_string();
        for end in HEAD.len() + 1..text.len() - 1 {
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
            check(&kept().to_string().replace("position -5000", line), "line 2 is neither");
        }
    }

    proptest! {
        #[test]
        fn no_text_makes_it_panic(lines in prop::collection::vec("(position |[0-9A-F]{4}:|end |0x)?.{0,12}", 0..5)) {
            let text = format!("{HEAD}{VERSION}\n{}", lines.join("\n"));
            prop_assert!(text.parse::<NonVolatile>().is_err(), "without its checksum, it is torn");
        }
    }
}
