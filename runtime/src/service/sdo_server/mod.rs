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
//! The dictionary is lent to each call, and is asked by offset. What is short is read at once, and written when
//! all of it has come: a value of a fixed size, and text and bytes for which the entry has room for at most 64.
//! Half of such a value is never visible. Longer data stream through the server, which does not keep them.
//!
//! A request is answered by one frame, which [`SdoServer::poll_transmit`] gives; the segments of a block upload
//! are read as they are pulled.

mod block;
mod entry;
mod segmented;

use self::block::{BlockDownload, BlockUpload};
use self::entry::{Sink, Source, Stage};
use self::segmented::{Download, Upload};
use crate::abort::AbortCode;
use crate::cia301::connection;
use crate::frame::Frame;
use crate::id::{CobId, NodeId};
use crate::object::{Address, ObjectDictionary};
use crate::service::choice::{Choice, With};
use crate::service::sdo_block;
use crate::time::{Duration, Instant};
use crate::wire::sdo::{Abort, ClientRequest, Content, Raw, ServerResponse};
use crate::wire::sdo_block::BlockSegment;

/// One SDO channel of a device, the side that serves.
///
/// `B` says whether it knows block transfers; without them it answers their requests with
/// [`AbortCode::UNKNOWN_COMMAND`].
#[derive(Clone, Debug)]
pub struct SdoServer<B: Choice = With> {
    request: CobId,
    response: CobId,
    timeout: Duration,
    sizes_indicated: SizesIndicated,
    padded_writes: bool,
    block_size: u8,
    state: State<B>,
    /// What was written so far, of an entry that is not longer.
    stage: Stage,
    /// The answer to the last request, until it is pulled.
    reply: Option<Raw>,
    /// When the client has waited too long; of no meaning in `Idle`.
    deadline: Instant,
}

/// Which answers to reads indicate how many bytes they have. An expedited one that does not has the command 42h.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SizesIndicated {
    /// Expedited ones of 1, 2, 3 and 4 bytes.
    pub expedited: [bool; 4],
    /// Those in segments and in blocks.
    pub longer: bool,
}

impl SizesIndicated {
    /// All of them, which is the rule.
    pub const ALL: SizesIndicated = SizesIndicated { expedited: [true; 4], longer: true };
    /// None of them.
    pub const NONE: SizesIndicated = SizesIndicated { expedited: [false; 4], longer: false };

    /// Whether an expedited answer of `len` bytes does.
    fn expedited(self, len: usize) -> bool {
        len.checked_sub(1).and_then(|at| self.expedited.get(at)).copied().unwrap_or(false)
    }
}

/// What happened to an entry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Event {
    /// A client has read the entry to its end.
    Read(Address),
    /// A client has written the entry, and the dictionary has taken all of it.
    Written(Address),
    /// A transfer failed or was refused. An entry of more than 64 bytes may have got a part of the data.
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
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Side {
    /// The side that reads and writes.
    Client,
    /// The side that owns the dictionary.
    Server,
}

#[derive(Clone, Copy, Debug)]
enum State<B: Choice> {
    Idle,
    Upload(Upload),
    Download(Download),
    BlockUpload(B::Part<BlockUpload>),
    BlockDownload(B::Part<BlockDownload>),
    /// The dictionary failed while segments were sent; the abort is still to be reported.
    Failed(Abort),
}

/// What a request did to a transfer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Progress {
    /// It is under way.
    Continues,
    /// It was a read, and is complete.
    Read,
    /// It was a write, and is complete.
    Written,
}

impl SdoServer {
    /// A server that listens to `request` and answers with `response`. A transfer times out after 1 s
    /// without a frame of the client.
    #[must_use]
    pub const fn new(request: CobId, response: CobId) -> Self {
        SdoServer::of_channel(request, response)
    }

    /// The default server of a node (1200h): 600h + node-ID, answered with 580h + node-ID.
    #[must_use]
    pub const fn of_node(node: NodeId) -> Self {
        let (request, response) = default_channel(node);
        SdoServer::new(request, response)
    }
}

/// The identifiers of requests and answers of a node's default server.
pub(crate) const fn default_channel(node: NodeId) -> (CobId, CobId) {
    (CobId::of_node(connection::SDO_REQUEST, node), CobId::of_node(connection::SDO_RESPONSE, node))
}

impl<B: Choice> SdoServer<B> {
    /// As [`SdoServer::new`], with or without block transfers: `SdoServer::<Without>::of_channel(request, response)`.
    #[must_use]
    pub const fn of_channel(request: CobId, response: CobId) -> Self {
        SdoServer {
            request,
            response,
            timeout: Duration::from_secs(1),
            sizes_indicated: SizesIndicated::ALL,
            padded_writes: false,
            block_size: BlockSegment::MAX_SEQUENCE,
            state: State::Idle,
            stage: Stage::EMPTY,
            reply: None,
            deadline: Instant::ZERO,
        }
    }

    /// Gives a transfer up after `timeout` without a frame of the client.
    #[must_use]
    pub const fn with_timeout(self, timeout: Duration) -> Self {
        SdoServer { timeout, ..self }
    }

    /// Indicates the number of bytes in these answers to reads only; without it, in all of them.
    #[must_use]
    pub const fn with_sizes_indicated(self, sizes_indicated: SizesIndicated) -> Self {
        SdoServer { sizes_indicated, ..self }
    }

    /// Whether a smaller value may be written as four bytes, of which the low ones count; otherwise that is an
    /// [`AbortCode::LENGTH_TOO_HIGH`], as CiA 301 has it. Some clients always write four bytes.
    #[must_use]
    pub const fn with_padded_writes(self, padded_writes: bool) -> Self {
        SdoServer { padded_writes, ..self }
    }

    /// Takes block downloads in blocks of `block_size` segments, 1 to 127: fewer for a receive queue that
    /// holds fewer. Numbers beyond become the nearest of these.
    #[must_use]
    pub const fn with_block_size(self, block_size: u8) -> Self {
        let block_size = sdo_block::nearest_block_size(block_size);
        SdoServer { block_size, ..self }
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

    /// The entry whose transfer is under way.
    #[must_use]
    pub fn transfers(&self) -> Option<Address> {
        self.is_busy().then(|| self.address())
    }

    /// Whether [`SdoServer::poll_transmit`] has an answer to give.
    #[must_use]
    pub const fn has_answer(&self) -> bool {
        self.reply.is_some()
    }

    /// Forgets the transfer under way, without a frame: for a reset of the communication.
    pub fn reset(&mut self) {
        self.state = State::Idle;
        self.reply = None;
    }

    /// Takes a frame. Frames of other identifiers, remote frames and frames of other than eight bytes are
    /// not for an SDO server, and ignored.
    #[inline]
    pub fn handle_frame(
        &mut self,
        now: Instant,
        frame: &Frame,
        od: &mut (impl ObjectDictionary + ?Sized),
    ) -> Option<Event> {
        if frame.id() != self.request {
            return None;
        }
        self.handle_request(now, Raw::parse(frame.data())?, od)
    }

    /// Gives up a transfer whose client has been silent for too long; in a block download, first asks it to
    /// go on.
    pub fn handle_timeout(&mut self, now: Instant) -> Option<Event> {
        if !self.is_busy() || now < self.deadline {
            return None;
        }
        if let State::Failed(Abort { address, code }) = self.state {
            self.state = State::Idle;
            return Some(aborted(address, code, Side::Server));
        }
        if let State::BlockDownload(download) = &mut self.state
            && let Some(confirmation) = download.confirm_after_silence()
        {
            self.await_client(now);
            self.answer(ServerResponse::ConfirmBlockDownload(confirmation));
            return None;
        }
        Some(self.abort(self.address(), AbortCode::TIMED_OUT))
    }

    /// The next frame to be sent. An error of the dictionary in the midst of a block is sent at once, and
    /// reported by the next [`SdoServer::handle_timeout`], which is due at once.
    #[inline]
    pub fn poll_transmit(&mut self, now: Instant, od: &mut (impl ObjectDictionary + ?Sized)) -> Option<Frame> {
        let raw = self.reply.take().or_else(|| self.next_segment(now, od))?;
        Some(Frame::from_array(self.response, raw.to_bytes()))
    }

    /// When to call [`SdoServer::handle_timeout`]. Changes with every frame, in or out.
    #[must_use]
    pub const fn poll_timeout(&self) -> Option<Instant> {
        if self.is_busy() { Some(self.deadline) } else { None }
    }

    fn handle_request(&mut self, now: Instant, raw: Raw, od: &mut (impl ObjectDictionary + ?Sized)) -> Option<Event> {
        let event = match self.handle_segment(raw, od) {
            Some(Ok(Progress::Continues)) => None,
            Some(outcome) => self.conclude(self.address(), outcome),
            None => self.handle_command(raw, od),
        };
        self.await_client(now);
        event
    }

    /// Goes on with a segment, or the request for one; `None` if the frame is something else. Those of a block are no
    /// commands; the others come before commands since most frames of a long transfer are segments (README: SDO write
    /// of 32 bytes in segments).
    #[inline]
    fn handle_segment(
        &mut self,
        raw: Raw,
        od: &mut (impl ObjectDictionary + ?Sized),
    ) -> Option<Result<Progress, AbortCode>> {
        let (progress, answer) = match &mut self.state {
            State::Upload(upload) => match upload.segment(raw.upload_segment()?, od) {
                Ok(segment) if segment.last => (Progress::Read, ServerResponse::UploadSegment(segment).to_raw()),
                Ok(segment) => (Progress::Continues, ServerResponse::UploadSegment(segment).to_raw()),
                Err(code) => return Some(Err(code)),
            },
            State::Download(download) => {
                let segment = raw.segment()?;
                if let Err(code) = download.take(&segment, &mut self.stage, od) {
                    return Some(Err(code));
                }
                let progress = if segment.last { Progress::Written } else { Progress::Continues };
                (progress, ServerResponse::DownloadSegment { toggle: segment.toggle }.to_raw())
            }
            State::BlockDownload(download) => {
                let segment = download.parse(raw)?;
                match download.take(&segment, &mut self.stage, od) {
                    Ok(Some(confirmation)) => {
                        (Progress::Continues, ServerResponse::ConfirmBlockDownload(confirmation).to_raw())
                    }
                    Ok(None) => return Some(Ok(Progress::Continues)),
                    Err(code) => return Some(Err(code)),
                }
            }
            _ => return None,
        };
        self.reply = Some(answer);
        Some(Ok(progress))
    }

    fn handle_command(&mut self, raw: Raw, od: &mut (impl ObjectDictionary + ?Sized)) -> Option<Event> {
        let before = self.is_busy().then(|| self.address());
        // One match for all: several would each go through the commands again (tests/size).
        let outcome = match (ClientRequest::from_raw(raw), &mut self.state) {
            (Some(ClientRequest::Abort(Abort { code, .. })), _) => {
                let address = before?;
                self.reset();
                return Some(aborted(address, code, Side::Client));
            }
            (Some(ClientRequest::StartBlockUpload), State::BlockUpload(upload)) => {
                upload.start().map(|()| Progress::Continues)
            }
            (Some(ClientRequest::ConfirmBlockUpload(confirmation)), State::BlockUpload(upload)) => {
                let answer = upload.confirm(confirmation);
                if let Ok(Some(block_end)) = answer {
                    self.answer(ServerResponse::EndBlockUpload(block_end));
                }
                answer.map(|_| Progress::Continues)
            }
            (Some(ClientRequest::EndBlockUpload), State::BlockUpload(upload)) if upload.is_ending() => {
                Ok(Progress::Read)
            }
            (Some(ClientRequest::EndBlockDownload(block_end)), State::BlockDownload(download)) => {
                let outcome = download.finish(block_end, &mut self.stage, od);
                if outcome.is_ok() {
                    self.answer(ServerResponse::EndBlockDownload);
                }
                outcome.map(|()| Progress::Written)
            }
            (Some(request), _) => match request.initiates() {
                Some(address) => {
                    let outcome = self.initiate(request, od);
                    // A client that begins another transfer has given up the one under way.
                    let event = self.conclude(address, outcome);
                    return event.or_else(|| before.map(|before| aborted(before, AbortCode::GENERAL, Side::Client)));
                }
                None => Err(AbortCode::UNKNOWN_COMMAND),
            },
            (None, _) => return Some(self.abort(before.unwrap_or(raw.address()), AbortCode::UNKNOWN_COMMAND)),
        };
        self.conclude(self.address(), outcome)
    }

    /// Begins a transfer; an expedited one is complete with it.
    fn initiate(
        &mut self,
        request: ClientRequest,
        od: &mut (impl ObjectDictionary + ?Sized),
    ) -> Result<Progress, AbortCode> {
        match request {
            ClientRequest::InitiateUpload { address } => {
                let source = Source::open(address, od)?;
                Ok(self.upload(source, od))
            }
            ClientRequest::InitiateDownload { address, content: Content::Expedited(data) } => {
                entry::write_expedited(address, data, self.padded_writes, od)?;
                self.answer(ServerResponse::InitiateDownload { address });
                Ok(Progress::Written)
            }
            ClientRequest::InitiateDownload { address, content: Content::Segmented { size } } => {
                let download = Download::new(Sink::open(address, size, od)?);
                Ok(self.begin(State::Download(download), ServerResponse::InitiateDownload { address }.to_raw()))
            }
            ClientRequest::InitiateBlockUpload { address, crc, block_size, switch_threshold } => {
                let source = Source::open(address, od)?;
                let size = source.size(od);
                if switch_threshold > 0 && size.is_some_and(|size| size <= u32::from(switch_threshold)) {
                    return Ok(self.upload(source, od));
                }
                let upload = B::part(BlockUpload::new(source, block_size, crc)?).ok_or(AbortCode::UNKNOWN_COMMAND)?;
                let size = size.filter(|_| self.sizes_indicated.longer);
                let answer = ServerResponse::InitiateBlockUpload { address, crc: true, size };
                Ok(self.begin(State::BlockUpload(upload), answer.to_raw()))
            }
            ClientRequest::InitiateBlockDownload { address, crc, size } => {
                let block_size = self.block_size;
                let download = BlockDownload::new(Sink::open(address, size, od)?, block_size, crc, size);
                let download = B::part(download).ok_or(AbortCode::UNKNOWN_COMMAND)?;
                let answer = ServerResponse::InitiateBlockDownload { address, crc: true, block_size };
                Ok(self.begin(State::BlockDownload(download), answer.to_raw()))
            }
            _ => Err(AbortCode::UNKNOWN_COMMAND),
        }
    }

    fn begin(&mut self, state: State<B>, answer: Raw) -> Progress {
        self.state = state;
        self.reply = Some(answer);
        Progress::Continues
    }

    /// Answers a read without blocks: with the data, if it fits into one frame, and else with segments.
    fn upload(&mut self, source: Source, od: &mut (impl ObjectDictionary + ?Sized)) -> Progress {
        let address = source.address();
        if let Some(data) = source.expedited() {
            let indicated = data.len().is_some_and(|len| self.sizes_indicated.expedited(len));
            let data = if indicated { data } else { data.without_len() };
            self.answer(ServerResponse::InitiateUpload { address, content: Content::Expedited(data) });
            return Progress::Read;
        }
        let size = if self.sizes_indicated.longer { source.size(od) } else { None };
        let answer = ServerResponse::InitiateUpload { address, content: Content::Segmented { size } };
        self.begin(State::Upload(Upload::new(source)), answer.to_raw())
    }

    /// Ends the transfer, if that is the outcome.
    fn conclude(&mut self, address: Address, outcome: Result<Progress, AbortCode>) -> Option<Event> {
        let event = match outcome {
            Ok(Progress::Continues) => return None,
            Ok(Progress::Read) => Event::Read(address),
            Ok(Progress::Written) => Event::Written(address),
            Err(code) => return Some(self.abort(address, code)),
        };
        self.state = State::Idle;
        Some(event)
    }

    /// The next segment of a block upload.
    fn next_segment(&mut self, now: Instant, od: &mut (impl ObjectDictionary + ?Sized)) -> Option<Raw> {
        let State::BlockUpload(upload) = &mut self.state else { return None };
        match upload.segment(od)? {
            Ok(segment) => {
                self.await_client(now);
                Some(segment.to_raw())
            }
            Err(code) => {
                let abort = Abort { address: upload.address(), code };
                self.state = State::Failed(abort);
                self.deadline = now;
                Some(ServerResponse::Abort(abort).to_raw())
            }
        }
    }

    #[inline]
    fn await_client(&mut self, now: Instant) {
        let patience = match self.state {
            State::BlockDownload(..) => sdo_block::silence(self.timeout),
            _ => self.timeout,
        };
        self.deadline = now + patience;
    }

    // Always inlined, as `to_raw` is: out of line, the match on the response would be there whole.
    #[inline(always)]
    fn answer(&mut self, response: ServerResponse) {
        self.reply = Some(response.to_raw());
    }

    /// Ends the transfer, and sends the abort.
    fn abort(&mut self, address: Address, code: AbortCode) -> Event {
        self.state = State::Idle;
        self.answer(ServerResponse::Abort(Abort { address, code }));
        aborted(address, code, Side::Server)
    }

    /// The entry that is transferred; `0000:00` when there is none.
    fn address(&self) -> Address {
        match &self.state {
            State::Idle => Address::new(0, 0),
            State::Upload(upload) => upload.address(),
            State::Download(download) => download.address(),
            State::BlockUpload(upload) => upload.address(),
            State::BlockDownload(download) => download.address(),
            State::Failed(abort) => abort.address,
        }
    }
}

const fn aborted(address: Address, code: AbortCode, by: Side) -> Event {
    Event::Aborted { address, code, by }
}
