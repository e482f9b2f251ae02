//! Logs of frames, in every common format, read and written frame by frame.
//!
//! [`Reader`] recognises a format by its first bytes, and needs no more memory for longer logs. [`Writer`] writes whole
//! frames, so that a log that is cut off loses only its end. The crate's README lists what each format keeps. Times
//! have a resolution of 1 µs: the shortest frame takes 47 µs at 1 Mbit/s.

mod calendar;
mod channel;
mod codec;
mod files;
mod format;
mod input;
pub(crate) mod number;
mod reader;
mod selection;
mod socketcan;
mod writer;

use std::sync::Arc;

use lexican_runtime::{Frame, Instant};

pub use calendar::{InvalidTime, parse_time};
pub use codec::{Skipped, WriteError};
pub use files::{Files, Limits};
pub use format::{Facts, Format, TrcVersion, UnknownFormat};
pub use input::Flaw;
pub use reader::{LogError, Reader};
pub use selection::Selection;
pub use writer::Writer;

/// The interface of frames in logs that name none.
pub const INTERFACE: &str = "can0";

/// A frame of a log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Record {
    /// When it was on the bus: since 1970 (UTC) if the log has a date, else since the beginning of the log.
    pub at: Instant,
    /// The interface; [`INTERFACE`] if the log names none. In formats with channel numbers, channel 1 is `can0`.
    pub interface: Arc<str>,
    /// [`Direction::Received`] in formats that do not say.
    pub direction: Direction,
    /// The frame.
    pub frame: Frame,
}

/// Who sent a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Direction {
    /// Another node.
    #[default]
    Received,
    /// The machine that recorded it.
    Sent,
}

impl Direction {
    /// `Rx` or `Tx`, as Vector and PEAK write it.
    pub(crate) const fn word(self) -> &'static str {
        match self {
            Direction::Received => "Rx",
            Direction::Sent => "Tx",
        }
    }

    pub(crate) fn of_word(word: &str) -> Option<Self> {
        [Direction::Received, Direction::Sent].into_iter().find(|direction| direction.word().eq_ignore_ascii_case(word))
    }
}
