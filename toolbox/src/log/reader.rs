//! Reads logs of any format.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use lexican_runtime::{Frame, Instant};

use super::codec::{Decode, Skipped};
use super::input::{Fault, Flaw, Input};
use super::{Format, Record};

/// Reads a log: an iterator over its frames, which ends after an error.
pub struct Reader {
    name: String,
    format: Format,
    input: Input,
    decode: Box<dyn Decode>,
    skipped: Skipped,
    is_over: bool,
}

impl Reader {
    /// Opens a file. Without `format`, it is recognised by the first bytes.
    pub fn open(path: &Path, format: Option<Format>) -> Result<Self, LogError> {
        let name = path.display().to_string();
        match File::open(path) {
            Ok(file) => Reader::new(name, file, format),
            Err(error) => Err(LogError::Io { name, error }),
        }
    }

    /// Reads a log from any source; `name` is for errors.
    pub fn new(
        name: impl Into<String>,
        mut input: impl Read + Send + 'static,
        format: Option<Format>,
    ) -> Result<Self, LogError> {
        let name = name.into();
        let head = match head(&mut input, format) {
            Ok(head) => head,
            Err(error) => return Err(LogError::Io { name, error }),
        };
        let Some(format) = format.or_else(|| Format::of_bytes(&head)) else {
            // An empty file may be a log without frames.
            return if head.trim_ascii().is_empty() {
                Ok(Reader::of(name, Format::Candump, Input::new(head, Box::new(input))))
            } else {
                Err(LogError::Unknown { name })
            };
        };
        Ok(Reader::of(name, format, Input::new(head, Box::new(input))))
    }

    fn of(name: String, format: Format, input: Input) -> Self {
        Reader { name, format, input, decode: format.decoder(), skipped: Skipped::default(), is_over: false }
    }

    /// The format.
    #[must_use]
    pub const fn format(&self) -> Format {
        self.format
    }

    /// The line (from 1) of the last frame; `None` in formats without lines.
    #[must_use]
    pub fn line(&self) -> Option<u64> {
        self.decode.is_text().then_some(self.input.lines)
    }

    /// What has been left out so far.
    #[must_use]
    pub const fn skipped(&self) -> Skipped {
        self.skipped
    }

    /// The number of bytes read so far.
    #[must_use]
    pub const fn position(&self) -> u64 {
        self.input.offset
    }

    /// The frames with their times for [`Replay::of`](lexican_runtime::host::Replay::of): of one interface, or of all.
    pub fn into_frames(
        self,
        interface: Option<String>,
    ) -> impl Iterator<Item = io::Result<(Instant, Frame)>> + Send + 'static {
        let is_wanted = move |record: &Record| interface.as_deref().is_none_or(|wanted| *record.interface == *wanted);
        let records = self.filter(move |record| record.as_ref().is_ok_and(&is_wanted) || record.is_err());
        records.map(|record| record.map(|record| (record.at, record.frame)).map_err(io::Error::other))
    }
}

/// Reads as many bytes as recognising the format takes; none if it is given.
fn head(input: &mut impl Read, format: Option<Format>) -> io::Result<Vec<u8>> {
    const MOST: usize = 4096;
    let (mut head, mut chunk) = (Vec::new(), [0; 512]);
    while format.is_none() && Format::of_bytes(&head).is_none() && head.len() < MOST {
        match input.read(&mut chunk) {
            Ok(0) => break,
            Ok(count) => head.extend_from_slice(&chunk[..count]),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(head)
}

impl Iterator for Reader {
    type Item = Result<Record, LogError>;

    fn next(&mut self) -> Option<Result<Record, LogError>> {
        if self.is_over {
            return None;
        }
        let next = self.decode.next(&mut self.input, &mut self.skipped);
        self.is_over = !matches!(next, Ok(Some(_)));
        let name = || self.name.clone();
        let error = match next {
            Ok(record) => return record.map(Ok),
            Err(Fault::Cut) => {
                self.skipped.cut = true;
                return None;
            }
            Err(Fault::Io(error)) => LogError::Io { name: name(), error },
            Err(Fault::Flaw(flaw)) if self.decode.is_text() => {
                LogError::Line { name: name(), line: self.input.lines, flaw }
            }
            Err(Fault::Flaw(flaw)) => LogError::Byte { name: name(), offset: self.input.offset, flaw },
        };
        Some(Err(error))
    }
}

/// Why a log cannot be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the names say what it is")]
pub enum LogError {
    /// The operating system reported an error.
    #[error("{name}: {error}")]
    Io { name: String, error: io::Error },
    /// The bytes have no known format.
    #[error("{name}: this is no log of a known format: {}", Format::kinds())]
    Unknown { name: String },
    #[error("{name}:{line}: {flaw}")]
    Line {
        name: String,
        /// From 1.
        line: u64,
        /// What is wrong.
        flaw: Flaw,
    },
    #[error("{name}: before byte {offset}: {flaw}")]
    Byte {
        name: String,
        /// The number of bytes read until then.
        offset: u64,
        /// What is wrong.
        flaw: Flaw,
    },
}
