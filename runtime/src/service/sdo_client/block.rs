//! Block transfers (CiA 301, 7.2.4.3.9 to 7.2.4.3.15), and what becomes of them with servers that know none.

use super::Payload;
use super::progress::{Failure, Progress};
use super::segmented::{self, Download, Upload};
use crate::abort::AbortCode;
use crate::object::Address;
use crate::service::sdo_block::{Confirmed, Receiver, Sender};
use crate::wire::sdo::{ClientRequest, Confirmation, Raw, ServerResponse};
use crate::wire::sdo_block::BlockSegment;

/// Reads of up to this many bytes may be answered without blocks: those would take no fewer frames.
const SWITCH_THRESHOLD: u8 = 21;

/// A block write under way.
#[derive(Clone, Copy, Debug)]
pub(super) struct BlockDownload {
    address: Address,
    len: u32,
    phase: Sending,
}

#[derive(Clone, Copy, Debug)]
enum Sending {
    Initiating,
    Segments(Sender),
    Ending(Sender),
}

/// A block read under way.
#[derive(Clone, Copy, Debug)]
pub(super) struct BlockUpload {
    address: Address,
    block_size: u8,
    /// The server has agreed to transfer the entry in segments before.
    is_instead: bool,
    phase: Receiving,
}

#[derive(Clone, Copy, Debug)]
enum Receiving {
    Initiating,
    Segments {
        receiver: Receiver,
        /// `None` to start, then what is to be confirmed.
        confirmation: Option<Confirmation>,
    },
}

impl BlockDownload {
    pub(super) const fn new(address: Address, len: u32) -> Self {
        BlockDownload { address, len, phase: Sending::Initiating }
    }

    pub(super) fn address(&self) -> Address {
        self.address
    }

    pub(super) fn is_begun(&self) -> bool {
        !matches!(self.phase, Sending::Initiating)
    }

    /// How many bytes the server has confirmed.
    #[inline]
    pub(super) fn offset(&self) -> u32 {
        match &self.phase {
            Sending::Initiating => 0,
            Sending::Segments(sender) | Sending::Ending(sender) => sender.confirmed(),
        }
    }

    /// Whether more segments are to be sent without an answer of the server.
    #[inline]
    pub(super) fn is_sending(&self) -> bool {
        matches!(&self.phase, Sending::Segments(sender) if sender.is_sending())
    }

    /// The same write without blocks.
    pub(super) fn segmented(&self) -> Download {
        Download::new(self.address, self.len)
    }

    /// The same write without blocks, which the server has agreed to.
    pub(super) fn begun_without_blocks(&self) -> Download {
        Download::begun(self.address, self.len)
    }

    #[inline]
    pub(super) fn request(&mut self, payload: &mut dyn Payload) -> Result<Raw, Failure> {
        let request = match &mut self.phase {
            Sending::Initiating => {
                ClientRequest::InitiateBlockDownload { address: self.address, crc: true, size: Some(self.len) }
            }
            Sending::Segments(sender) => {
                let segment = next_segment(self.len, sender, payload)?;
                return Ok(segment.to_raw());
            }
            Sending::Ending(sender) => {
                let block_end = sender.block_end().ok_or(Failure::Violation(AbortCode::GENERAL))?;
                ClientRequest::EndBlockDownload(block_end)
            }
        };
        Ok(request.to_raw())
    }

    pub(super) fn handle(&mut self, raw: Raw) -> Result<Progress, Failure> {
        match (&mut self.phase, ServerResponse::from_raw(raw)) {
            (Sending::Initiating, Some(ServerResponse::InitiateBlockDownload { address, crc, block_size }))
                if address == self.address =>
            {
                self.phase = Sending::Segments(Sender::new(block_size, crc).map_err(Failure::Violation)?);
            }
            // A server that knows no blocks may take it for a segmented download.
            (Sending::Initiating, Some(ServerResponse::InitiateDownload { address })) if address == self.address => {
                return Ok(Progress::Segmented { announced: Some(self.len) });
            }
            // Nothing else is an answer to what was asked.
            (Sending::Initiating, _) => return Ok(Progress::Ignored),
            (Sending::Segments(sender), Some(ServerResponse::ConfirmBlockDownload(confirmation))) => {
                match sender.confirm(confirmation).map_err(Failure::Violation)? {
                    Confirmed::Repeated => return Ok(Progress::Ignored),
                    Confirmed::More => {}
                    Confirmed::All => self.phase = Sending::Ending(*sender),
                }
            }
            (Sending::Segments(_), Some(ServerResponse::InitiateBlockDownload { .. })) => {
                return Ok(Progress::Ignored);
            }
            // The server awaits the end still: it got lost, or the confirmation came twice.
            (Sending::Ending(_), Some(ServerResponse::ConfirmBlockDownload(_))) => {}
            (Sending::Ending(_), Some(ServerResponse::EndBlockDownload)) => {
                return Ok(Progress::Done { len: self.len });
            }
            (Sending::Segments(_) | Sending::Ending(_), _) => {
                return Err(Failure::Violation(AbortCode::UNKNOWN_COMMAND));
            }
        }
        Ok(Progress::Continue)
    }
}

#[inline]
fn next_segment(size: u32, sender: &mut Sender, payload: &mut dyn Payload) -> Result<BlockSegment, Failure> {
    const TOO_LONG: Failure = Failure::Violation(AbortCode::GENERAL);
    let offset = sender.offset().ok_or(TOO_LONG)?;
    let left = size.saturating_sub(offset);
    let len = left.min(7) as usize;
    let buffer = segmented::load(offset, len, payload)?;
    sender.push(buffer, len, left <= 7).ok_or(TOO_LONG)
}

impl BlockUpload {
    pub(super) const fn new(address: Address, block_size: u8) -> Self {
        BlockUpload { address, block_size, is_instead: false, phase: Receiving::Initiating }
    }

    /// A read by block instead of one in segments.
    pub(super) const fn instead(address: Address, block_size: u8) -> Self {
        BlockUpload { is_instead: true, ..BlockUpload::new(address, block_size) }
    }

    pub(super) fn is_instead(&self) -> bool {
        self.is_instead
    }

    /// How many bytes have come, without the last segment.
    #[inline]
    pub(super) fn offset(&self) -> u32 {
        match &self.phase {
            Receiving::Initiating => 0,
            Receiving::Segments { receiver, .. } => receiver.offset(),
        }
    }

    pub(super) fn address(&self) -> Address {
        self.address
    }

    pub(super) fn is_begun(&self) -> bool {
        !matches!(self.phase, Receiving::Initiating)
    }

    /// The same read without blocks.
    pub(super) fn segmented(&self) -> Upload {
        Upload::new(self.address)
    }

    #[inline]
    pub(super) fn request(&self) -> Raw {
        let request = match &self.phase {
            Receiving::Initiating => ClientRequest::InitiateBlockUpload {
                address: self.address,
                crc: true,
                block_size: self.block_size,
                switch_threshold: SWITCH_THRESHOLD,
            },
            Receiving::Segments { confirmation: None, .. } => ClientRequest::StartBlockUpload,
            Receiving::Segments { confirmation: Some(confirmation), .. } => {
                ClientRequest::ConfirmBlockUpload(*confirmation)
            }
        };
        request.to_raw()
    }

    /// The frame as a segment, when one is awaited.
    #[inline]
    pub(super) fn parse(&self, raw: Raw) -> Option<BlockSegment> {
        match &self.phase {
            Receiving::Initiating => None,
            Receiving::Segments { receiver, .. } => receiver.parse(raw),
        }
    }

    #[inline]
    pub(super) fn take(&mut self, segment: &BlockSegment, payload: &mut dyn Payload) -> Result<Progress, Failure> {
        let Receiving::Segments { receiver, confirmation } = &mut self.phase else {
            return Ok(Progress::Ignored);
        };
        let offset = receiver.offset();
        let received = receiver.take(segment).map_err(Failure::Violation)?;
        if received.is_next {
            segmented::store(offset, segment.data(), payload)?;
        }
        if received.ends_block {
            *confirmation = Some(receiver.confirm());
            return Ok(Progress::Continue);
        }
        Ok(Progress::Awaited)
    }

    pub(super) fn handle(&mut self, raw: Raw, payload: &mut dyn Payload) -> Result<Progress, Failure> {
        match (&mut self.phase, ServerResponse::from_raw(raw)) {
            (Receiving::Initiating, Some(ServerResponse::InitiateBlockUpload { address, crc, size }))
                if address == self.address =>
            {
                let receiver = Receiver::new(self.block_size, crc, size);
                self.phase = Receiving::Segments { receiver, confirmation: None };
                Ok(Progress::Continue)
            }
            // The server need not use blocks for few bytes, or does not know any.
            (Receiving::Initiating, Some(ServerResponse::InitiateUpload { address, content }))
                if address == self.address =>
            {
                segmented::initiated(content, payload)
            }
            // Nothing else is an answer to what was asked.
            (Receiving::Initiating, _) => Ok(Progress::Ignored),
            (Receiving::Segments { receiver, .. }, Some(ServerResponse::EndBlockUpload(block_end))) => {
                let offset = receiver.offset();
                let (segment, len) = receiver.finish(block_end).map_err(Failure::Violation)?;
                segmented::store(offset, segment.data().get(..len).unwrap_or(segment.data()), payload)?;
                Ok(Progress::BlockUploadDone { len: offset.saturating_add(len as u32) })
            }
            (Receiving::Segments { .. }, _) => Err(Failure::Violation(AbortCode::UNKNOWN_COMMAND)),
        }
    }

    /// Asks the server to go on; `false` when that was done already.
    pub(super) fn confirm_after_silence(&mut self) -> bool {
        let Receiving::Segments { receiver, confirmation } = &mut self.phase else {
            return false;
        };
        match receiver.confirm_after_silence() {
            Some(repeated) => *confirmation = Some(repeated),
            None => return false,
        }
        true
    }
}
