//! Expedited and segmented transfers (CiA 301, 7.2.4.3.3 to 7.2.4.3.8).

use super::{Failure, Payload, Progress, SdoError, violation};
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

    pub(super) fn address(&self) -> Address {
        self.address
    }

    pub(super) fn is_begun(&self) -> bool {
        self.segments.is_some()
    }

    #[inline]
    pub(super) fn request(&self) -> Raw {
        match self.segments {
            None => ClientRequest::InitiateUpload { address: self.address }.to_raw(),
            Some(Segments { toggle, .. }) => ClientRequest::UploadSegment { toggle }.to_raw(),
        }
    }

    #[inline]
    pub(super) fn handle(
        &mut self,
        response: Option<ServerResponse>,
        payload: &mut dyn Payload,
    ) -> Result<Progress, Failure> {
        match (&mut self.segments, response) {
            (None, Some(ServerResponse::InitiateUpload { address, content })) if address == self.address => {
                self.begin(content, payload)
            }
            // Nothing else is an answer to what was asked.
            (None, _) => Ok(Progress::Ignored),
            (Some(segments), Some(ServerResponse::UploadSegment(segment))) => {
                segments.take(self.address, segment, payload)
            }
            (Some(_), _) => Err(violation(self.address, AbortCode::UNKNOWN_COMMAND)),
        }
    }

    #[inline]
    pub(super) fn begin(&mut self, content: Content, payload: &mut dyn Payload) -> Result<Progress, Failure> {
        match content {
            Content::Expedited(expedited) => {
                let taken = payload.store(0, expedited.data());
                match expedited.len() {
                    // Nothing is left that the server could be told to abort.
                    Some(len) if taken < len => {
                        let error = SdoError::TooLong { address: self.address, capacity: taken as u32 };
                        Err(Failure { told: None, error })
                    }
                    _ => Ok(Progress::Done { len: taken as u32 }),
                }
            }
            Content::Segmented { size } => {
                self.segments = Some(Segments { toggle: false, offset: 0, announced: size });
                Ok(Progress::Continue)
            }
        }
    }
}

impl Segments {
    #[inline]
    fn take(&mut self, address: Address, segment: Segment, payload: &mut dyn Payload) -> Result<Progress, Failure> {
        if segment.toggle != self.toggle {
            return Err(violation(address, AbortCode::TOGGLE_BIT));
        }
        let data = segment.data();
        let end = self.offset.checked_add(data.len() as u32);
        let Some(end) = end.filter(|end| self.announced.is_none_or(|announced| *end <= announced)) else {
            return Err(violation(address, AbortCode::LENGTH_TOO_HIGH));
        };
        store(address, self.offset, data, payload)?;
        self.offset = end;
        self.toggle = !self.toggle;
        match self.announced {
            _ if !segment.last => Ok(Progress::Continue),
            Some(announced) if end < announced => Err(violation(address, AbortCode::LENGTH_TOO_LOW)),
            _ => Ok(Progress::Done { len: end }),
        }
    }
}

impl Download {
    pub(super) const fn new(address: Address, len: u32) -> Self {
        Download { address, len, offset: 0, toggle: None }
    }

    /// As after the answer of the server to the initiation.
    pub(super) fn accepted(self) -> Self {
        Download { toggle: Some(false), ..self }
    }

    pub(super) fn address(&self) -> Address {
        self.address
    }

    pub(super) fn is_begun(&self) -> bool {
        self.toggle.is_some()
    }

    #[inline]
    pub(super) fn request(&self, always_four_bytes: bool, payload: &mut dyn Payload) -> Result<Raw, Failure> {
        let address = self.address;
        if let Some(toggle) = self.toggle {
            let left = self.len - self.offset;
            let len = left.min(7) as usize;
            let buffer = load(address, self.offset, len, true, payload)?;
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
        let buffer = load(self.address, 0, len, false, payload)?;
        Ok(buffer.get(..if always_four_bytes { 4 } else { len }).and_then(Expedited::new))
    }

    fn is_expedited(&self) -> bool {
        (1..=4).contains(&self.len)
    }

    #[inline]
    pub(super) fn handle(&mut self, response: Option<ServerResponse>) -> Result<Progress, Failure> {
        match (self.toggle, response) {
            (None, Some(ServerResponse::InitiateDownload { address })) if address == self.address => {
                if self.is_expedited() {
                    return Ok(Progress::Done { len: self.len });
                }
                self.toggle = Some(false);
                Ok(Progress::Continue)
            }
            // Nothing else is an answer to what was asked.
            (None, _) => Ok(Progress::Ignored),
            (Some(toggle), Some(ServerResponse::DownloadSegment { toggle: confirmed })) => {
                if toggle != confirmed {
                    return Err(violation(self.address, AbortCode::TOGGLE_BIT));
                }
                self.offset = self.offset.saturating_add(7).min(self.len);
                self.toggle = Some(!toggle);
                if self.offset == self.len { Ok(Progress::Done { len: self.len }) } else { Ok(Progress::Continue) }
            }
            (Some(_), _) => Err(violation(self.address, AbortCode::UNKNOWN_COMMAND)),
        }
    }
}

/// The `len` bytes at `offset` of what is to be written, at most seven; zeros follow. Before the first frame there
/// is no transfer that the server could be told to abort.
#[inline]
pub(super) fn load(
    address: Address,
    offset: u32,
    len: usize,
    is_begun: bool,
    payload: &mut dyn Payload,
) -> Result<[u8; 8], Failure> {
    let mut buffer = [0; 8];
    // Eight bytes are copied at once where seven are not.
    let got = payload.load(offset, &mut buffer);
    if got >= len {
        let data = u64::from_le_bytes(buffer) & !(u64::MAX << (8 * len));
        return Ok(data.to_le_bytes());
    }
    let error = SdoError::TooShort { address, len: offset.saturating_add(got as u32) };
    Err(Failure { told: is_begun.then_some(AbortCode::CANNOT_TRANSFER), error })
}

/// Hands over what was read.
#[inline]
pub(super) fn store(address: Address, offset: u32, data: &[u8], payload: &mut dyn Payload) -> Result<(), Failure> {
    let taken = payload.store(offset, data);
    if taken >= data.len() {
        return Ok(());
    }
    let error = SdoError::TooLong { address, capacity: offset.saturating_add(taken as u32) };
    Err(Failure { told: Some(AbortCode::OUT_OF_MEMORY), error })
}
