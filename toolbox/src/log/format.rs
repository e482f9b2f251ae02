//! The formats and their names.

use std::fmt;
use std::path::Path;
use std::str::FromStr;

/// A format of logs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Format {
    /// `candump -L`. What `candump` prints without options is read as well.
    Candump,
    /// pcap with SocketCAN frames (LINKTYPE_CAN_SOCKETCAN, 227).
    Pcap,
    /// pcapng with SocketCAN frames.
    Pcapng,
    /// Vector ASC.
    Asc,
    /// PEAK TRC; the version is for writing, a reader takes the file's.
    Trc(TrcVersion),
    /// Vector BLF.
    Blf,
}

/// A version of PEAK's TRC.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum TrcVersion {
    /// 1.0: times in milliseconds, no date, direction or channel.
    V1_0,
    /// 1.1: times in tenths of a millisecond, no channel.
    V1_1,
    /// 1.3
    V1_3,
    /// 2.0: no channel.
    V2_0,
    /// 2.1
    #[default]
    V2_1,
}

/// Name, format, and extensions of files.
const NAMES: [(&str, Format, &[&str]); 10] = [
    ("candump", Format::Candump, &["log", "candump", "txt"]),
    ("pcap", Format::Pcap, &["pcap", "cap"]),
    ("pcapng", Format::Pcapng, &["pcapng"]),
    ("asc", Format::Asc, &["asc"]),
    ("trc", Format::Trc(TrcVersion::V2_1), &["trc"]),
    ("trc1.0", Format::Trc(TrcVersion::V1_0), &[]),
    ("trc1.1", Format::Trc(TrcVersion::V1_1), &[]),
    ("trc1.3", Format::Trc(TrcVersion::V1_3), &[]),
    ("trc2.0", Format::Trc(TrcVersion::V2_0), &[]),
    ("blf", Format::Blf, &["blf"]),
];

impl Format {
    /// All formats, in the order of their names' table.
    pub fn all() -> impl Iterator<Item = Format> {
        NAMES.iter().map(|(_, format, _)| *format)
    }

    /// The format of files with this extension.
    #[must_use]
    pub fn of_path(path: &Path) -> Option<Format> {
        let extension = path.extension()?.to_str()?.to_ascii_lowercase();
        NAMES.iter().find(|(_, _, extensions)| extensions.contains(&&*extension)).map(|(_, format, _)| *format)
    }

    /// The format of a log that begins with these bytes; `None` if they are too few, or of no log.
    pub(super) fn of_bytes(bytes: &[u8]) -> Option<Format> {
        let magic: &[u8; 4] = bytes.first_chunk()?;
        match magic {
            [0xD4, 0xC3, 0xB2, 0xA1]
            | [0xA1, 0xB2, 0xC3, 0xD4]
            | [0x4D, 0x3C, 0xB2, 0xA1]
            | [0xA1, 0xB2, 0x3C, 0x4D] => Some(Format::Pcap),
            [0x0A, 0x0D, 0x0D, 0x0A] => Some(Format::Pcapng),
            b"LOGG" => Some(Format::Blf),
            _ => Format::of_text(bytes),
        }
    }

    /// By the first line with anything in it.
    fn of_text(bytes: &[u8]) -> Option<Format> {
        let text = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes).trim_ascii_start();
        let end = text.iter().position(|byte| *byte == b'\n')?;
        let line = String::from_utf8_lossy(&text[..end]).to_ascii_lowercase();
        let mut words = line.split_ascii_whitespace();
        let (first, second) = (words.next()?, words.next().unwrap_or_default());
        let numbered = first.strip_suffix(')').is_some_and(|number| number.bytes().all(|byte| byte.is_ascii_digit()));
        if first.starts_with(';') || numbered {
            Some(Format::Trc(TrcVersion::default()))
        } else if first.starts_with('(') || line.contains('[') && !second.is_empty() {
            Some(Format::Candump)
        } else if first.starts_with("//") || ["date", "base"].contains(&first) {
            Some(Format::Asc)
        } else {
            None
        }
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = NAMES.iter().find(|(_, format, _)| format == self).map_or("trc", |(name, ..)| name);
        f.write_str(name)
    }
}

impl FromStr for Format {
    type Err = UnknownFormat;

    fn from_str(text: &str) -> Result<Self, UnknownFormat> {
        // PEAK's newest version has two names.
        let text = if text == "trc2.1" { "trc" } else { text };
        let found = NAMES.iter().find(|(name, ..)| *name == text);
        found.map(|(_, format, _)| *format).ok_or_else(|| UnknownFormat { name: text.to_owned() })
    }
}

/// There is no format of this name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("there is no format `{name}`; there are {}", NAMES.map(|(name, ..)| name).join(", "))]
pub struct UnknownFormat {
    /// The name.
    pub name: String,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_are_found_by_name_extension_and_first_bytes() {
        for format in Format::all() {
            assert_eq!(format.to_string().parse(), Ok(format));
        }
        assert_eq!("trc2.1".parse(), Ok(Format::Trc(TrcVersion::V2_1)));
        assert!(
            "mdf"
                .parse::<Format>()
                .unwrap_err()
                .to_string()
                .ends_with("candump, pcap, pcapng, asc, trc, trc1.0, trc1.1, trc1.3, trc2.0, blf")
        );
        let of_path = |path: &str| Format::of_path(Path::new(path));
        assert_eq!((of_path("a/b.LOG"), of_path("b"), of_path("b.mf4")), (Some(Format::Candump), None, None));
        for (text, format) in [
            ("(1.000000) can0 080#\n", Some(Format::Candump)),
            ("\n  can0  080   [0] \n", Some(Format::Candump)),
            ("date Sat Sep 30 15:06:13.191 2017\n", Some(Format::Asc)),
            ("\u{FEFF}// Vector\n", Some(Format::Asc)),
            (";$FILEVERSION=1.1\r\n", Some(Format::Trc(TrcVersion::V2_1))),
            ("     1)      1841  0001  8  00\n", Some(Format::Trc(TrcVersion::V2_1))),
            ("LOGG\0", Some(Format::Blf)),
            ("date Sat Sep", None),
            ("nonsense\n", None),
            ("", None),
        ] {
            assert_eq!(Format::of_bytes(text.as_bytes()), format, "{text:?}");
        }
    }
}
