//! SDO server: a device gives access to its dictionary (CiA 301, 7.2.4).
//!
//! ```text
//!                 initiate (expedited)          request, answered at once
//!        +-----------------------------> Idle
//!        |                                 | initiate
//!        |                                 v
//!        +------ last piece ------ Upload | Download | BlockUpload | BlockDownload
//!        +------ abort, timeout ---------+
//! ```
//!
//! The dictionary is lent to each call, and is asked by offset: the server holds no data but a value of a
//! fixed size, which must be read and written whole. A request is answered by one frame, which
//! [`SdoServer::poll_transmit`] gives; the segments of a block upload are read as they are pulled.

mod entry;
mod segmented;

use self::segmented::{Download, Upload};
use crate::abort::AbortCode;
use crate::frame::Frame;
use crate::id::{CobId, NodeId};
use crate::object::{Address, ObjectDictionary};
use crate::time::{Duration, Instant};
use crate::wire::sdo::{self, Abort, ClientRequest, ServerResponse};

/// One SDO channel of a device, the side that serves.
#[derive(Clone, Debug)]
pub struct SdoServer {
    request: CobId,
    response: CobId,
    timeout: Duration,
    sizes_indicated: bool,
    padded_writes: bool,
    state: State,
    /// The answer to the last request, until it is pulled.
    reply: Option<[u8; 8]>,
    /// When the client has waited too long; of no meaning in `Idle`.
    deadline: Instant,
}

/// What happened to an entry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// A client has read the entry to its end.
    Read(Address),
    /// A client has written the entry, and the dictionary has taken all of it.
    Written(Address),
    /// A transfer came to nothing, or was refused. An entry that streams may have got a part of the data.
    Aborted {
        /// The entry; `0000:00` when a request named none.
        address: Address,
        /// The reason. [`AbortCode::GENERAL`] by the client: it began another transfer instead.
        code: AbortCode,
        /// Who gave up.
        by: Side,
    },
}

/// One of the two sides of a transfer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The side that reads and writes.
    Client,
    /// The side that owns the dictionary.
    Server,
}

#[derive(Clone, Copy, Debug)]
enum State {
    Idle,
    Upload(Upload),
    Download(Download),
}

impl SdoServer {
    /// A server that listens to `request` and answers with `response`. A transfer times out after 1 s
    /// without a frame of the client.
    #[must_use]
    pub const fn new(request: CobId, response: CobId) -> Self {
        SdoServer {
            request,
            response,
            timeout: Duration::from_secs(1),
            sizes_indicated: true,
            padded_writes: false,
            state: State::Idle,
            reply: None,
            deadline: Instant::ZERO,
        }
    }

    /// The default server of a node (1200h): 600h + node-ID, answered with 580h + node-ID.
    #[must_use]
    pub const fn of_node(node: NodeId) -> Self {
        SdoServer::new(CobId::of_node(0x600, node), CobId::of_node(0x580, node))
    }

    /// Gives a transfer up after `timeout` without a frame of the client.
    #[must_use]
    pub const fn with_timeout(self, timeout: Duration) -> Self {
        SdoServer { timeout, ..self }
    }

    /// Whether answers to reads tell the number of bytes; they do unless told otherwise. Without it, an
    /// expedited upload is answered with command 42h, as some devices do.
    #[must_use]
    pub const fn with_sizes_indicated(self, sizes_indicated: bool) -> Self {
        SdoServer { sizes_indicated, ..self }
    }

    /// Whether four bytes are taken for a smaller value, whose low bytes they are; otherwise that is a
    /// [`AbortCode::LENGTH_TOO_HIGH`], as CiA 301 has it. Some devices know no other way to write.
    #[must_use]
    pub const fn with_padded_writes(self, padded_writes: bool) -> Self {
        SdoServer { padded_writes, ..self }
    }

    /// The COB-ID of requests.
    #[must_use]
    pub const fn request_id(&self) -> CobId {
        self.request
    }

    /// The COB-ID of responses.
    #[must_use]
    pub const fn response_id(&self) -> CobId {
        self.response
    }

    /// Whether a transfer is under way.
    #[must_use]
    pub const fn is_busy(&self) -> bool {
        !matches!(self.state, State::Idle)
    }

    /// Forgets the transfer under way, without a frame: for a reset of the communication.
    pub fn reset(&mut self) {
        self.state = State::Idle;
        self.reply = None;
    }

    /// Takes a frame. Frames of other identifiers, remote frames and frames of other than eight bytes are
    /// not for an SDO server, and ignored.
    #[inline]
    pub fn handle_frame(&mut self, now: Instant, frame: &Frame, od: &mut dyn ObjectDictionary) -> Option<Event> {
        if frame.id() != self.request {
            return None;
        }
        let bytes = frame.data().try_into().ok()?;
        self.handle_request(now, bytes, od)
    }

    /// Gives up a transfer whose client has been silent for too long.
    pub fn handle_timeout(&mut self, now: Instant) -> Option<Event> {
        if !self.is_busy() || now < self.deadline {
            return None;
        }
        Some(self.abort(self.address(), AbortCode::TIMED_OUT))
    }

    /// The next frame to be sent.
    #[inline]
    pub fn poll_transmit(&mut self, _now: Instant, _od: &mut dyn ObjectDictionary) -> Option<Frame> {
        Some(Frame::from_array(self.response, self.reply.take()?))
    }

    /// When to call [`SdoServer::handle_timeout`]. Changes with every frame, in or out.
    #[must_use]
    pub const fn poll_timeout(&self) -> Option<Instant> {
        if self.is_busy() { Some(self.deadline) } else { None }
    }

    fn handle_request(&mut self, now: Instant, bytes: &[u8; 8], od: &mut dyn ObjectDictionary) -> Option<Event> {
        self.deadline = now + self.timeout;
        let before = self.is_busy().then(|| self.address());
        let Some(request) = ClientRequest::parse(bytes) else {
            return Some(self.abort(before.unwrap_or(sdo::address(bytes)), AbortCode::UNKNOWN_COMMAND));
        };
        let (address, outcome) = match request {
            ClientRequest::InitiateUpload { address } => (address, self.initiate_upload(address, od)),
            ClientRequest::InitiateDownload { address, content } => {
                (address, self.initiate_download(address, content, od))
            }
            ClientRequest::UploadSegment { toggle } => (self.address(), self.upload_segment(toggle, od)),
            ClientRequest::DownloadSegment(segment) => (self.address(), self.download_segment(segment, od)),
            ClientRequest::Abort(Abort { code, .. }) => return self.abandon(before?, code),
            _ => (before.unwrap_or(sdo::address(bytes)), Err(AbortCode::UNKNOWN_COMMAND)),
        };
        match (outcome, before) {
            (Ok(None), Some(before)) if request.is_initiate() => {
                Some(aborted(before, AbortCode::GENERAL, Side::Client))
            }
            (Ok(event), _) => event,
            (Err(code), _) => Some(self.abort(address, code)),
        }
    }

    fn answer(&mut self, response: ServerResponse) {
        self.reply = Some(response.to_bytes());
    }

    /// Ends the transfer, and tells the client.
    #[cold]
    fn abort(&mut self, address: Address, code: AbortCode) -> Event {
        self.state = State::Idle;
        self.answer(ServerResponse::Abort(Abort { address, code }));
        aborted(address, code, Side::Server)
    }

    /// The client has ended the transfer.
    fn abandon(&mut self, address: Address, code: AbortCode) -> Option<Event> {
        self.reset();
        Some(aborted(address, code, Side::Client))
    }

    /// The entry that is transferred; `0000:00` when there is none.
    fn address(&self) -> Address {
        match &self.state {
            State::Idle => Address::new(0, 0),
            State::Upload(upload) => upload.address(),
            State::Download(download) => download.address(),
        }
    }
}

const fn aborted(address: Address, code: AbortCode, by: Side) -> Event {
    Event::Aborted { address, code, by }
}
