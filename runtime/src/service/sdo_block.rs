//! The two ends of a block transfer (CiA 301, 7.2.4.2.10 and 7.2.4.2.14), the same for downloads and
//! uploads: a [`Sender`] numbers segments, and a [`Receiver`] confirms those that came in sequence.
//!
//! A lost segment shows as a gap, and all after the gap is sent again. When the end of a block is lost there
//! is no gap to see, only silence. Then the receiver confirms what it has got, unasked: see
//! [`Receiver::confirm_after_silence`].

use crate::abort::AbortCode;
use crate::time::Duration;
use crate::wire::crc::Crc;
use crate::wire::sdo::{BlockEnd, Confirmation, Raw};
use crate::wire::sdo_block::BlockSegment;

/// How many blocks in a row may get lost as a whole.
const MAX_FRUITLESS: u8 = 16;

/// How long a receiver waits for a segment before it confirms unasked: it must have the time to do so
/// before the other side gives up.
pub(super) fn silence(timeout: Duration) -> Duration {
    Duration::from_micros(timeout.as_micros() / 2)
}

/// The end that has the data.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sender {
    /// Bytes that the receiver has confirmed.
    confirmed: u32,
    /// Segments of the current block that were sent.
    sent: u8,
    block_size: u8,
    /// Whether the block was sent, and is to be confirmed.
    waits: bool,
    /// The number of bytes, once the last segment was sent.
    end: Option<u32>,
    /// The number of the confirmation before.
    previous: u8,
    fruitless: u8,
    checksum: Checksum,
}

/// A checksum of bytes that may be sent more than once.
#[derive(Clone, Copy, Debug)]
struct Checksum {
    crc: Crc,
    /// The bytes that are in it.
    covered: u32,
    /// Whether both sides can compute it.
    is_used: bool,
}

/// What a confirmation means to the sender.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Confirmed {
    /// Nothing: it is a repetition.
    Repeated,
    /// There is more to send.
    More,
    /// Everything arrived.
    All,
}

impl Sender {
    /// The beginning, in blocks of `block_size` segments.
    pub(super) fn new(block_size: u8, with_crc: bool) -> Result<Self, AbortCode> {
        Ok(Sender {
            confirmed: 0,
            sent: 0,
            block_size: valid(block_size)?,
            waits: false,
            end: None,
            previous: 0,
            fruitless: 0,
            checksum: Checksum { crc: Crc::new(), covered: 0, is_used: with_crc },
        })
    }

    /// How many bytes the receiver has confirmed.
    #[inline]
    pub(super) fn confirmed(&self) -> u32 {
        self.confirmed
    }

    /// Whether a segment is to be sent.
    #[inline]
    pub(super) fn is_sending(&self) -> bool {
        !self.waits
    }

    /// Where the data of the next segment begins; `None` beyond 4 GiB.
    #[inline]
    pub(super) fn offset(&self) -> Option<u32> {
        self.confirmed.checked_add(u32::from(self.sent) * 7)
    }

    /// The next segment: the first `len` of the bytes at [`Sender::offset`], at most seven.
    #[inline]
    pub(super) fn push(&mut self, buffer: [u8; 8], len: usize, last: bool) -> Option<BlockSegment> {
        let offset = self.offset()?;
        let end = offset.checked_add(len as u32)?;
        let segment = BlockSegment::of_buffer(self.sent + 1, buffer, last)?;
        self.checksum.cover(offset, end, segment.data());
        self.sent += 1;
        self.waits = last || self.sent == self.block_size;
        if last {
            self.end = Some(end);
        }
        Some(segment)
    }

    pub(super) fn confirm(&mut self, confirmation: Confirmation) -> Result<Confirmed, AbortCode> {
        let Confirmation { sequence, block_size } = confirmation;
        let repeated = sequence == self.previous && (sequence > self.sent || !self.waits);
        if repeated && !self.waits {
            return Ok(Confirmed::Repeated);
        }
        // A repetition after all of a block was sent: then all of it got lost.
        let arrived = if repeated { 0 } else { sequence };
        if arrived > self.sent {
            return Err(AbortCode::INVALID_SEQUENCE_NUMBER);
        }
        let confirmed = self.confirmed.checked_add(u32::from(arrived) * 7);
        if arrived > 0 && self.end.is_some_and(|end| confirmed.is_none_or(|confirmed| confirmed >= end)) {
            return Ok(Confirmed::All);
        }
        self.fruitless = if arrived == 0 { self.fruitless + 1 } else { 0 };
        if self.fruitless > MAX_FRUITLESS {
            return Err(AbortCode::TIMED_OUT);
        }
        self.block_size = valid(block_size)?;
        self.confirmed = confirmed.ok_or(AbortCode::GENERAL)?;
        self.previous = sequence;
        self.sent = 0;
        self.waits = false;
        Ok(Confirmed::More)
    }

    /// How it ends, after all was confirmed.
    pub(super) fn block_end(&self) -> Option<BlockEnd> {
        // Every segment but the last is full, and there is a last one even without any data.
        let end = self.end?;
        let unused = if end == 0 { 7 } else { (7 - end % 7) % 7 };
        BlockEnd::new(unused as u8, self.checksum.get())
    }
}

impl Checksum {
    #[inline]
    fn cover(&mut self, offset: u32, end: u32, data: &[u8; 7]) {
        if offset < self.covered || !self.is_used {
            return;
        }
        self.covered = end;
        match (end - offset) as usize {
            7 => self.crc.update_segment(data),
            len => self.crc.update(data.get(..len).unwrap_or(data)),
        }
    }

    fn get(&self) -> u16 {
        if self.is_used { self.crc.get() } else { 0 }
    }
}

/// The end that gets the data.
#[derive(Clone, Copy, Debug)]
pub(super) struct Receiver {
    announced: Option<u32>,
    /// Bytes that came in sequence, without the last segment.
    offset: u32,
    /// The number of the next segment.
    next: u8,
    block_size: u8,
    /// The last segment, of which only the end of the transfer says how many bytes count.
    last: Option<BlockSegment>,
    /// Whether any segment came since the last confirmation: so that confirmation was heard.
    is_heard: bool,
    /// What was confirmed last.
    confirmed: u8,
    /// Whether there was silence already since the last segment that came in sequence.
    is_silent: bool,
    fruitless: u8,
    checksum: Checksum,
}

/// What is to be done with a segment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Received {
    /// Whether all its bytes are the next ones of the data.
    pub(super) is_next: bool,
    /// Whether the block is to be confirmed.
    pub(super) ends_block: bool,
}

impl Receiver {
    /// The beginning, in blocks of `block_size` segments.
    pub(super) fn new(block_size: u8, with_crc: bool, announced: Option<u32>) -> Self {
        Receiver {
            announced,
            offset: 0,
            next: 1,
            block_size,
            last: None,
            is_heard: false,
            confirmed: 0,
            is_silent: false,
            fruitless: 0,
            checksum: Checksum { crc: Crc::new(), covered: 0, is_used: with_crc },
        }
    }

    /// Where the data of the next segment belongs.
    #[inline]
    pub(super) fn offset(&self) -> u32 {
        self.offset
    }

    /// The frame as a segment, when one is awaited.
    #[inline]
    pub(super) fn parse(&self, raw: Raw) -> Option<BlockSegment> {
        // When all is there, commands are awaited; but the last segment might be repeated.
        let segment = BlockSegment::from_raw(raw)?;
        if self.last.is_none() || self.last == Some(segment) { Some(segment) } else { None }
    }

    #[inline]
    pub(super) fn take(&mut self, segment: &BlockSegment) -> Result<Received, AbortCode> {
        if self.last.is_some() {
            return Ok(Received { is_next: false, ends_block: false });
        }
        let sequence = segment.sequence();
        if sequence > self.block_size {
            return Err(AbortCode::INVALID_SEQUENCE_NUMBER);
        }
        let is_at_end = segment.is_last() || sequence == self.block_size;
        if sequence != self.next {
            // The segment that was confirmed last may be repeated: that is not the end of the next block.
            let is_repeated = sequence < self.next || (!self.is_heard && sequence == self.confirmed);
            self.is_heard = true;
            let ends_block = is_at_end && !is_repeated;
            self.fruitless = if ends_block && self.next == 1 { self.fruitless + 1 } else { self.fruitless };
            if self.fruitless > MAX_FRUITLESS {
                return Err(AbortCode::INVALID_SEQUENCE_NUMBER);
            }
            return Ok(Received { is_next: false, ends_block });
        }
        self.is_heard = true;
        self.is_silent = false;
        self.fruitless = 0;
        self.next += 1;
        if segment.is_last() {
            self.last = Some(*segment);
            return Ok(Received { is_next: false, ends_block: true });
        }
        let end = self.offset.checked_add(7).filter(|end| self.announced.is_none_or(|announced| *end <= announced));
        let end = end.ok_or(AbortCode::LENGTH_TOO_HIGH)?;
        self.checksum.cover(self.offset, end, segment.data());
        self.offset = end;
        Ok(Received { is_next: true, ends_block: is_at_end })
    }

    /// Confirms what came of this block, and awaits the next one.
    #[inline]
    pub(super) fn confirm(&mut self) -> Confirmation {
        self.confirmed = self.next - 1;
        self.next = 1;
        self.is_heard = false;
        Confirmation { sequence: self.confirmed, block_size: self.block_size }
    }

    /// What to say after silence; `None` when it has lasted for too long.
    ///
    /// When segments came since the last confirmation, the rest of the block got lost. Otherwise that
    /// confirmation got lost, or all of the block that followed. To say it again serves both: a [`Sender`] that
    /// has sent fewer segments since cannot take it for a confirmation of these. Only after a single segment
    /// that is followed by a single one it could, and then it is asked to send that again. A wrong guess lets data
    /// be missing or come twice, so there must be a size or a checksum to notice it.
    pub(super) fn confirm_after_silence(&mut self) -> Option<Confirmation> {
        if core::mem::replace(&mut self.is_silent, true) {
            return None;
        }
        let again = Confirmation { sequence: self.confirmed, block_size: self.block_size };
        if self.last.is_some() || self.confirmed == 0 && !self.is_heard {
            return Some(again);
        }
        let left = self.announced.map(|announced| announced.saturating_sub(self.offset));
        let is_one_segment = self.block_size == 1 || left.is_some_and(|left| left <= 7);
        if self.is_heard || self.confirmed == 1 && is_one_segment && self.is_checked() {
            return Some(self.confirm());
        }
        self.is_checked().then_some(again)
    }

    fn is_checked(&self) -> bool {
        self.checksum.is_used || self.announced.is_some()
    }

    /// The last segment and how many of its bytes count, when everything is there and right.
    pub(super) fn finish(&mut self, block_end: BlockEnd) -> Result<(BlockSegment, usize), AbortCode> {
        let segment = self.last.ok_or(AbortCode::UNKNOWN_COMMAND)?;
        let len = 7 - usize::from(block_end.unused());
        let end = self.offset.checked_add(len as u32).ok_or(AbortCode::LENGTH_TOO_HIGH)?;
        match self.announced {
            Some(announced) if end > announced => return Err(AbortCode::LENGTH_TOO_HIGH),
            Some(announced) if end < announced => return Err(AbortCode::LENGTH_TOO_LOW),
            _ => self.checksum.cover(self.offset, end, segment.data()),
        }
        if self.checksum.is_used && self.checksum.get() != block_end.crc {
            return Err(AbortCode::CRC_ERROR);
        }
        Ok((segment, len))
    }
}

/// The block size that may be, 1 to 127, nearest to this one.
pub(super) const fn nearest_block_size(block_size: u8) -> u8 {
    match block_size {
        0 => 1,
        1..=BlockSegment::MAX_SEQUENCE => block_size,
        _ => BlockSegment::MAX_SEQUENCE,
    }
}

fn valid(block_size: u8) -> Result<u8, AbortCode> {
    if (1..=BlockSegment::MAX_SEQUENCE).contains(&block_size) {
        Ok(block_size)
    } else {
        Err(AbortCode::INVALID_BLOCK_SIZE)
    }
}
