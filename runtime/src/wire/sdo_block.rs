//! The data frames of an SDO block transfer (CiA 301, 7.2.4.3.10 and 7.2.4.3.14).
//!
//! They have no command specifier, so only a side that expects them can recognise them. They never have the sequence
//! number 0, so that an abort (80h) remains recognisable.

use super::sdo::Raw;

/// Seven bytes of a block. The number of valid bytes in the last segment comes later, in [`super::sdo::BlockEnd`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct BlockSegment {
    // As the frame has it: the sequence number and `LAST`, and seven bytes.
    bytes: [u8; 8],
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
        let command = sequence | if last { LAST } else { 0 };
        let raw = u64::from_le_bytes(buffer) << 8 | command as u64;
        Some(BlockSegment { bytes: raw.to_le_bytes() })
    }

    /// The data.
    #[inline]
    #[must_use]
    pub const fn data(&self) -> &[u8; 7] {
        let [_, data @ ..] = &self.bytes;
        data
    }

    /// The position in its block, 1 to 127.
    #[inline]
    #[must_use]
    pub const fn sequence(&self) -> u8 {
        self.bytes[0] & !LAST
    }

    /// Whether no segment follows in the whole transfer.
    #[inline]
    #[must_use]
    pub const fn is_last(&self) -> bool {
        self.bytes[0] & LAST != 0
    }

    /// `None` if there are not eight bytes, or the sequence number is 0.
    #[inline]
    #[must_use]
    pub fn parse(bytes: &[u8]) -> Option<Self> {
        BlockSegment::from_raw(Raw::parse(bytes)?)
    }

    #[inline]
    pub(crate) fn from_raw(raw: Raw) -> Option<Self> {
        Some(BlockSegment { bytes: raw.to_bytes() }).filter(|segment| segment.sequence() > 0)
    }

    /// The eight bytes of the frame.
    #[inline]
    #[must_use]
    pub const fn to_bytes(&self) -> [u8; 8] {
        self.bytes
    }

    #[inline]
    pub(crate) fn to_raw(self) -> Raw {
        Raw(u64::from_le_bytes(self.bytes))
    }
}

const LAST: u8 = 0x80;
