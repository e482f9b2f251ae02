//! Block uploads (CiA 301, 7.2.4.3.13 to 7.2.4.3.15).

use super::transfer::{Piece, Transfer};
use crate::abort::AbortCode;
use crate::object::ObjectDictionary;
use crate::service::sdo_block::{Confirmed, Sender};
use crate::wire::sdo::{BlockEnd, Confirmation};
use crate::wire::sdo_block::BlockSegment;

/// A block upload under way.
#[derive(Clone, Copy, Debug)]
pub(super) struct BlockUpload {
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

impl BlockUpload {
    /// Sends blocks of `block_size` segments, as the client asks.
    pub(super) fn new(block_size: u8, crc: bool) -> Result<Self, AbortCode> {
        Ok(BlockUpload { sender: Sender::new(block_size, crc)?, phase: Phase::Starting })
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

    /// Whether it is time for a segment.
    pub(super) fn is_due(&self) -> bool {
        self.phase == Phase::Sending && self.sender.is_sending()
    }

    /// The next segment of the entry.
    pub(super) fn segment(
        &mut self,
        transfer: &Transfer,
        od: &mut (impl ObjectDictionary + ?Sized),
    ) -> Result<BlockSegment, AbortCode> {
        let offset = self.sender.offset().ok_or(AbortCode::GENERAL)?;
        let Piece { bytes, len, last } = transfer.read(offset, od)?;
        self.sender.push(bytes, len, last).ok_or(AbortCode::GENERAL)
    }
}
