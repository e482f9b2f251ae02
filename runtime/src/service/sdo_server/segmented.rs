//! Expedited and segmented transfers (CiA 301, 7.2.4.3.3 to 7.2.4.3.8).

use super::entry::{self, Sink, Source, Value};
use super::{Outcome, Progress, SdoServer, State};
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

impl SdoServer {
    #[inline]
    pub(super) fn initiate_upload(&mut self, address: Address, od: &mut dyn ObjectDictionary) -> Outcome {
        let entry = entry::readable(address, od)?;
        let mut bytes = [0; 8];
        let len = od.read(&entry, 0, &mut bytes)?;
        match entry::expedited(len, &bytes) {
            Some(data) => Ok(self.answer_upload(address, data)),
            None => Ok(self.begin_segments(Source::after(entry, len, &bytes), od)),
        }
    }

    /// Answers a read without blocks: with the data, when it fits into one frame, and else with segments.
    pub(super) fn begin_upload(&mut self, source: Source, od: &mut dyn ObjectDictionary) -> Progress {
        match source.expedited() {
            Some(data) => self.answer_upload(source.address(), data),
            None => self.begin_segments(source, od),
        }
    }

    #[inline]
    fn answer_upload(&mut self, address: Address, data: Expedited) -> Progress {
        let indicated = data.len().is_some_and(|len| self.sizes_indicated.expedited(len));
        let data = if indicated { data } else { data.without_len() };
        self.answer(ServerResponse::InitiateUpload { address, content: Content::Expedited(data) });
        Progress::Read
    }

    fn begin_segments(&mut self, source: Source, od: &mut dyn ObjectDictionary) -> Progress {
        let address = source.address();
        let size = if self.sizes_indicated.longer { source.size(od) } else { None };
        self.state = State::Upload(Upload { source, offset: 0, toggle: false });
        self.answer(ServerResponse::InitiateUpload { address, content: Content::Segmented { size } });
        Progress::Continues
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
        self.answer(ServerResponse::UploadSegment(Segment::of_buffer(toggle, bytes, len, last)));
        Ok(if last { Progress::Read } else { Progress::Continues })
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
                self.answer(ServerResponse::InitiateDownload { address });
                Ok(Progress::Written)
            }
            Content::Segmented { size } => {
                let sink = Sink::open(address, size, od)?;
                self.state = State::Download(Download { sink, toggle: false });
                self.answer(ServerResponse::InitiateDownload { address });
                Ok(Progress::Continues)
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
        download.sink.write(segment.padded(), segment.data().len(), segment.last, &mut self.stage, od)?;
        download.toggle = !segment.toggle;
        self.answer(ServerResponse::DownloadSegment { toggle: segment.toggle });
        Ok(if segment.last { Progress::Written } else { Progress::Continues })
    }
}
