//! Block transfers (CiA 301, 7.2.4.3.9 to 7.2.4.3.15).

use super::entry::{Sink, Source, Stage, Value};
use crate::abort::AbortCode;
use crate::object::{Address, ObjectDictionary};
use crate::service::sdo_block::{Confirmed, Receiver, Sender};
use crate::wire::sdo::{BlockEnd, Confirmation, Raw};
use crate::wire::sdo_block::BlockSegment;

/// A block upload under way.
#[derive(Clone, Copy, Debug)]
pub(super) struct BlockUpload {
    source: Source,
    sender: Sender,
    phase: Phase,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// The client has not asked for the first block.
    Starting,
    /// Segments are sent and confirmed.
    Sending,
    /// Everything was confirmed; the client is to confirm the end.
    Ending,
}

/// A block download under way.
#[derive(Clone, Copy, Debug)]
pub(super) struct BlockDownload {
    sink: Sink,
    receiver: Receiver,
}

impl BlockUpload {
    /// Sends blocks of `block_size` segments, as the client asks.
    pub(super) fn new(source: Source, block_size: u8, crc: bool) -> Result<Self, AbortCode> {
        Ok(BlockUpload { source, sender: Sender::new(block_size, crc)?, phase: Phase::Starting })
    }

    pub(super) fn address(&self) -> Address {
        self.source.address()
    }

    /// The client is ready for the first block.
    pub(super) fn start(&mut self) -> Result<(), AbortCode> {
        if self.phase != Phase::Starting {
            return Err(AbortCode::UNKNOWN_COMMAND);
        }
        self.phase = Phase::Sending;
        Ok(())
    }

    /// Takes a confirmation; the answer to that of the last block is the end.
    pub(super) fn confirm(&mut self, confirmation: Confirmation) -> Result<Option<BlockEnd>, AbortCode> {
        match self.phase {
            // The client awaits segments already: its start got lost.
            Phase::Starting if confirmation.sequence == 0 => self.phase = Phase::Sending,
            Phase::Starting => return Err(AbortCode::UNKNOWN_COMMAND),
            Phase::Sending if self.sender.confirm(confirmation)? != Confirmed::All => {}
            // In `Ending`, the client is still waiting for the end: it got lost.
            Phase::Sending | Phase::Ending => {
                self.phase = Phase::Ending;
                return Ok(Some(self.sender.block_end().ok_or(AbortCode::GENERAL)?));
            }
        }
        Ok(None)
    }

    /// Whether the client is to confirm the end.
    pub(super) fn is_ending(&self) -> bool {
        self.phase == Phase::Ending
    }

    /// The next segment, when it is time for one.
    pub(super) fn segment(
        &mut self,
        od: &mut (impl ObjectDictionary + ?Sized),
    ) -> Option<Result<BlockSegment, AbortCode>> {
        let is_due = self.phase == Phase::Sending && self.sender.is_sending();
        is_due.then(|| self.read(od))
    }

    fn read(&mut self, od: &mut (impl ObjectDictionary + ?Sized)) -> Result<BlockSegment, AbortCode> {
        let offset = self.sender.offset().ok_or(AbortCode::GENERAL)?;
        let (Value { len, bytes }, last) = self.source.read(offset, od)?;
        self.sender.push(bytes, len, last).ok_or(AbortCode::GENERAL)
    }
}

impl BlockDownload {
    /// Takes blocks of `block_size` segments; `size` is the number of bytes that the client announces.
    pub(super) fn new(sink: Sink, block_size: u8, crc: bool, size: Option<u32>) -> Self {
        BlockDownload { sink, receiver: Receiver::new(block_size, crc, size) }
    }

    pub(super) fn address(&self) -> Address {
        self.sink.address()
    }

    pub(super) fn parse(&self, raw: Raw) -> Option<BlockSegment> {
        self.receiver.parse(raw)
    }

    pub(super) fn confirm_after_silence(&mut self) -> Option<Confirmation> {
        self.receiver.confirm_after_silence()
    }

    /// Takes a segment, and says whether it is to be confirmed.
    pub(super) fn take(
        &mut self,
        segment: &BlockSegment,
        stage: &mut Stage,
        od: &mut (impl ObjectDictionary + ?Sized),
    ) -> Result<Option<Confirmation>, AbortCode> {
        let received = self.receiver.take(segment)?;
        if received.is_next {
            self.sink.write(segment.data(), false, stage, od)?;
        }
        Ok(received.ends_block.then(|| self.receiver.confirm()))
    }

    /// The client has sent all: takes the last segment, of which only now it is known how many bytes count.
    pub(super) fn finish(
        &mut self,
        block_end: BlockEnd,
        stage: &mut Stage,
        od: &mut (impl ObjectDictionary + ?Sized),
    ) -> Result<(), AbortCode> {
        let (segment, len) = self.receiver.finish(block_end)?;
        self.sink.write(segment.data().get(..len).unwrap_or(segment.data()), true, stage, od)
    }
}
