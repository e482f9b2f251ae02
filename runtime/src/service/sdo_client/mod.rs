//! SDO client: access to the dictionary of another device (CiA 301, 7.2.4).
//!
//! ```text
//!            read, write                 answer of the server
//!     Idle -------------> Initiate... -----------------------> ...Segments
//!      ^                       |                                    |
//!      +--- Event::Done -------+------------------------------------+
//!      +--- Event::Failed: abort of the server, time-out, violation +
//! ```
//!
//! The data is lent to each call as a [`Payload`], which is written from and read into by offset; so
//! the client holds none, and a segment that got lost is read again. It must be the same payload from
//! [`SdoClient::read`] or [`SdoClient::write`] until the event that ends the transfer.

mod block;
mod payload;
mod progress;
mod segmented;

pub use self::payload::{Payload, Scalar};

use self::block::{BlockDownload, BlockUpload};
use self::progress::{Failure, Progress};
use self::segmented::{Download, Upload};
use crate::abort::AbortCode;
use crate::cia301::connection;
use crate::frame::Frame;
use crate::id::{CobId, NodeId};
use crate::object::Address;
use crate::service::sdo_block;
use crate::time::{Duration, Instant};
use crate::wire::sdo::{Abort, ClientRequest, Raw};
use crate::wire::sdo_block::BlockSegment;

/// One SDO channel to a device, the side that reads and writes. One transfer at a time.
#[derive(Clone, Debug)]
pub struct SdoClient {
    request: CobId,
    response: CobId,
    timeout: Duration,
    always_four_bytes: bool,
    block_writes_from: u32,
    block_reads_from: u32,
    block_size: u8,
    blocks: Blocks,
    state: State,
    /// The last frame of the transfer before, until it is pulled: an abort, or the end of a block upload.
    parting: Option<Raw>,
    /// Whether the state has a frame to send.
    unsent: bool,
    /// The last response that was taken: a repetition of it is ignored.
    taken: Raw,
    /// When the transfer began.
    began: Instant,
    /// When the server has been silent for too long; of no meaning in `Idle`.
    deadline: Instant,
}

/// Whether the server knows block transfers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Blocks {
    /// Not refused so far.
    Possible,
    /// The server did not begin one, and is asked for segments instead.
    Doubtful,
    /// It does not know them: it did not begin one, but has transferred segments.
    Unknown,
}

/// How a transfer ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "the names say what it is")]
pub enum Event {
    /// In success.
    Done {
        address: Address,
        /// How many bytes were read or written. When the device does not say (command 42h), these are as many
        /// of four bytes as the payload had room for.
        len: u32,
    },
    Failed(SdoError),
}

/// Why a transfer failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
#[allow(missing_docs, reason = "the names say what it is")]
pub enum SdoError {
    /// The device refused or gave up.
    #[error("{address}: the device aborts: {code}")]
    Aborted { address: Address, code: AbortCode },
    /// The device did not answer in time. It was sent an abort.
    #[error("{address}: no answer of the device in time")]
    TimedOut { address: Address },
    /// The device answers, but the transfer takes too long for what it has transferred: more than ten times the
    /// time-out, and another one for each 64 bytes. The device was sent an abort.
    #[error("{address}: the device answers, but the transfer makes no progress")]
    Stalled { address: Address },
    /// The device sends more bytes than the payload has room for.
    #[error("{address}: the device sends more than the {capacity} bytes that there is room for")]
    TooLong { address: Address, capacity: u32 },
    /// The payload has fewer bytes than were to be written.
    #[error("{address}: only {len} bytes are there to be written")]
    TooShort { address: Address, len: u32 },
    /// The device broke the protocol, and was sent an abort.
    #[error("{address}: the device breaks the protocol: {code}")]
    Violation { address: Address, code: AbortCode },
}

impl SdoError {
    /// The entry whose transfer failed.
    #[must_use]
    pub const fn address(&self) -> Address {
        match *self {
            SdoError::Aborted { address, .. }
            | SdoError::TimedOut { address }
            | SdoError::Stalled { address }
            | SdoError::TooLong { address, .. }
            | SdoError::TooShort { address, .. }
            | SdoError::Violation { address, .. } => address,
        }
    }
}

/// The client has a transfer under way already.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[error("{address}: an SDO transfer is still under way")]
pub struct Busy {
    /// The entry that is being transferred.
    pub address: Address,
}

#[derive(Clone, Copy, Debug)]
enum State {
    Idle,
    Upload(Upload),
    Download(Download),
    BlockUpload(BlockUpload),
    BlockDownload(BlockDownload),
    /// The payload was too short; the error is still to be reported.
    Failed(SdoError),
}

/// No response begins with a specifier of 7.
const NOTHING: Raw = Raw(u64::MAX);

impl SdoClient {
    /// A client that sends to `request` and listens to `response`. It waits 1 s for each answer.
    #[must_use]
    pub const fn new(request: CobId, response: CobId) -> Self {
        SdoClient {
            request,
            response,
            timeout: Duration::from_secs(1),
            always_four_bytes: false,
            block_writes_from: u32::MAX,
            block_reads_from: u32::MAX,
            block_size: BlockSegment::MAX_SEQUENCE,
            blocks: Blocks::Possible,
            state: State::Idle,
            parting: None,
            unsent: false,
            taken: NOTHING,
            began: Instant::ZERO,
            deadline: Instant::ZERO,
        }
    }

    /// A client of the default server of a node (1200h): 600h + node-ID, answered with 580h + node-ID.
    #[must_use]
    pub const fn of_node(node: NodeId) -> Self {
        SdoClient::new(CobId::of_node(connection::SDO_REQUEST, node), CobId::of_node(connection::SDO_RESPONSE, node))
    }

    /// Waits `timeout` for each answer, and for all of them ten times as long, and once more for each 64 bytes.
    #[must_use]
    pub const fn with_timeout(self, timeout: Duration) -> Self {
        SdoClient { timeout, ..self }
    }

    /// How long it waits for each answer.
    #[must_use]
    pub const fn timeout(&self) -> Duration {
        self.timeout
    }

    /// Whether values of less than four bytes are written as four (command 23h), padded with zeros. Some
    /// devices know no other way.
    #[must_use]
    pub const fn with_always_four_bytes(self, always_four_bytes: bool) -> Self {
        SdoClient { always_four_bytes, ..self }
    }

    /// Writes `len` bytes and more by block; without this, none. A server that does not begin a block
    /// transfer gets segments instead, from then on always if that succeeds.
    #[must_use]
    pub const fn with_block_writes_from(self, len: u32) -> Self {
        SdoClient { block_writes_from: len, ..self }
    }

    /// Reads by block what the server announces to have `len` bytes or more; without this, nothing. The
    /// announcement is the answer to a read in segments, which is aborted then. A server that does not begin a block
    /// transfer is asked for segments again, and from then on always.
    #[must_use]
    pub const fn with_block_reads_from(self, len: u32) -> Self {
        SdoClient { block_reads_from: len, ..self }
    }

    /// Reads by block in blocks of `block_size` segments, 1 to 127: fewer for a receive queue that holds
    /// fewer. Numbers beyond become the nearest of these.
    #[must_use]
    pub const fn with_block_size(self, block_size: u8) -> Self {
        let block_size = sdo_block::nearest_block_size(block_size);
        SdoClient { block_size, ..self }
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

    /// Begins to read an entry.
    #[inline]
    pub fn read(&mut self, now: Instant, address: Address) -> Result<(), Busy> {
        self.begin(now, State::Upload(Upload::new(address)))
    }

    /// Begins to read an entry by block, which is quicker for more than some 20 bytes. A server that knows no
    /// blocks is asked for segments instead.
    pub fn read_block(&mut self, now: Instant, address: Address) -> Result<(), Busy> {
        if self.blocks == Blocks::Unknown {
            return self.read(now, address);
        }
        self.begin(now, State::BlockUpload(BlockUpload::new(address, self.block_size)))
    }

    /// Begins to write the first `len` bytes of the payload into an entry.
    #[inline]
    pub fn write(&mut self, now: Instant, address: Address, len: u32) -> Result<(), Busy> {
        if is_from(len, self.block_writes_from) && len > 4 && self.blocks != Blocks::Unknown {
            return self.begin(now, State::BlockDownload(BlockDownload::new(address, len)));
        }
        self.begin(now, State::Download(Download::new(address, len)))
    }

    /// Gives up the transfer under way, and sends the server an abort. No event follows.
    pub fn abort(&mut self, code: AbortCode) {
        if let Some(address) = self.address() {
            self.end(Some(Abort { address, code }));
        }
    }

    /// Takes a frame. Frames of other identifiers, remote frames, frames of other than eight bytes and
    /// answers for other entries are ignored.
    #[inline]
    pub fn handle_frame(&mut self, now: Instant, frame: &Frame, payload: &mut dyn Payload) -> Option<Event> {
        if frame.id() != self.response {
            return None;
        }
        self.handle_response(now, Raw::parse(frame.data())?, payload)
    }

    /// Gives up a transfer whose server has been silent for too long; in a block read, first asks it to go
    /// on.
    pub fn handle_timeout(&mut self, now: Instant) -> Option<Event> {
        let address = self.address().filter(|_| now >= self.deadline)?;
        if let State::Failed(error) = self.state {
            self.end(None);
            return Some(Event::Failed(error));
        }
        if now >= self.limit() {
            return Some(self.fail(address, Failure::Stalled));
        }
        if !self.unsent && !self.is_begun() && self.go_on_without_blocks(now, None) {
            return None;
        }
        if let State::BlockUpload(upload) = &mut self.state
            && !self.unsent
            && upload.confirm_after_silence()
        {
            self.unsent = true;
            self.await_server(now);
            return None;
        }
        Some(self.fail(address, Failure::TimedOut))
    }

    /// Whether [`SdoClient::poll_transmit`] has a frame.
    pub(crate) const fn has_outgoing(&self) -> bool {
        self.unsent || self.parting.is_some()
    }

    /// The next frame to be sent.
    #[inline(always)]
    pub fn poll_transmit(&mut self, now: Instant, payload: &mut dyn Payload) -> Option<Frame> {
        let raw = self.next(now, payload)?;
        Some(Frame::from_array(self.request, raw.to_bytes()))
    }

    /// When to call [`SdoClient::handle_timeout`]. Changes with every frame, in or out.
    #[must_use]
    pub const fn poll_timeout(&self) -> Option<Instant> {
        if self.is_busy() { Some(self.deadline) } else { None }
    }

    fn begin(&mut self, now: Instant, state: State) -> Result<(), Busy> {
        if let Some(address) = self.address() {
            return Err(Busy { address });
        }
        self.state = state;
        self.unsent = true;
        self.taken = NOTHING;
        if self.blocks == Blocks::Doubtful {
            self.blocks = Blocks::Possible;
        }
        self.began = now;
        self.deadline = now + self.timeout;
        Ok(())
    }

    /// What is to be sent next. It comes in a register; the frame is put together where it is wanted.
    fn next(&mut self, now: Instant, payload: &mut dyn Payload) -> Option<Raw> {
        match self.parting.take() {
            None if self.unsent => self.next_request(now, payload),
            parting => parting,
        }
    }

    #[inline]
    fn next_request(&mut self, now: Instant, payload: &mut dyn Payload) -> Option<Raw> {
        let request = match &mut self.state {
            State::Upload(upload) => Ok(upload.request()),
            State::Download(download) => download.request(self.always_four_bytes, payload),
            State::BlockUpload(upload) => Ok(upload.request()),
            State::BlockDownload(download) => download.request(payload),
            State::Idle | State::Failed(_) => return None,
        };
        self.unsent = matches!(&self.state, State::BlockDownload(download) if download.is_sending());
        self.await_server(now);
        match request {
            Ok(request) => Some(request),
            Err(failure) => self.fail_later(now, failure),
        }
    }

    fn handle_response(&mut self, now: Instant, raw: Raw, payload: &mut dyn Payload) -> Option<Event> {
        let address = self.address()?;
        if let State::BlockUpload(upload) = &mut self.state
            && let Some(segment) = upload.parse(raw)
        {
            let taken = upload.take(&segment, payload);
            return self.proceed(now, address, taken);
        }
        if let Some(abort) = raw.abort() {
            return self.handle_abort(now, address, abort);
        }
        // What comes before the request was sent is an answer to another one, or a repetition.
        if self.unsent && !matches!(self.state, State::BlockDownload(_)) || raw == self.taken {
            return None;
        }
        let outcome = match &mut self.state {
            State::Upload(upload) => upload.handle(raw, payload),
            State::Download(download) => download.handle(raw),
            State::BlockUpload(upload) => upload.handle(raw, payload),
            State::BlockDownload(download) => download.handle(raw),
            State::Idle | State::Failed(_) => return None,
        };
        // Segments alternate, so the same answer twice is one answer. Blocks do not.
        if matches!(self.state, State::Upload(_) | State::Download(_)) && !matches!(outcome, Ok(Progress::Ignored)) {
            self.taken = raw;
        }
        self.proceed(now, address, outcome)
    }

    /// Does what a response leads to.
    #[inline]
    fn proceed(&mut self, now: Instant, address: Address, outcome: Result<Progress, Failure>) -> Option<Event> {
        match outcome {
            Ok(Progress::Ignored) => return None,
            Ok(Progress::Awaited) => {}
            Ok(Progress::Continue) => self.unsent = true,
            Ok(Progress::Segmented { announced }) => match &self.state {
                State::BlockDownload(download) => self.resume(State::Download(download.begun_without_blocks())),
                State::Upload(_) if self.is_read_by_block(announced) => {
                    self.parting = Some(ClientRequest::Abort(Abort { address, code: AbortCode::GENERAL }).to_raw());
                    // The server may insist on segments, with the same answer.
                    self.taken = NOTHING;
                    self.resume(State::BlockUpload(BlockUpload::instead(address, self.block_size)));
                }
                _ => self.resume(State::Upload(Upload::begun(address, announced))),
            },
            Ok(Progress::Done { len }) => {
                if self.blocks == Blocks::Doubtful {
                    self.blocks = Blocks::Unknown;
                }
                self.end(None);
                return Some(Event::Done { address, len });
            }
            Ok(Progress::BlockUploadDone { len }) => {
                self.end(None);
                self.parting = Some(ClientRequest::EndBlockUpload.to_raw());
                return Some(Event::Done { address, len });
            }
            Err(failure) => return Some(self.fail(address, failure)),
        }
        self.await_server(now);
        None
    }

    /// Goes on in another way.
    fn resume(&mut self, state: State) {
        self.state = state;
        self.unsent = true;
    }

    fn is_read_by_block(&self, announced: Option<u32>) -> bool {
        self.blocks == Blocks::Possible && announced.is_some_and(|len| is_from(len, self.block_reads_from))
    }

    /// Asks for segments where the server does not begin a block transfer: it is silent, or aborts with `code`. Some
    /// servers are silent to a command that they do not know.
    fn go_on_without_blocks(&mut self, now: Instant, code: Option<AbortCode>) -> bool {
        let is_unknown = code == Some(AbortCode::UNKNOWN_COMMAND);
        let state = match &self.state {
            State::BlockUpload(upload) if is_unknown || upload.is_instead() => State::Upload(upload.segmented()),
            State::BlockDownload(download) if is_unknown || code.is_none() => State::Download(download.segmented()),
            _ => return false,
        };
        self.blocks = Blocks::Doubtful;
        // The answer may be the one before blocks were tried.
        self.taken = NOTHING;
        self.resume(state);
        self.await_server(now);
        true
    }

    #[inline]
    fn await_server(&mut self, now: Instant) {
        let patience = match &self.state {
            State::BlockUpload(upload) if upload.is_begun() => sdo_block::silence(self.timeout),
            _ => self.timeout,
        };
        self.deadline = (now + patience).min(self.limit());
    }

    /// When a transfer that is not over has stalled. Ten times the time-out is what a block transfer may need to
    /// recover from the loss of 16 blocks in a row.
    #[inline]
    fn limit(&self) -> Instant {
        let transferred = match &self.state {
            State::Upload(upload) => upload.offset(),
            State::Download(download) => download.offset(),
            State::BlockUpload(upload) => upload.offset(),
            State::BlockDownload(download) => download.offset(),
            State::Idle | State::Failed(_) => 0,
        };
        let for_each_byte = Duration::from_micros(self.timeout.as_micros() / 64);
        self.began + self.timeout.times(10) + for_each_byte.times(transferred)
    }

    /// An abort for another entry belongs to a transfer that is over here. A server that does not know
    /// which transfer it aborts names `0000:00`; but after a request that begins one, it does know.
    fn handle_abort(&mut self, now: Instant, address: Address, abort: Abort) -> Option<Event> {
        let is_begun = self.is_begun();
        let concerns_us = abort.address == address || is_begun && abort.address == Address::new(0, 0);
        if !concerns_us || self.unsent && !is_begun {
            return None;
        }
        if matches!(self.state, State::Failed(_)) {
            return None;
        }
        if !is_begun && self.go_on_without_blocks(now, Some(abort.code)) {
            return None;
        }
        self.end(None);
        Some(Event::Failed(SdoError::Aborted { address, code: abort.code }))
    }

    /// Ends the transfer with an abort.
    #[cold]
    fn fail(&mut self, address: Address, failure: Failure) -> Event {
        let (abort, error) = self.explain(address, failure);
        self.end(abort);
        Event::Failed(error)
    }

    /// Sending does not give events: the failure is reported by a deadline that has come.
    #[cold]
    fn fail_later(&mut self, now: Instant, failure: Failure) -> Option<Raw> {
        let (abort, error) = self.explain(self.address()?, failure);
        self.state = State::Failed(error);
        self.unsent = false;
        self.deadline = now;
        Some(ClientRequest::Abort(abort?).to_raw())
    }

    /// The abort for the server, and the error for the user.
    fn explain(&self, address: Address, failure: Failure) -> (Option<Abort>, SdoError) {
        let abort = |code| Some(Abort { address, code });
        // In an expedited transfer nothing is under way at the server, so there is nothing to abort.
        let abort_segments = |code| abort(code).filter(|_| self.is_begun());
        match failure {
            Failure::TimedOut => (abort(AbortCode::TIMED_OUT), SdoError::TimedOut { address }),
            Failure::Stalled => (abort(AbortCode::TIMED_OUT), SdoError::Stalled { address }),
            Failure::Violation(code) => (abort(code), SdoError::Violation { address, code }),
            Failure::TooLong { capacity } => {
                (abort_segments(AbortCode::OUT_OF_MEMORY), SdoError::TooLong { address, capacity })
            }
            Failure::TooShort { len } => {
                (abort_segments(AbortCode::CANNOT_TRANSFER), SdoError::TooShort { address, len })
            }
        }
    }

    /// Whether the server has answered to the beginning of the transfer.
    fn is_begun(&self) -> bool {
        match &self.state {
            State::Upload(upload) => upload.is_begun(),
            State::Download(download) => download.is_begun(),
            State::BlockUpload(upload) => upload.is_begun(),
            State::BlockDownload(download) => download.is_begun(),
            State::Idle | State::Failed(_) => false,
        }
    }

    /// Ends the transfer. A server that was asked for nothing yet gets no abort.
    fn end(&mut self, abort: Option<Abort>) {
        let is_known = self.is_begun() || !self.unsent;
        if let Some(abort) = abort.filter(|_| is_known) {
            self.parting = Some(ClientRequest::Abort(abort).to_raw());
        }
        self.state = State::Idle;
        self.unsent = false;
    }

    /// The entry that is transferred.
    fn address(&self) -> Option<Address> {
        match &self.state {
            State::Idle => None,
            State::Upload(upload) => Some(upload.address()),
            State::Download(download) => Some(download.address()),
            State::BlockUpload(upload) => Some(upload.address()),
            State::BlockDownload(download) => Some(download.address()),
            State::Failed(error) => Some(error.address()),
        }
    }
}

/// Whether `len` bytes are as many as `from`, if that is a number: [`u32::MAX`] stands for none.
const fn is_from(len: u32, from: u32) -> bool {
    len >= from && from < u32::MAX
}
