//! Texts with names, and places in them.

mod encoding;
mod markup;

use std::fmt;

pub use encoding::Encoding;
pub use markup::escaped;

/// The largest file that is read, in bytes.
pub const MAX_BYTES: usize = 64 * 1024 * 1024;
/// Files with more lines are not read.
pub const MAX_LINES: usize = 1_000_000;

/// A data sheet with its overlays. Rendering findings needs it as well, to show the lines.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Input {
    /// The data sheet, of any format that [`load`](crate::load) reads.
    pub eds: Source,
    /// The overlays, applied in order.
    pub overlays: Vec<Source>,
}

impl Input {
    /// A data sheet without overlay.
    #[must_use]
    pub fn new(eds: Source) -> Self {
        Self { eds, overlays: Vec::new() }
    }

    /// Adds an overlay.
    #[must_use]
    pub fn overlay(mut self, overlay: Source) -> Self {
        self.overlays.push(overlay);
        self
    }

    /// The text with this number in spans: 0 is the data sheet, n the n-th overlay.
    #[must_use]
    pub fn source(&self, number: u16) -> Option<&Source> {
        match number {
            0 => Some(&self.eds),
            n => self.overlays.get(usize::from(n) - 1),
        }
    }
}

/// A text with a name: a data sheet or an overlay.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Source {
    name: String,
    text: String,
    /// The byte offset of each line; never empty.
    lines: Vec<u32>,
    encoding: Encoding,
    refusal: Option<Refusal>,
}

/// Why a file is not read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// Longer than [`MAX_BYTES`].
    TooLong {
        /// The size of the file, or of its decoded text.
        bytes: usize,
    },
    /// More than [`MAX_LINES`].
    TooManyLines {
        /// The number of lines in the file.
        lines: usize,
    },
}

impl Source {
    /// A text; `name` is what findings show, usually a path.
    pub fn new(name: impl Into<String>, text: impl Into<String>) -> Self {
        Self::with_encoding(name.into(), text.into(), Encoding::Utf8)
    }

    /// Decodes a file: UTF-8 or UTF-16, with or without byte order mark, or else code page 1252, 850 or 437.
    ///
    /// Never fails: a file beyond the limits becomes an empty text with a [`refusal`](Self::refusal), which
    /// [`load`](crate::load) reports.
    pub fn from_bytes(name: impl Into<String>, bytes: &[u8]) -> Self {
        let name = name.into();
        if bytes.len() > MAX_BYTES {
            return Self::refused(name, Refusal::TooLong { bytes: bytes.len() });
        }
        let (text, encoding) = encoding::decode(bytes);
        Self::with_encoding(name, text, encoding)
    }

    /// The name that diagnostics show.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The text, without byte order mark.
    #[must_use]
    pub fn text(&self) -> &str {
        &self.text
    }

    #[must_use]
    /// The encoding that the bytes were in.
    pub fn encoding(&self) -> Encoding {
        self.encoding
    }

    /// Why the file was not read; `None` if it was.
    #[must_use]
    pub fn refusal(&self) -> Option<Refusal> {
        self.refusal
    }

    /// The number of lines; at least one.
    #[must_use]
    pub fn line_count(&self) -> usize {
        self.lines.len()
    }

    /// The line and column of a byte offset, both from 1; the column counts characters.
    #[must_use]
    pub fn position(&self, offset: u32) -> Position {
        let line = self.line_at(offset);
        let start = self.lines[line] as usize;
        let before = self.text.get(start..(offset as usize).min(self.text.len())).unwrap_or_default();
        Position { line: line as u32 + 1, column: before.chars().count() as u32 + 1 }
    }

    /// The line (from 0) that a byte offset is in.
    #[must_use]
    pub fn line_at(&self, offset: u32) -> usize {
        self.lines.partition_point(|&start| start <= offset).max(1) - 1
    }

    /// The text at a place; empty if the place is outside.
    #[must_use]
    pub fn get(&self, span: Span) -> &str {
        self.text.get(span.start as usize..span.end as usize).unwrap_or_default()
    }

    /// Another text with the same name and encoding.
    #[must_use]
    pub fn with_text(&self, text: impl Into<String>) -> Self {
        Self::with_encoding(self.name.clone(), text.into(), self.encoding)
    }

    /// The encoded text; `None` if the encoding lacks one of the characters.
    #[must_use]
    pub fn to_bytes(&self) -> Option<Vec<u8>> {
        self.encoding.encode(&self.text)
    }

    /// The line ending of most lines.
    pub(crate) fn end_of_line(&self) -> &'static str {
        if self.text.matches("\r\n").count() * 2 > self.text.matches('\n').count() { "\r\n" } else { "\n" }
    }

    /// The byte range of a line (from 0) without its ending; empty beyond the last line.
    #[must_use]
    pub fn line_range(&self, line: usize) -> (u32, u32) {
        let [start, next] = [self.line_start(line), self.line_start(line + 1)];
        let ends = self.text.as_bytes()[start as usize..next as usize].iter().rev();
        (start, next - ends.take_while(|byte| matches!(byte, b'\r' | b'\n')).count() as u32)
    }

    /// The byte offset of a line (from 0), or of the end of the text beyond the last line.
    pub(crate) fn line_start(&self, line: usize) -> u32 {
        self.lines.get(line).map_or(self.text.len() as u32, |&start| start)
    }

    /// The text of a line (from 0) without its ending.
    #[must_use]
    pub fn line(&self, line: usize) -> &str {
        let (start, end) = self.line_range(line);
        &self.text[start as usize..end as usize]
    }

    fn with_encoding(name: String, text: String, encoding: Encoding) -> Self {
        // Decoding code page 1252 can enlarge a text, so limit the decoded text as well.
        if text.len() > 2 * MAX_BYTES {
            return Self::refused(name, Refusal::TooLong { bytes: text.len() });
        }
        let lines = line_starts(&text);
        if lines.len() > MAX_LINES {
            return Self::refused(name, Refusal::TooManyLines { lines: lines.len() });
        }
        Self { name, text, lines, encoding, refusal: None }
    }

    fn refused(name: String, refusal: Refusal) -> Self {
        Self { name, text: String::new(), lines: vec![0], encoding: Encoding::Utf8, refusal: Some(refusal) }
    }
}

/// A line and a column, both from 1; the column counts characters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Position {
    /// From 1.
    pub line: u32,
    /// From 1, in characters.
    pub column: u32,
}

impl fmt::Display for Position {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.line, self.column)
    }
}

/// A place: a byte range in one text of an [`Input`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Span {
    /// Which text: 0 is the data sheet, n the n-th overlay.
    pub source: u16,
    /// The offset of the first byte.
    pub start: u32,
    /// The end, exclusive.
    pub end: u32,
}

impl Span {
    /// A range of bytes in the data sheet.
    #[must_use]
    pub const fn eds(start: u32, end: u32) -> Self {
        Self { source: 0, start, end }
    }
}

/// The byte offset of each line. A line ends with LF, CR LF or, in very old files, CR.
fn line_starts(text: &str) -> Vec<u32> {
    let bytes = text.as_bytes();
    let mut lines = vec![0];
    for (i, &byte) in bytes.iter().enumerate() {
        // Shortcut: most bytes are greater than both.
        if byte <= b'\r' && (byte == b'\n' || (byte == b'\r' && bytes.get(i + 1) != Some(&b'\n'))) {
            lines.push(i as u32 + 1);
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_count_lines_of_every_kind_and_characters() {
        let source = Source::new("x", "a\nü=b\r\nc\rd");
        let at = |what: &str| source.position(source.text().find(what).unwrap() as u32).to_string();
        assert_eq!([at("a"), at("="), at("c"), at("d")], ["1:1", "2:2", "3:1", "4:1"]);
        assert_eq!([source.line(1), source.line(2), source.line(9)], ["ü=b", "c", ""]);
        assert_eq!(source.position(999).to_string(), "4:2");
    }

    #[test]
    fn a_file_beyond_the_bounds_is_refused() {
        let lines = "\n".repeat(MAX_LINES);
        let source = Source::from_bytes("x", lines.as_bytes());
        assert_eq!(source.refusal(), Some(Refusal::TooManyLines { lines: MAX_LINES + 1 }));
        let source = Source::from_bytes("x", &vec![b'a'; MAX_BYTES + 1]);
        assert_eq!(source.refusal(), Some(Refusal::TooLong { bytes: MAX_BYTES + 1 }));
    }
}
