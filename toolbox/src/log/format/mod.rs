//! The log formats: one row each.

mod asc;
mod blf;
mod candump;
mod pcap;
mod pcapng;
mod trc;

use std::fmt;
use std::path::Path;
use std::str::FromStr;

use super::codec::{Decode, Encode, Text};
pub use trc::TrcVersion;

/// A format of logs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Format {
    /// `candump -L`; the default output of `candump` is read as well.
    Candump,
    /// pcap with SocketCAN frames (LINKTYPE_CAN_SOCKETCAN, 227).
    Pcap,
    /// pcapng with SocketCAN frames.
    Pcapng,
    /// Vector ASC.
    Asc,
    /// PEAK TRC; the version is that to write, and is ignored when reading.
    Trc(TrcVersion),
    /// Vector BLF.
    Blf,
}

/// What a reader supports, and what the format keeps of a frame, as texts; `-` for nothing.
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs, reason = "the names say what it is")]
pub struct Facts {
    pub reads: &'static str,
    pub times: &'static str,
    pub interface: &'static str,
    pub direction: &'static str,
}

struct Row {
    name: &'static str,
    format: Format,
    /// Extensions of file names; a row without any is another version, for writing.
    extensions: &'static [&'static str],
    read: fn() -> Box<dyn Decode>,
    write: fn() -> Box<dyn Encode>,
    facts: Facts,
}

macro_rules! formats {
    ($($name:literal, $format:expr, $extensions:expr, $read:expr, $write:expr,
       $reads:literal, $times:expr, $interface:literal, $direction:literal;)*) => {
        &[$(Row {
            name: $name,
            format: $format,
            extensions: &$extensions,
            read: || Box::new($read),
            write: || Box::new($write),
            facts: Facts { reads: $reads, times: $times, interface: $interface, direction: $direction },
        }),*]
    };
}

const FROM_FIRST: &str = "1 us since the first frame, and its date";

// A new format needs a row here, a variant of `Format`, and a file in this folder.
const ROWS: &[Row] = formats! {
    "candump", Format::Candump, ["log", "candump", "txt"], Text(candump::Read::default()), candump::Write,
        "`-L`, and what `candump` prints, with `-ta`, `-tz`, `-tA` or without times", "1 us since 1970", "name, `_` for spaces", "read, not written";
    "pcap", Format::Pcap, ["pcap", "cap"], pcap::Read::default(), pcap::Write::default(),
        "micro- and nanoseconds, both byte orders, link type 227", "1 us since 1970, until 2106", "-", "-";
    "pcapng", Format::Pcapng, ["pcapng"], pcapng::Read::default(), pcapng::Write::default(),
        "any resolution and offset, both byte orders, several interfaces", "1 us since 1970", "name", "kept";
    "asc", Format::Asc, ["asc"], Text(asc::Read::default()), asc::Write::default(),
        "hexadecimal and decimal, absolute and relative, English and German dates", FROM_FIRST, "channel", "kept";
    "trc", Format::Trc(TrcVersion::V2_1), ["trc"], Text(trc::Read::default()), trc::Write::new(TrcVersion::V2_1),
        "1.0 to 1.3, 2.0 and 2.1", FROM_FIRST, "channel", "kept";
    "trc1.0", Format::Trc(TrcVersion::V1_0), [], Text(trc::Read::default()), trc::Write::new(TrcVersion::V1_0),
        "", "1 ms since the first frame, and its date to 100 us", "-", "-";
    "trc1.1", Format::Trc(TrcVersion::V1_1), [], Text(trc::Read::default()), trc::Write::new(TrcVersion::V1_1),
        "", "100 us since the first frame, and its date", "-", "kept";
    "trc1.3", Format::Trc(TrcVersion::V1_3), [], Text(trc::Read::default()), trc::Write::new(TrcVersion::V1_3),
        "", FROM_FIRST, "channel", "kept";
    "trc2.0", Format::Trc(TrcVersion::V2_0), [], Text(trc::Read::default()), trc::Write::new(TrcVersion::V2_0),
        "", FROM_FIRST, "-", "kept";
    "blf", Format::Blf, ["blf"], blf::Read::default(), blf::Write::default(),
        "objects 1 and 86, plain and zlib containers", FROM_FIRST, "channel", "kept";
};

impl Format {
    /// All formats, in the order of the table.
    pub fn all() -> impl Iterator<Item = Format> {
        ROWS.iter().map(|row| row.format)
    }

    /// The names of all formats.
    #[must_use]
    pub fn names() -> String {
        names(|_| true)
    }

    /// The names of the formats that a reader recognises; versions of a format share a name.
    #[must_use]
    pub fn kinds() -> String {
        names(|row| !row.extensions.is_empty())
    }

    /// The format by the file's extension.
    #[must_use]
    pub fn of_path(path: &Path) -> Option<Format> {
        let extension = path.extension()?.to_str()?.to_ascii_lowercase();
        ROWS.iter().find(|row| row.extensions.contains(&&*extension)).map(|row| row.format)
    }

    /// What it supports and keeps.
    #[must_use]
    pub fn facts(self) -> Facts {
        self.row().facts
    }

    pub(super) fn decoder(self) -> Box<dyn Decode> {
        (self.row().read)()
    }

    pub(super) fn encoder(self) -> Box<dyn Encode> {
        (self.row().write)()
    }

    fn row(self) -> &'static Row {
        ROWS.iter().find(|row| row.format == self).expect("every format has a row")
    }

    /// The format of a log with these first bytes; `None` if they are too few or of no format.
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

    /// The format by the first line that is not empty.
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

fn names(are_wanted: impl Fn(&Row) -> bool) -> String {
    let names: Vec<_> = ROWS.iter().filter(|row| are_wanted(row)).map(|row| row.name).collect();
    names.join(", ")
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.row().name)
    }
}

impl FromStr for Format {
    type Err = UnknownFormat;

    fn from_str(text: &str) -> Result<Self, UnknownFormat> {
        // PEAK's newest version has two names.
        let text = if text == "trc2.1" { "trc" } else { text };
        let found = ROWS.iter().find(|row| row.name == text);
        found.map(|row| row.format).ok_or_else(|| UnknownFormat { name: text.to_owned() })
    }
}

/// No format has this name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("there is no format `{name}`; there are {}", Format::names())]
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
        let unknown = "mdf".parse::<Format>().unwrap_err().to_string();
        assert!(unknown.starts_with("there is no format `mdf`; there are candump, pcap, pcapng"), "{unknown}");
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

    #[test]
    fn golden_formats_of_the_page() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/README.md");
        let page = std::fs::read_to_string(path).unwrap();
        let head = "| format | what is read | times | interface | direction |\n| --- | --- | --- | --- | --- |\n";
        let (before, after) = page.split_once(head).expect("the page has the table");
        let after = &after[after.find("\n\n").expect("it ends") + 1..];
        let row = |Row { name, facts: Facts { reads, times, interface, direction }, .. }: &Row| {
            format!("| `{name}` | {reads} | {times} | {interface} | {direction} |\n")
        };
        let made = format!("{before}{head}{}{after}", ROWS.iter().map(row).collect::<String>());
        if std::env::var_os("LEXICAN_BLESS").is_some() {
            return std::fs::write(path, &made).unwrap();
        }
        assert!(made == page, "{path} is out of date: LEXICAN_BLESS=1 cargo test -p lexican-toolbox golden");
    }
}
