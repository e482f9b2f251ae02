//! The data frames of an SDO block transfer (CiA 301, 7.2.4.3.10 and 7.2.4.3.14).
//!
//! They have no command specifier, so only a side that expects them can recognise them. They never have the sequence
//! number 0, so that an abort (80h) remains recognisable.

use super::sdo::Raw;

/// Seven bytes of a block. The number of valid bytes in the last segment comes later, in [`super::sdo::BlockEnd`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct BlockSegment {
    /// The position in its block, 1 to 127.
    sequence: u8,
    /// Whether no segment follows in the whole transfer.
    pub last: bool,
    // Seven bytes, and a zero so that all eight can be handled as one number.
    data: [u8; 8],
}

impl BlockSegment {
    /// The largest number of segments in a block.
    pub const MAX_SEQUENCE: u8 = 127;

    /// `None` unless `sequence` is 1 to 127.
    #[inline]
    #[must_use]
    pub const fn new(sequence: u8, data: [u8; 7], last: bool) -> Option<Self> {
        let [a, b, c, d, e, f, g] = data;
        BlockSegment::of_buffer(sequence, [a, b, c, d, e, f, g, 0], last)
    }

    /// The first seven of these bytes.
    #[inline]
    pub(crate) const fn of_buffer(sequence: u8, buffer: [u8; 8], last: bool) -> Option<Self> {
        if sequence == 0 || sequence > Self::MAX_SEQUENCE {
            return None;
        }
        let data = u64::from_le_bytes(buffer) << 8 >> 8;
        Some(BlockSegment { sequence, last, data: data.to_le_bytes() })
    }

    /// The data.
    #[inline]
    #[must_use]
    pub const fn data(&self) -> &[u8; 7] {
        let [data @ .., _] = &self.data;
        data
    }

    /// The position in its block, 1 to 127.
    #[inline]
    #[must_use]
    pub const fn sequence(&self) -> u8 {
        self.sequence
    }

    /// `None` if there are not eight bytes, or the sequence number is 0.
    #[inline]
    #[must_use]
    pub fn parse(bytes: &[u8]) -> Option<Self> {
        BlockSegment::from_raw(Raw::parse(bytes)?)
    }

    #[inline]
    pub(crate) const fn from_raw(Raw(raw): Raw) -> Option<Self> {
        let command = raw as u8;
        BlockSegment::of_buffer(command & 0x7F, (raw >> 8).to_le_bytes(), command & LAST != 0)
    }

    /// The eight bytes of the frame.
    #[inline]
    #[must_use]
    pub fn to_bytes(&self) -> [u8; 8] {
        self.to_raw().to_bytes()
    }

    #[inline]
    pub(crate) fn to_raw(self) -> Raw {
        let command = self.sequence | if self.last { LAST } else { 0 };
        Raw(u64::from_le_bytes(self.data) << 8 | u64::from(command))
    }
}

const LAST: u8 = 0x80;
