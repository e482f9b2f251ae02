//! The traits of formats: how they read and write one frame after another.

use std::io;

use lexican_runtime::Instant;

use super::Record;
use super::input::{Fault, Flaw, Input};

/// Reads a format. Not called again after an error.
pub(super) trait Decode: Send {
    /// The next frame; `None` at the end.
    fn next(&mut self, input: &mut Input, skipped: &mut Skipped) -> Result<Option<Record>, Fault>;

    /// Whether errors are reported by line instead of by byte.
    fn is_text(&self) -> bool {
        false
    }
}

/// Reads a format with one line per frame.
pub(super) trait Lines: Send {
    /// The frame in a line, if it has one.
    fn line(&mut self, line: &str, skipped: &mut Skipped) -> Result<Option<Record>, Flaw>;
}

/// Reads lines into frames as text, and what was skipped.
#[cfg(test)]
pub(super) fn read<L: Lines + Default>(lines: &str) -> (Vec<String>, Skipped) {
    let (mut reader, mut skipped, mut records) = (L::default(), Skipped::default(), Vec::new());
    for line in lines.lines() {
        let record = reader.line(line.trim(), &mut skipped).unwrap();
        records.extend(record.map(|Record { at, interface, direction, frame }| {
            format!("{} {interface} {frame} {}", at.as_micros(), direction.word())
        }));
    }
    (records, skipped)
}

/// Makes a [`Decode`] of a [`Lines`].
pub(super) struct Text<L>(pub(super) L);

impl<L: Lines> Decode for Text<L> {
    fn next(&mut self, input: &mut Input, skipped: &mut Skipped) -> Result<Option<Record>, Fault> {
        while let Some((line, ended)) = input.line()? {
            match self.0.line(line.trim_matches(['\u{FEFF}', '\r', '\n', ' ', '\t']), skipped) {
                Ok(None) => {}
                Err(_) if !ended => return Err(Fault::Cut),
                result => return result.map_err(Fault::Flaw),
            }
        }
        Ok(None)
    }

    fn is_text(&self) -> bool {
        true
    }
}

/// How much of a log was left out because it is not a classic CAN frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Skipped {
    /// Frames of CAN FD and CAN XL.
    pub fd: u64,
    /// Error frames.
    pub errors: u64,
    /// Packets, objects and lines of other kinds, and unreadable dates.
    pub other: u64,
    /// Whether the log ends in the middle of a frame.
    pub cut: bool,
}

/// Writes a format: appends bytes, which are passed on in one piece.
pub(super) trait Encode: Send {
    /// Appends a frame.
    fn record(&mut self, out: &mut Vec<u8>, record: &Record) -> Result<(), WriteError>;

    /// Appends what was held back.
    fn flush(&mut self, _: &mut Vec<u8>) {}

    /// Appends the end of the log. Without any frame it also appends the beginning.
    fn finish(&mut self, _: &mut Vec<u8>) {}

    /// The first bytes for a file of this size, if they differ from those written at first.
    fn beginning(&self, _: u64) -> Option<Vec<u8>> {
        None
    }
}

/// Why a frame is not written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WriteError {
    /// The operating system reported an error.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// The format cannot express this time.
    #[error("the format cannot express {at} s since 1970")]
    Time {
        /// Of the frame.
        at: Instant,
    },
    /// The format cannot hold so many interfaces.
    #[error("there are more interfaces than the format can have")]
    Interfaces,
}
