//! What a format does: it reads and writes frames, one after another.

use std::io;

use lexican_runtime::Instant;

use super::Record;
use super::input::{Fault, Flaw, Input};

/// A format's way to read. After an error it is not called again.
pub(super) trait Decode: Send {
    /// The next frame; `None` at the end.
    fn next(&mut self, input: &mut Input, skipped: &mut Skipped) -> Result<Option<Record>, Fault>;

    /// Whether errors are in a line, and not at a byte.
    fn is_text(&self) -> bool {
        false
    }
}

/// A format with a line for each frame.
pub(super) trait Lines: Send {
    /// The frame of a line, if there is one in it.
    fn line(&mut self, line: &str, skipped: &mut Skipped) -> Result<Option<Record>, Flaw>;
}

/// The frames of lines as text, and what was skipped.
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

/// A [`Lines`] as a [`Decode`].
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

/// What a log has besides classic CAN frames. It is left out, and counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Skipped {
    /// Frames of CAN FD and CAN XL.
    pub fd: u64,
    /// Error frames.
    pub errors: u64,
    /// Packets, objects and lines of other kinds, and dates that cannot be read.
    pub other: u64,
    /// Whether the log ends in the middle of a frame.
    pub cut: bool,
}

/// A format's way to write: it appends bytes, which are written in one piece.
pub(super) trait Encode: Send {
    /// A frame.
    fn record(&mut self, out: &mut Vec<u8>, record: &Record) -> Result<(), WriteError>;

    /// What was held back.
    fn flush(&mut self, _: &mut Vec<u8>) {}

    /// What comes after the last frame, or what makes a log of no frame at all.
    fn finish(&mut self, _: &mut Vec<u8>) {}

    /// The beginning of a file of so many bytes, if it differs from what was written first.
    fn beginning(&self, _: u64) -> Option<Vec<u8>> {
        None
    }
}

/// Why a frame is not written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WriteError {
    /// The operating system refused.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// The format cannot express the time.
    #[error("the format cannot express {at} s since 1970")]
    Time {
        /// The time.
        at: Instant,
    },
    /// The format cannot have so many interfaces.
    #[error("there are more interfaces than the format can have")]
    Interfaces,
}
