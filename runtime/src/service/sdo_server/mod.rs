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
mod transfer;

use self::block::BlockUpload;
use self::transfer::{Transfer, write_expedited};
use crate::abort::AbortCode;
use crate::cia301::connection;
use crate::frame::Frame;
use crate::id::{CobId, NodeId};
use crate::object::{Address, ObjectDictionary};
use crate::service::choice::{Choice, With};
use crate::service::sdo_block::{self, Receiver};
use crate::time::{Duration, Instant};
use crate::wire::sdo::{Abort, ClientRequest, Content, Raw, Segment, ServerResponse};
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
    /// Of no meaning in `Idle`.
    transfer: Transfer,
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
    Upload,
    Download,
    BlockUpload(B::Part<BlockUpload>),
    BlockDownload(B::Part<Receiver>),
    /// The dictionary failed while segments were sent; the abort is still to be reported.
    Failed(AbortCode),
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
            transfer: Transfer::none(),
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
        let address = self.transfer.address();
        match &mut self.state {
            State::Failed(code) => {
                let code = *code;
                self.state = State::Idle;
                return Some(aborted(address, code, Side::Server));
            }
            State::BlockDownload(receiver) => {
                if let Some(confirmation) = receiver.confirm_after_silence() {
                    self.answer(ServerResponse::ConfirmBlockDownload(confirmation));
                    self.await_client(now);
                    return None;
                }
            }
            _ => {}
        }
        Some(self.abort(address, AbortCode::TIMED_OUT))
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
        match &mut self.state {
            State::Upload => Some(self.upload_segment(raw.upload_segment()?, od)),
            State::Download => Some(self.download_segment(&raw.segment()?, od)),
            State::BlockDownload(receiver) => {
                let segment = receiver.parse(raw)?;
                Some(self.block_segment(&segment, od))
            }
            _ => None,
        }
    }

    #[inline]
    fn upload_segment(
        &mut self,
        toggle: bool,
        od: &mut (impl ObjectDictionary + ?Sized),
    ) -> Result<Progress, AbortCode> {
        self.transfer.turn(toggle)?;
        let piece = self.transfer.read_next(od)?;
        self.answer(ServerResponse::UploadSegment(Segment::of_buffer(toggle, piece.bytes, piece.len, piece.last)));
        Ok(if piece.last { Progress::Read } else { Progress::Continues })
    }

    #[inline]
    fn download_segment(
        &mut self,
        segment: &Segment,
        od: &mut (impl ObjectDictionary + ?Sized),
    ) -> Result<Progress, AbortCode> {
        self.transfer.turn(segment.toggle)?;
        self.transfer.write(segment.data(), segment.last, od)?;
        self.answer(ServerResponse::DownloadSegment { toggle: segment.toggle });
        Ok(if segment.last { Progress::Written } else { Progress::Continues })
    }

    /// A segment of a block download. The last one is written when the client has said how many of its bytes count.
    #[inline]
    fn block_segment(
        &mut self,
        segment: &BlockSegment,
        od: &mut (impl ObjectDictionary + ?Sized),
    ) -> Result<Progress, AbortCode> {
        let State::BlockDownload(receiver) = &mut self.state else { return Ok(Progress::Continues) };
        let received = receiver.take(segment)?;
        if received.is_next {
            self.transfer.write(segment.data(), false, od)?;
        }
        if received.ends_block {
            let confirmation = receiver.confirm();
            self.answer(ServerResponse::ConfirmBlockDownload(confirmation));
        }
        Ok(Progress::Continues)
    }

    // Out of line on a microcontroller, where a function with everything in it has too few registers.
    #[cfg_attr(target_pointer_width = "32", inline(never))]
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
            (Some(ClientRequest::EndBlockDownload(block_end)), State::BlockDownload(receiver)) => {
                let outcome = receiver.finish(block_end).and_then(|(segment, len)| {
                    self.transfer.write(segment.data().get(..len).unwrap_or(segment.data()), true, od)
                });
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
                self.transfer.open_upload(address, od)?;
                Ok(self.upload(od))
            }
            ClientRequest::InitiateDownload { address, content: Content::Expedited(data) } => {
                write_expedited(address, data, self.padded_writes, od)?;
                self.answer(ServerResponse::InitiateDownload { address });
                Ok(Progress::Written)
            }
            ClientRequest::InitiateDownload { address, content: Content::Segmented { size } } => {
                self.transfer.open_download(address, size, od)?;
                self.state = State::Download;
                self.answer(ServerResponse::InitiateDownload { address });
                Ok(Progress::Continues)
            }
            ClientRequest::InitiateBlockUpload { address, crc, block_size, switch_threshold } => {
                self.transfer.open_upload(address, od)?;
                let size = self.transfer.size(od);
                if switch_threshold > 0 && size.is_some_and(|size| size <= u32::from(switch_threshold)) {
                    return Ok(self.upload(od));
                }
                let upload = B::part(BlockUpload::new(block_size, crc)?).ok_or(AbortCode::UNKNOWN_COMMAND)?;
                self.state = State::BlockUpload(upload);
                let size = size.filter(|_| self.sizes_indicated.longer);
                self.answer(ServerResponse::InitiateBlockUpload { address, crc: true, size });
                Ok(Progress::Continues)
            }
            ClientRequest::InitiateBlockDownload { address, crc, size } => {
                let block_size = self.block_size;
                self.transfer.open_download(address, size, od)?;
                let receiver = B::part(Receiver::new(block_size, crc, size)).ok_or(AbortCode::UNKNOWN_COMMAND)?;
                self.state = State::BlockDownload(receiver);
                self.answer(ServerResponse::InitiateBlockDownload { address, crc: true, block_size });
                Ok(Progress::Continues)
            }
            _ => Err(AbortCode::UNKNOWN_COMMAND),
        }
    }

    /// Answers a read without blocks: with the data, if it fits into one frame, and else with segments.
    fn upload(&mut self, od: &mut (impl ObjectDictionary + ?Sized)) -> Progress {
        let address = self.transfer.address();
        if let Some(data) = self.transfer.expedited() {
            let indicated = data.len().is_some_and(|len| self.sizes_indicated.expedited(len));
            let data = if indicated { data } else { data.without_len() };
            self.answer(ServerResponse::InitiateUpload { address, content: Content::Expedited(data) });
            return Progress::Read;
        }
        let size = if self.sizes_indicated.longer { self.transfer.size(od) } else { None };
        self.state = State::Upload;
        self.answer(ServerResponse::InitiateUpload { address, content: Content::Segmented { size } });
        Progress::Continues
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
        if !upload.is_due() {
            return None;
        }
        match upload.segment(&self.transfer, od) {
            Ok(segment) => {
                self.await_client(now);
                Some(segment.to_raw())
            }
            Err(code) => {
                self.state = State::Failed(code);
                self.deadline = now;
                Some(ServerResponse::Abort(Abort { address: self.transfer.address(), code }).to_raw())
            }
        }
    }

    #[inline]
    fn await_client(&mut self, now: Instant) {
        let patience = match self.state {
            State::Idle => return,
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
        if self.is_busy() { self.transfer.address() } else { Address::new(0, 0) }
    }
}

const fn aborted(address: Address, code: AbortCode, by: Side) -> Event {
    Event::Aborted { address, code, by }
}
