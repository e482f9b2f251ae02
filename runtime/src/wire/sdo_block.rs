//! The data frames of an SDO block transfer (CiA 301, 7.2.4.3.10 and 7.2.4.3.14).
//!
//! They have no command specifier: only a side that expects them can tell them from commands. The
//! sequence number 0 is free in them, so that an abort (80h) stays recognisable.

/// Seven bytes of a block. How many of the last segment's bytes count is told later, by
/// [`super::sdo::BlockEnd`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BlockSegment {
    /// The place in its block, 1 to 127.
    sequence: u8,
    /// Whether no segment follows in the whole transfer.
    pub last: bool,
    /// The data.
    pub data: [u8; 7],
}

impl BlockSegment {
    /// The most segments that a block can have.
    pub const MAX_SEQUENCE: u8 = 127;

    /// `None` unless `sequence` is 1 to 127.
    #[inline]
    #[must_use]
    pub const fn new(sequence: u8, data: [u8; 7], last: bool) -> Option<Self> {
        if sequence == 0 || sequence > Self::MAX_SEQUENCE { None } else { Some(BlockSegment { sequence, last, data }) }
    }

    /// The place in its block, 1 to 127.
    #[inline]
    #[must_use]
    pub const fn sequence(&self) -> u8 {
        self.sequence
    }

    /// `None` when these are not eight bytes, or when the sequence number is 0.
    #[inline]
    #[must_use]
    pub fn parse(bytes: &[u8]) -> Option<Self> {
        let &[command, ref data @ ..] = <&[u8; 8]>::try_from(bytes).ok()?;
        BlockSegment::new(command & 0x7F, *data, command & LAST != 0)
    }

    /// The eight bytes of the frame.
    #[inline]
    #[must_use]
    pub fn to_bytes(&self) -> [u8; 8] {
        let [a, b, c, d, e, f, g] = self.data;
        [self.sequence | if self.last { LAST } else { 0 }, a, b, c, d, e, f, g]
    }
}

const LAST: u8 = 0x80;
