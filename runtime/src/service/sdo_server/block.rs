//! Block transfers (CiA 301, 7.2.4.3.9 to 7.2.4.3.15).

use super::entry::{Sink, Source, Stage, Value};
use super::{Outcome, Progress, SdoServer, State};
use crate::abort::AbortCode;
use crate::object::{Address, ObjectDictionary};
use crate::service::sdo_block::{Confirmed, Receiver, Sender};
use crate::wire::sdo::{BlockEnd, Confirmation, Raw, ServerResponse};
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
    pub(super) fn address(&self) -> Address {
        self.source.address()
    }

    /// The next segment, when it is time for one.
    #[inline]
    pub(super) fn segment(&mut self, od: &mut dyn ObjectDictionary) -> Option<Result<BlockSegment, AbortCode>> {
        if self.phase != Phase::Sending || !self.sender.is_sending() {
            return None;
        }
        Some(self.read(od))
    }

    #[inline]
    fn read(&mut self, od: &mut dyn ObjectDictionary) -> Result<BlockSegment, AbortCode> {
        let offset = self.sender.offset().ok_or(AbortCode::GENERAL)?;
        let (Value { len, bytes }, last) = self.source.read(offset, od)?;
        self.sender.push(bytes, len, last).ok_or(AbortCode::GENERAL)
    }
}

impl BlockDownload {
    pub(super) fn address(&self) -> Address {
        self.sink.address()
    }

    #[inline]
    pub(super) fn parse(&self, raw: Raw) -> Option<BlockSegment> {
        self.receiver.parse(raw)
    }

    pub(super) fn confirm_after_silence(&mut self) -> Option<Confirmation> {
        self.receiver.confirm_after_silence()
    }

    /// Takes a segment, and says whether it is to be confirmed.
    #[inline]
    pub(super) fn take(
        &mut self,
        segment: &BlockSegment,
        stage: &mut Stage,
        od: &mut dyn ObjectDictionary,
    ) -> Result<Option<Confirmation>, AbortCode> {
        let received = self.receiver.take(segment)?;
        if received.is_next {
            self.sink.write(segment.padded(), 7, false, stage, od)?;
        }
        Ok(received.ends_block.then(|| self.receiver.confirm()))
    }
}

impl SdoServer {
    pub(super) fn initiate_block_upload(
        &mut self,
        address: Address,
        crc: bool,
        block_size: u8,
        switch_threshold: u8,
        od: &mut dyn ObjectDictionary,
    ) -> Outcome {
        let source = Source::open(address, od)?;
        let size = source.size(od);
        if switch_threshold > 0 && size.is_some_and(|size| size <= u32::from(switch_threshold)) {
            return Ok(self.begin_upload(source, od));
        }
        let sender = Sender::new(block_size, crc)?;
        self.state = State::BlockUpload(BlockUpload { source, sender, phase: Phase::Starting });
        let size = size.filter(|_| self.sizes_indicated.longer);
        self.answer(ServerResponse::InitiateBlockUpload { address, crc: true, size });
        Ok(Progress::Continues)
    }

    pub(super) fn start_block_upload(&mut self) -> Outcome {
        match &mut self.state {
            State::BlockUpload(upload) if upload.phase == Phase::Starting => upload.phase = Phase::Sending,
            _ => return Err(AbortCode::UNKNOWN_COMMAND),
        }
        Ok(Progress::Continues)
    }

    pub(super) fn confirm_block_upload(&mut self, confirmation: Confirmation) -> Outcome {
        let State::BlockUpload(upload) = &mut self.state else {
            return Err(AbortCode::UNKNOWN_COMMAND);
        };
        match upload.phase {
            // The client awaits segments already: its start got lost.
            Phase::Starting if confirmation.sequence == 0 => upload.phase = Phase::Sending,
            Phase::Starting => return Err(AbortCode::UNKNOWN_COMMAND),
            Phase::Sending => match upload.sender.confirm(confirmation)? {
                Confirmed::Repeated | Confirmed::More => {}
                Confirmed::All => {
                    upload.phase = Phase::Ending;
                    return self.end_block_upload();
                }
            },
            // The client awaits the end still: it got lost.
            Phase::Ending => return self.end_block_upload(),
        }
        Ok(Progress::Continues)
    }

    fn end_block_upload(&mut self) -> Outcome {
        if let State::BlockUpload(upload) = &self.state {
            let block_end = upload.sender.block_end().ok_or(AbortCode::GENERAL)?;
            self.answer(ServerResponse::EndBlockUpload(block_end));
        }
        Ok(Progress::Continues)
    }

    pub(super) fn block_upload_ended(&mut self) -> Outcome {
        match &self.state {
            State::BlockUpload(upload) if upload.phase == Phase::Ending => Ok(Progress::Read),
            _ => Err(AbortCode::UNKNOWN_COMMAND),
        }
    }

    pub(super) fn initiate_block_download(
        &mut self,
        address: Address,
        crc: bool,
        size: Option<u32>,
        od: &mut dyn ObjectDictionary,
    ) -> Outcome {
        let sink = Sink::open(address, size, od)?;
        let block_size = self.block_size;
        let receiver = Receiver::new(block_size, crc, size);
        self.state = State::BlockDownload(BlockDownload { sink, receiver });
        self.answer(ServerResponse::InitiateBlockDownload { address, crc: true, block_size });
        Ok(Progress::Continues)
    }

    /// Segments of a block are not answered but at its end.
    #[inline]
    pub(super) fn confirm_block_download(&mut self, confirmation: Option<Confirmation>) -> Progress {
        if let Some(confirmation) = confirmation {
            self.answer(ServerResponse::ConfirmBlockDownload(confirmation));
        }
        Progress::Continues
    }

    pub(super) fn end_block_download(&mut self, block_end: BlockEnd, od: &mut dyn ObjectDictionary) -> Outcome {
        let State::BlockDownload(download) = &mut self.state else {
            return Err(AbortCode::UNKNOWN_COMMAND);
        };
        let (segment, len) = download.receiver.finish(block_end)?;
        download.sink.write(segment.padded(), len, true, &mut self.stage, od)?;
        self.answer(ServerResponse::EndBlockDownload);
        Ok(Progress::Written)
    }
}
