//! SDO commands (CiA 301, 7.2.4.3): eight bytes to meaning and back.
//!
//! The upper three bits of the first byte are the command specifier; what the other bits mean depends
//! on it. The same specifier means different things in a request and in a response, so there are two
//! types. Frames of a block transfer's data have no specifier at all: see [`super::sdo_block`].
//!
//! Bits that the standard reserves are ignored when parsed and zero when emitted, so that
//! `parse(to_bytes(x)) == x` for every `x`, but not the other way round.

use crate::abort::AbortCode;
use crate::object::Address;

/// What a client asks of a server.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ClientRequest {
    /// Download SDO segment (7.2.4.3.4).
    DownloadSegment(Segment),
    /// Initiate SDO download (7.2.4.3.3): the start of a write.
    InitiateDownload {
        /// The entry to be written.
        address: Address,
        /// The data, or how much of it will follow.
        content: Content,
    },
    /// Initiate SDO upload (7.2.4.3.6): the start of a read.
    InitiateUpload {
        /// The entry to be read.
        address: Address,
    },
    /// Upload SDO segment (7.2.4.3.7).
    UploadSegment {
        /// Alternates, beginning with `false`.
        toggle: bool,
    },
    /// Abort SDO transfer (7.2.4.3.17).
    Abort(Abort),
    /// Initiate SDO block upload (7.2.4.3.13).
    InitiateBlockUpload {
        /// The entry to be read.
        address: Address,
        /// Whether the client can compute the CRC.
        crc: bool,
        /// Segments per block, 1 to 127 if the client keeps to the standard.
        block_size: u8,
        /// Up to how many bytes the server may answer with a transfer that is not by block; 0 for never.
        switch_threshold: u8,
    },
    /// The client is ready for the first block (7.2.4.3.13).
    StartBlockUpload,
    /// A block arrived, wholly or in part (7.2.4.3.14).
    ConfirmBlockUpload(Confirmation),
    /// End SDO block upload (7.2.4.3.15), the response to the server's.
    EndBlockUpload,
    /// Initiate SDO block download (7.2.4.3.9).
    InitiateBlockDownload {
        /// The entry to be written.
        address: Address,
        /// Whether the client can compute the CRC.
        crc: bool,
        /// The number of bytes, if the client tells.
        size: Option<u32>,
    },
    /// End SDO block download (7.2.4.3.11).
    EndBlockDownload(BlockEnd),
}

/// What a server answers to a client.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ServerResponse {
    /// Upload SDO segment (7.2.4.3.7).
    UploadSegment(Segment),
    /// Download SDO segment (7.2.4.3.4): the segment was taken.
    DownloadSegment {
        /// As in the request.
        toggle: bool,
    },
    /// Initiate SDO upload (7.2.4.3.6).
    InitiateUpload {
        /// The entry that is read.
        address: Address,
        /// The data, or how much of it will follow.
        content: Content,
    },
    /// Initiate SDO download (7.2.4.3.3): the write was begun, or done when it was expedited.
    InitiateDownload {
        /// The entry that is written.
        address: Address,
    },
    /// Abort SDO transfer (7.2.4.3.17).
    Abort(Abort),
    /// Initiate SDO block download (7.2.4.3.9).
    InitiateBlockDownload {
        /// The entry that is written.
        address: Address,
        /// Whether the server can compute the CRC.
        crc: bool,
        /// Segments per block, 1 to 127 if the server keeps to the standard.
        block_size: u8,
    },
    /// A block arrived, wholly or in part (7.2.4.3.10).
    ConfirmBlockDownload(Confirmation),
    /// End SDO block download (7.2.4.3.11): the data was taken.
    EndBlockDownload,
    /// Initiate SDO block upload (7.2.4.3.13).
    InitiateBlockUpload {
        /// The entry that is read.
        address: Address,
        /// Whether the server can compute the CRC.
        crc: bool,
        /// The number of bytes, if the server tells.
        size: Option<u32>,
    },
    /// End SDO block upload (7.2.4.3.15).
    EndBlockUpload(BlockEnd),
}

impl ClientRequest {
    /// `None` when these are not eight bytes, or when CiA 301 does not know the command.
    #[inline]
    #[must_use]
    pub fn parse(bytes: &[u8]) -> Option<Self> {
        let bytes: &[u8; 8] = bytes.try_into().ok()?;
        let [command, a, b, ..] = *bytes;
        Some(match command >> 5 {
            0 => ClientRequest::DownloadSegment(Segment::parse(bytes)),
            1 => ClientRequest::InitiateDownload { address: address(bytes), content: Content::parse(bytes) },
            2 => ClientRequest::InitiateUpload { address: address(bytes) },
            3 => ClientRequest::UploadSegment { toggle: command & TOGGLE != 0 },
            4 => ClientRequest::Abort(Abort::parse(bytes)),
            5 => match command & 0b11 {
                0 => {
                    let [block_size, switch_threshold, ..] = data(bytes);
                    let crc = command & CRC != 0;
                    ClientRequest::InitiateBlockUpload { address: address(bytes), crc, block_size, switch_threshold }
                }
                1 => ClientRequest::EndBlockUpload,
                2 => ClientRequest::ConfirmBlockUpload(Confirmation { sequence: a, block_size: b }),
                _ => ClientRequest::StartBlockUpload,
            },
            6 if command & END == 0 => {
                let size = (command & BLOCK_SIZED != 0).then(|| u32::from_le_bytes(data(bytes)));
                ClientRequest::InitiateBlockDownload { address: address(bytes), crc: command & CRC != 0, size }
            }
            6 => ClientRequest::EndBlockDownload(BlockEnd::parse(bytes)),
            _ => return None,
        })
    }

    /// The eight bytes of the frame.
    #[inline]
    #[must_use]
    pub fn to_bytes(&self) -> [u8; 8] {
        match *self {
            ClientRequest::DownloadSegment(segment) => segment.to_bytes(),
            ClientRequest::InitiateDownload { address, content } => content.to_bytes(1 << 5, address),
            ClientRequest::InitiateUpload { address } => compose(2 << 5, address, [0; 4]),
            ClientRequest::UploadSegment { toggle } => [3 << 5 | flag(toggle, TOGGLE), 0, 0, 0, 0, 0, 0, 0],
            ClientRequest::Abort(abort) => abort.to_bytes(),
            ClientRequest::InitiateBlockUpload { address, crc, block_size, switch_threshold } => {
                compose(5 << 5 | flag(crc, CRC), address, [block_size, switch_threshold, 0, 0])
            }
            ClientRequest::EndBlockUpload => [5 << 5 | 1, 0, 0, 0, 0, 0, 0, 0],
            ClientRequest::ConfirmBlockUpload(confirmation) => confirmation.to_bytes(),
            ClientRequest::StartBlockUpload => [5 << 5 | 3, 0, 0, 0, 0, 0, 0, 0],
            ClientRequest::InitiateBlockDownload { address, crc, size } => initiate_sized(address, crc, size),
            ClientRequest::EndBlockDownload(end) => end.to_bytes(),
        }
    }

    /// Whether this begins a transfer.
    #[inline]
    #[must_use]
    pub const fn is_initiate(&self) -> bool {
        matches!(
            self,
            ClientRequest::InitiateDownload { .. }
                | ClientRequest::InitiateUpload { .. }
                | ClientRequest::InitiateBlockUpload { .. }
                | ClientRequest::InitiateBlockDownload { .. }
        )
    }
}

impl ServerResponse {
    /// `None` when these are not eight bytes, or when CiA 301 does not know the command.
    #[inline]
    #[must_use]
    pub fn parse(bytes: &[u8]) -> Option<Self> {
        let bytes: &[u8; 8] = bytes.try_into().ok()?;
        let [command, a, b, ..] = *bytes;
        Some(match command >> 5 {
            0 => ServerResponse::UploadSegment(Segment::parse(bytes)),
            1 => ServerResponse::DownloadSegment { toggle: command & TOGGLE != 0 },
            2 => ServerResponse::InitiateUpload { address: address(bytes), content: Content::parse(bytes) },
            3 => ServerResponse::InitiateDownload { address: address(bytes) },
            4 => ServerResponse::Abort(Abort::parse(bytes)),
            5 => match command & 0b11 {
                0 => {
                    let [block_size, ..] = data(bytes);
                    let crc = command & CRC != 0;
                    ServerResponse::InitiateBlockDownload { address: address(bytes), crc, block_size }
                }
                1 => ServerResponse::EndBlockDownload,
                2 => ServerResponse::ConfirmBlockDownload(Confirmation { sequence: a, block_size: b }),
                _ => return None,
            },
            6 if command & END == 0 => {
                let size = (command & BLOCK_SIZED != 0).then(|| u32::from_le_bytes(data(bytes)));
                ServerResponse::InitiateBlockUpload { address: address(bytes), crc: command & CRC != 0, size }
            }
            6 => ServerResponse::EndBlockUpload(BlockEnd::parse(bytes)),
            _ => return None,
        })
    }

    /// The eight bytes of the frame.
    #[inline]
    #[must_use]
    pub fn to_bytes(&self) -> [u8; 8] {
        match *self {
            ServerResponse::UploadSegment(segment) => segment.to_bytes(),
            ServerResponse::DownloadSegment { toggle } => [1 << 5 | flag(toggle, TOGGLE), 0, 0, 0, 0, 0, 0, 0],
            ServerResponse::InitiateUpload { address, content } => content.to_bytes(2 << 5, address),
            ServerResponse::InitiateDownload { address } => compose(3 << 5, address, [0; 4]),
            ServerResponse::Abort(abort) => abort.to_bytes(),
            ServerResponse::InitiateBlockDownload { address, crc, block_size } => {
                compose(5 << 5 | flag(crc, CRC), address, [block_size, 0, 0, 0])
            }
            ServerResponse::EndBlockDownload => [5 << 5 | 1, 0, 0, 0, 0, 0, 0, 0],
            ServerResponse::ConfirmBlockDownload(confirmation) => confirmation.to_bytes(),
            ServerResponse::InitiateBlockUpload { address, crc, size } => initiate_sized(address, crc, size),
            ServerResponse::EndBlockUpload(end) => end.to_bytes(),
        }
    }
}

/// What an initiate frame carries beside the address: all of the data, or a notice of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Content {
    /// The data itself (e = 1).
    Expedited(Expedited),
    /// Segments will follow (e = 0).
    Segmented {
        /// The number of bytes, if it is told (s = 1).
        size: Option<u32>,
    },
}

impl Content {
    fn parse(bytes: &[u8; 8]) -> Self {
        let [command, ..] = *bytes;
        let sized = command & SIZED != 0;
        if command & EXPEDITED != 0 {
            let len = if sized { 4 - (command >> 2 & 0b11) } else { 0 };
            Content::Expedited(Expedited { len, data: masked(data(bytes), if sized { len } else { 4 }) })
        } else {
            Content::Segmented { size: sized.then(|| u32::from_le_bytes(data(bytes))) }
        }
    }

    fn to_bytes(self, specifier: u8, address: Address) -> [u8; 8] {
        match self {
            Content::Expedited(Expedited { len: 0, data }) => compose(specifier | EXPEDITED, address, data),
            Content::Expedited(Expedited { len, data }) => {
                compose(specifier | (4 - len) << 2 | EXPEDITED | SIZED, address, data)
            }
            Content::Segmented { size: None } => compose(specifier, address, [0; 4]),
            Content::Segmented { size: Some(size) } => compose(specifier | SIZED, address, size.to_le_bytes()),
        }
    }
}

/// One to four bytes, or four of which nobody says how many count (e = 1, s = 0).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Expedited {
    // 0: the number is not told. Bytes beyond `len` are zero.
    len: u8,
    data: [u8; 4],
}

impl Expedited {
    /// `None` unless there are one to four bytes.
    #[must_use]
    pub fn new(data: &[u8]) -> Option<Self> {
        let len = u8::try_from(data.len()).ok().filter(|len| (1..=4).contains(len))?;
        let mut bytes = [0; 4];
        bytes.iter_mut().zip(data).for_each(|(to, from)| *to = *from);
        Some(Expedited { len, data: bytes })
    }

    /// Four bytes without telling how many count.
    #[must_use]
    pub const fn of_unknown_len(data: [u8; 4]) -> Self {
        Expedited { len: 0, data }
    }

    /// How many bytes count, 1 to 4; `None` when it is not told.
    #[inline]
    #[must_use]
    pub const fn len(&self) -> Option<usize> {
        if self.len == 0 { None } else { Some(self.len as usize) }
    }

    /// Never: an expedited transfer has at least one byte.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        false
    }

    /// The bytes that count: all four when it is not told how many.
    #[inline]
    #[must_use]
    pub fn data(&self) -> &[u8] {
        self.data.get(..self.len().unwrap_or(4)).unwrap_or(&self.data)
    }
}

/// Up to seven bytes of a segmented transfer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Segment {
    /// Alternates, beginning with `false`.
    pub toggle: bool,
    /// Whether no segment follows (c = 1).
    pub last: bool,
    len: u8,
    // Bytes beyond `len` are zero.
    data: [u8; 7],
}

impl Segment {
    /// `None` when `data` is longer than seven bytes.
    #[must_use]
    pub fn new(toggle: bool, data: &[u8], last: bool) -> Option<Self> {
        let mut bytes = [0; 7];
        bytes.get_mut(..data.len())?.copy_from_slice(data);
        Some(Segment { toggle, last, len: data.len() as u8, data: bytes })
    }

    /// The first `len` of these bytes, at most seven.
    #[inline]
    pub(crate) fn of_buffer(toggle: bool, buffer: [u8; 8], len: usize, last: bool) -> Self {
        let len = len.min(7) as u8;
        let [data @ .., _] = (u64::from_le_bytes(buffer) & !(u64::MAX << (8 * len))).to_le_bytes();
        Segment { toggle, last, len, data }
    }

    /// The data.
    #[inline]
    #[must_use]
    pub fn data(&self) -> &[u8] {
        self.data.get(..usize::from(self.len)).unwrap_or(&self.data)
    }

    #[inline]
    fn parse(bytes: &[u8; 8]) -> Self {
        let [command, ..] = *bytes;
        let shifted = (u64::from_le_bytes(*bytes) >> 8).to_le_bytes();
        let len = usize::from(7 - (command >> 1 & 0b111));
        Segment::of_buffer(command & TOGGLE != 0, shifted, len, command & LAST_SEGMENT != 0)
    }

    #[inline]
    fn to_bytes(self) -> [u8; 8] {
        let command = flag(self.toggle, TOGGLE) | (7 - self.len) << 1 | flag(self.last, LAST_SEGMENT);
        let [a, b, c, d, e, f, g] = self.data;
        [command, a, b, c, d, e, f, g]
    }
}

/// Either side gives a transfer up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Abort {
    /// The entry that was transferred.
    pub address: Address,
    /// The reason.
    pub code: AbortCode,
}

impl Abort {
    fn parse(bytes: &[u8; 8]) -> Self {
        Abort { address: address(bytes), code: AbortCode(u32::from_le_bytes(data(bytes))) }
    }

    fn to_bytes(self) -> [u8; 8] {
        compose(4 << 5, self.address, self.code.0.to_le_bytes())
    }
}

/// The receiver of a block tells how much of it arrived.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Confirmation {
    /// The last segment that arrived with all before it; 0 when the first one was lost.
    pub sequence: u8,
    /// Segments of the next block, 1 to 127 if the receiver keeps to the standard.
    pub block_size: u8,
}

impl Confirmation {
    fn to_bytes(self) -> [u8; 8] {
        [5 << 5 | 2, self.sequence, self.block_size, 0, 0, 0, 0, 0]
    }
}

/// The sender of blocks has sent all.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BlockEnd {
    /// How many bytes of the last segment do not count; only three bits of it travel.
    unused: u8,
    /// The checksum of all bytes that count; 0 when a side cannot compute it.
    pub crc: u16,
}

impl BlockEnd {
    /// `None` when `unused`, the bytes of the last segment that do not count, is above seven.
    #[must_use]
    pub const fn new(unused: u8, crc: u16) -> Option<Self> {
        if unused > 7 { None } else { Some(BlockEnd { unused, crc }) }
    }

    /// How many bytes of the last segment do not count, 0 to 7.
    #[must_use]
    pub const fn unused(&self) -> u8 {
        self.unused
    }

    fn parse(bytes: &[u8; 8]) -> Self {
        let [command, low, high, ..] = *bytes;
        BlockEnd { unused: command >> 2 & 0b111, crc: u16::from_le_bytes([low, high]) }
    }

    fn to_bytes(self) -> [u8; 8] {
        let [low, high] = self.crc.to_le_bytes();
        [6 << 5 | self.unused << 2 | END, low, high, 0, 0, 0, 0, 0]
    }
}

/// Flags of the first byte. The same bit has several meanings, by command.
const TOGGLE: u8 = 0x10;
const LAST_SEGMENT: u8 = 0x01;
const EXPEDITED: u8 = 0x02;
const SIZED: u8 = 0x01;
const CRC: u8 = 0x04;
const BLOCK_SIZED: u8 = 0x02;
const END: u8 = 0x01;

const fn flag(set: bool, bit: u8) -> u8 {
    if set { bit } else { 0 }
}

/// The block commands with specifier 6 are the same in both directions.
fn initiate_sized(address: Address, crc: bool, size: Option<u32>) -> [u8; 8] {
    let command = 6 << 5 | flag(crc, CRC) | flag(size.is_some(), BLOCK_SIZED);
    compose(command, address, size.unwrap_or(0).to_le_bytes())
}

#[inline]
fn compose(command: u8, address: Address, [d, e, f, g]: [u8; 4]) -> [u8; 8] {
    let [a, b] = address.index().to_le_bytes();
    [command, a, b, address.sub(), d, e, f, g]
}

/// The entry that a frame names, where the command is one that names any.
#[inline]
pub(crate) fn address(&[_, low, high, sub, ..]: &[u8; 8]) -> Address {
    Address::new(u16::from_le_bytes([low, high]), sub)
}

#[inline]
fn data(&[.., d, e, f, g]: &[u8; 8]) -> [u8; 4] {
    [d, e, f, g]
}

/// The first `len` bytes; the others become zero.
fn masked(data: [u8; 4], len: u8) -> [u8; 4] {
    let mask = (1_u64 << (8 * len)) - 1;
    (u32::from_le_bytes(data) & mask as u32).to_le_bytes()
}
