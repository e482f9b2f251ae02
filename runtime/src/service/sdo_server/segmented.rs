//! Expedited and segmented transfers (CiA 301, 7.2.4.3.3 to 7.2.4.3.8).

use super::entry::{self, Sink, Source, Value};
use super::{Event, SdoServer, State};
use crate::abort::AbortCode;
use crate::object::{Address, ObjectDictionary};
use crate::wire::sdo::{Content, Expedited, Segment, ServerResponse};

/// A segmented upload under way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Upload {
    source: Source,
    offset: u32,
    toggle: bool,
}

/// A segmented download under way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Download {
    sink: Sink,
    toggle: bool,
}

impl Upload {
    pub(super) fn address(&self) -> Address {
        self.source.address()
    }
}

impl Download {
    pub(super) fn address(&self) -> Address {
        self.sink.address()
    }
}

pub(super) type Outcome = Result<Option<Event>, AbortCode>;

impl SdoServer {
    #[inline]
    pub(super) fn initiate_upload(&mut self, address: Address, od: &mut dyn ObjectDictionary) -> Outcome {
        let source = Source::open(address, od)?;
        self.begin_upload(source, od)
    }

    /// Answers a read with the data, when it fits into one frame, and else begins to send segments.
    #[inline]
    pub(super) fn begin_upload(&mut self, source: Source, od: &mut dyn ObjectDictionary) -> Outcome {
        let address = source.address();
        if let Some(data) = source.value().and_then(|value| self.expedited(value)) {
            self.state = State::Idle;
            self.answer(ServerResponse::InitiateUpload { address, content: Content::Expedited(data) });
            return Ok(Some(Event::Read(address)));
        }
        let size = if self.sizes_indicated { source.size(od) } else { None };
        self.state = State::Upload(Upload { source, offset: 0, toggle: false });
        self.answer(ServerResponse::InitiateUpload { address, content: Content::Segmented { size } });
        Ok(None)
    }

    #[inline]
    fn expedited(&self, value: &Value) -> Option<Expedited> {
        let [a, b, c, d, ..] = value.bytes;
        let data = Expedited::new([a, b, c, d].get(..value.len)?)?;
        if self.sizes_indicated { Some(data) } else { Some(Expedited::of_unknown_len([a, b, c, d])) }
    }

    #[inline]
    pub(super) fn upload_segment(&mut self, toggle: bool, od: &mut dyn ObjectDictionary) -> Outcome {
        let State::Upload(upload) = &mut self.state else {
            return Err(AbortCode::UNKNOWN_COMMAND);
        };
        if toggle != upload.toggle {
            return Err(AbortCode::TOGGLE_BIT);
        }
        let (Value { len, bytes }, last) = upload.source.read(upload.offset, od)?;
        // An entry longer than 4 GiB has no place in 301's size field either.
        upload.offset = upload.offset.checked_add(len as u32).ok_or(AbortCode::GENERAL)?;
        upload.toggle = !toggle;
        let address = upload.address();
        self.answer(ServerResponse::UploadSegment(Segment::of_buffer(toggle, bytes, len, last)));
        if !last {
            return Ok(None);
        }
        self.state = State::Idle;
        Ok(Some(Event::Read(address)))
    }

    #[inline]
    pub(super) fn initiate_download(
        &mut self,
        address: Address,
        content: Content,
        od: &mut dyn ObjectDictionary,
    ) -> Outcome {
        match content {
            Content::Expedited(data) => {
                let may_be_padded = self.padded_writes || data.len().is_none();
                entry::write_expedited(address, data, may_be_padded, od)?;
                self.state = State::Idle;
                self.answer(ServerResponse::InitiateDownload { address });
                Ok(Some(Event::Written(address)))
            }
            Content::Segmented { size } => {
                let sink = Sink::open(address, size, od)?;
                self.state = State::Download(Download { sink, toggle: false });
                self.answer(ServerResponse::InitiateDownload { address });
                Ok(None)
            }
        }
    }

    #[inline]
    pub(super) fn download_segment(&mut self, segment: Segment, od: &mut dyn ObjectDictionary) -> Outcome {
        let State::Download(download) = &mut self.state else {
            return Err(AbortCode::UNKNOWN_COMMAND);
        };
        if segment.toggle != download.toggle {
            return Err(AbortCode::TOGGLE_BIT);
        }
        download.sink.write(segment.data(), segment.last, od)?;
        download.toggle = !segment.toggle;
        let address = download.address();
        self.answer(ServerResponse::DownloadSegment { toggle: segment.toggle });
        if !segment.last {
            return Ok(None);
        }
        self.state = State::Idle;
        Ok(Some(Event::Written(address)))
    }
}
