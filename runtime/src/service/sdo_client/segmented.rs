//! Expedited and segmented transfers (CiA 301, 7.2.4.3.3 to 7.2.4.3.8).

use super::Payload;
use super::progress::{Failure, Progress};
use crate::abort::AbortCode;
use crate::object::Address;
use crate::wire::sdo::{ClientRequest, Content, Expedited, Raw, Segment, ServerResponse};

/// A read under way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Upload {
    address: Address,
    /// `None` until the server has begun to answer.
    segments: Option<Segments>,
}

/// What of a read has come.
#[derive(Clone, Copy, Debug)]
struct Segments {
    toggle: bool,
    offset: u32,
    announced: Option<u32>,
}

/// A write under way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Download {
    address: Address,
    len: u32,
    /// What the server has confirmed.
    offset: u32,
    /// `None` until the server has begun to answer.
    toggle: Option<bool>,
}

impl Upload {
    pub(super) const fn new(address: Address) -> Self {
        Upload { address, segments: None }
    }

    /// As after an answer of the server that announces segments.
    pub(super) const fn begun(address: Address, announced: Option<u32>) -> Self {
        Upload { address, segments: Some(Segments { toggle: false, offset: 0, announced }) }
    }

    pub(super) fn address(&self) -> Address {
        self.address
    }

    pub(super) fn is_begun(&self) -> bool {
        self.segments.is_some()
    }

    /// How many bytes have come.
    #[inline]
    pub(super) fn offset(&self) -> u32 {
        self.segments.as_ref().map_or(0, |segments| segments.offset)
    }

    #[inline]
    pub(super) fn request(&self) -> Raw {
        match self.segments {
            None => ClientRequest::InitiateUpload { address: self.address }.to_raw(),
            Some(Segments { toggle, .. }) => ClientRequest::UploadSegment { toggle }.to_raw(),
        }
    }

    #[inline]
    pub(super) fn handle(&mut self, raw: Raw, payload: &mut dyn Payload) -> Result<Progress, Failure> {
        match &mut self.segments {
            Some(segments) => match raw.segment() {
                Some(segment) => segments.take(segment, payload),
                None => Err(Failure::Violation(AbortCode::UNKNOWN_COMMAND)),
            },
            None => match ServerResponse::from_raw(raw) {
                Some(ServerResponse::InitiateUpload { address, content }) if address == self.address => {
                    initiated(content, payload)
                }
                // Nothing else is an answer to what was asked.
                _ => Ok(Progress::Ignored),
            },
        }
    }
}

/// The answer to an initiation: the data, or notice of segments.
#[inline]
pub(super) fn initiated(content: Content, payload: &mut dyn Payload) -> Result<Progress, Failure> {
    match content {
        Content::Expedited(expedited) => {
            let taken = payload.store(0, expedited.data());
            match expedited.len() {
                Some(len) if taken < len => Err(Failure::TooLong { capacity: taken as u32 }),
                _ => Ok(Progress::Done { len: taken as u32 }),
            }
        }
        Content::Segmented { size } => Ok(Progress::Segmented { announced: size }),
    }
}

impl Segments {
    #[inline]
    fn take(&mut self, segment: Segment, payload: &mut dyn Payload) -> Result<Progress, Failure> {
        if segment.toggle != self.toggle {
            return Err(Failure::Violation(AbortCode::TOGGLE_BIT));
        }
        let data = segment.data();
        let end = self.offset.checked_add(data.len() as u32);
        let Some(end) = end.filter(|end| self.announced.is_none_or(|announced| *end <= announced)) else {
            return Err(Failure::Violation(AbortCode::LENGTH_TOO_HIGH));
        };
        store(self.offset, data, payload)?;
        self.offset = end;
        self.toggle = !self.toggle;
        match self.announced {
            _ if !segment.last => Ok(Progress::Continue),
            Some(announced) if end < announced => Err(Failure::Violation(AbortCode::LENGTH_TOO_LOW)),
            _ => Ok(Progress::Done { len: end }),
        }
    }
}

impl Download {
    pub(super) const fn new(address: Address, len: u32) -> Self {
        Download { address, len, offset: 0, toggle: None }
    }

    /// As after an answer of the server that awaits segments.
    pub(super) const fn begun(address: Address, len: u32) -> Self {
        Download { address, len, offset: 0, toggle: Some(false) }
    }

    pub(super) fn address(&self) -> Address {
        self.address
    }

    pub(super) fn is_begun(&self) -> bool {
        self.toggle.is_some()
    }

    /// How many bytes the server has confirmed.
    #[inline]
    pub(super) fn offset(&self) -> u32 {
        self.offset
    }

    #[inline]
    pub(super) fn request(&self, always_four_bytes: bool, payload: &mut dyn Payload) -> Result<Raw, Failure> {
        let address = self.address;
        if let Some(toggle) = self.toggle {
            let left = self.len - self.offset;
            let len = left.min(7) as usize;
            let buffer = load(self.offset, len, payload)?;
            let segment = Segment::of_buffer(toggle, buffer, len, left <= 7);
            return Ok(ClientRequest::DownloadSegment(segment).to_raw());
        }
        let content = match self.expedited(always_four_bytes, payload)? {
            Some(expedited) => Content::Expedited(expedited),
            None => Content::Segmented { size: Some(self.len) },
        };
        Ok(ClientRequest::InitiateDownload { address, content }.to_raw())
    }

    /// The data, when it fits into one frame.
    #[inline]
    fn expedited(&self, always_four_bytes: bool, payload: &mut dyn Payload) -> Result<Option<Expedited>, Failure> {
        if !self.is_expedited() {
            return Ok(None);
        }
        let len = self.len as usize;
        let [a, b, c, d, ..] = load(0, len, payload)?;
        Ok(Expedited::of_buffer([a, b, c, d], if always_four_bytes { 4 } else { len }))
    }

    fn is_expedited(&self) -> bool {
        (1..=4).contains(&self.len)
    }

    #[inline]
    pub(super) fn handle(&mut self, raw: Raw) -> Result<Progress, Failure> {
        match self.toggle {
            Some(toggle) => match raw.download_segment() {
                Some(confirmed) if confirmed != toggle => Err(Failure::Violation(AbortCode::TOGGLE_BIT)),
                Some(_) => {
                    self.offset = self.offset.saturating_add(7).min(self.len);
                    self.toggle = Some(!toggle);
                    if self.offset == self.len { Ok(Progress::Done { len: self.len }) } else { Ok(Progress::Continue) }
                }
                None => Err(Failure::Violation(AbortCode::UNKNOWN_COMMAND)),
            },
            None => match ServerResponse::from_raw(raw) {
                Some(ServerResponse::InitiateDownload { address }) if address == self.address => {
                    if self.is_expedited() {
                        return Ok(Progress::Done { len: self.len });
                    }
                    self.toggle = Some(false);
                    Ok(Progress::Continue)
                }
                // Nothing else is an answer to what was asked.
                _ => Ok(Progress::Ignored),
            },
        }
    }
}

/// The `len` bytes at `offset` of what is to be written, at most seven; zeros follow.
#[inline]
pub(super) fn load(offset: u32, len: usize, payload: &mut dyn Payload) -> Result<[u8; 8], Failure> {
    let mut buffer = [0; 8];
    // Eight bytes are copied at once where seven are not.
    let got = payload.load(offset, &mut buffer);
    if got < len {
        return Err(Failure::TooShort { len: offset.saturating_add(got as u32) });
    }
    let data = u64::from_le_bytes(buffer) & !(u64::MAX << (8 * len));
    Ok(data.to_le_bytes())
}

/// Hands over what was read.
#[inline]
pub(super) fn store(offset: u32, data: &[u8], payload: &mut dyn Payload) -> Result<(), Failure> {
    let taken = payload.store(offset, data);
    if taken < data.len() {
        return Err(Failure::TooLong { capacity: offset.saturating_add(taken as u32) });
    }
    Ok(())
}
