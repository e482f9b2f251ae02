//! SDO commands (CiA 301, 7.2.4.3): eight bytes to meaning and back.
//!
//! The upper three bits of the first byte are the command specifier, which determines the meaning of the other bits.
//! The same specifier has different meanings in a request and in a response, so there are two types. The data frames of
//! a block transfer have no specifier: see [`super::sdo_block`].
//!
//! Reserved bits are ignored when parsed and zero when emitted, so that `parse(to_bytes(x)) == x` for every `x`, but
//! not the other way round.

use crate::abort::AbortCode;
use crate::object::Address;

/// A request of a client to a server.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "the names say what it is")]
pub enum ClientRequest {
    /// Download SDO segment (7.2.4.3.4).
    DownloadSegment(Segment),
    /// Initiate SDO download (7.2.4.3.3): the start of a write.
    InitiateDownload {
        address: Address,
        /// The data, or their length.
        content: Content,
    },
    /// Initiate SDO upload (7.2.4.3.6): the start of a read.
    InitiateUpload { address: Address },
    /// Upload SDO segment (7.2.4.3.7).
    UploadSegment {
        /// Alternates, beginning with `false`.
        toggle: bool,
    },
    /// Abort SDO transfer (7.2.4.3.17).
    Abort(Abort),
    /// Initiate SDO block upload (7.2.4.3.13).
    InitiateBlockUpload {
        address: Address,
        /// Whether the client can compute the CRC.
        crc: bool,
        /// Segments per block, 1 to 127 if the client conforms to the standard.
        block_size: u8,
        /// The largest number of bytes for which the server may answer with another transfer than by block; 0 for none.
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
        address: Address,
        /// Whether the client can compute the CRC.
        crc: bool,
        /// The number of bytes, if the client indicates it.
        size: Option<u32>,
    },
    /// End SDO block download (7.2.4.3.11).
    EndBlockDownload(BlockEnd),
}

/// A response of a server to a client.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "the names say what it is")]
pub enum ServerResponse {
    /// Upload SDO segment (7.2.4.3.7).
    UploadSegment(Segment),
    /// Download SDO segment (7.2.4.3.4): the segment was accepted.
    DownloadSegment { toggle: bool },
    /// Initiate SDO upload (7.2.4.3.6).
    InitiateUpload {
        address: Address,
        /// The data, or their length.
        content: Content,
    },
    /// Initiate SDO download (7.2.4.3.3): the write has begun, or if it was expedited, is done.
    InitiateDownload { address: Address },
    /// Abort SDO transfer (7.2.4.3.17).
    Abort(Abort),
    /// Initiate SDO block download (7.2.4.3.9).
    InitiateBlockDownload {
        address: Address,
        /// Whether the server can compute the CRC.
        crc: bool,
        /// Segments per block, 1 to 127 if the server conforms to the standard.
        block_size: u8,
    },
    /// A block arrived, wholly or in part (7.2.4.3.10).
    ConfirmBlockDownload(Confirmation),
    /// End SDO block download (7.2.4.3.11): the data were accepted.
    EndBlockDownload,
    /// Initiate SDO block upload (7.2.4.3.13).
    InitiateBlockUpload {
        address: Address,
        /// Whether the server can compute the CRC.
        crc: bool,
        /// The number of bytes, if the server indicates it.
        size: Option<u32>,
    },
    /// End SDO block upload (7.2.4.3.15).
    EndBlockUpload(BlockEnd),
}

impl ClientRequest {
    /// `None` if there are not eight bytes, or the command is not in CiA 301.
    #[inline]
    #[must_use]
    pub fn parse(bytes: &[u8]) -> Option<Self> {
        ClientRequest::from_raw(Raw::parse(bytes)?)
    }

    #[inline]
    pub(crate) fn from_raw(raw: Raw) -> Option<Self> {
        let address = raw.address();
        Some(match raw.specifier() {
            0 => ClientRequest::DownloadSegment(Segment::parse(raw)),
            1 => ClientRequest::InitiateDownload { address, content: Content::parse(raw) },
            2 => ClientRequest::InitiateUpload { address },
            3 => ClientRequest::UploadSegment { toggle: raw.has(TOGGLE) },
            4 => ClientRequest::Abort(Abort::parse(raw)),
            5 => match raw.command() & 0b11 {
                0 => {
                    let [block_size, switch_threshold, ..] = raw.data().to_le_bytes();
                    ClientRequest::InitiateBlockUpload { address, crc: raw.has(CRC), block_size, switch_threshold }
                }
                1 => ClientRequest::EndBlockUpload,
                2 => ClientRequest::ConfirmBlockUpload(Confirmation::parse(raw)),
                _ => ClientRequest::StartBlockUpload,
            },
            6 if raw.has(END) => ClientRequest::EndBlockDownload(BlockEnd::parse(raw)),
            6 => {
                let size = raw.has(BLOCK_SIZED).then(|| raw.data());
                ClientRequest::InitiateBlockDownload { address, crc: raw.has(CRC), size }
            }
            _ => return None,
        })
    }

    /// The eight bytes of the frame.
    #[inline]
    #[must_use]
    pub fn to_bytes(&self) -> [u8; 8] {
        self.to_raw().to_bytes()
    }

    // Always inlined: the caller knows the variant, so that most of the match disappears (README: SDO read of 4 bytes).
    #[inline(always)]
    pub(crate) fn to_raw(self) -> Raw {
        match self {
            ClientRequest::DownloadSegment(segment) => segment.to_raw(),
            ClientRequest::InitiateDownload { address, content } => content.to_raw(1 << 5, address),
            ClientRequest::InitiateUpload { address } => Raw::addressed(2 << 5, address, 0),
            ClientRequest::UploadSegment { toggle } => Raw::bare(3 << 5 | flag(toggle, TOGGLE)),
            ClientRequest::Abort(abort) => abort.to_raw(),
            ClientRequest::InitiateBlockUpload { address, crc, block_size, switch_threshold } => {
                let data = u16::from_le_bytes([block_size, switch_threshold]);
                Raw::addressed(5 << 5 | flag(crc, CRC), address, u32::from(data))
            }
            ClientRequest::EndBlockUpload => Raw::bare(5 << 5 | 1),
            ClientRequest::ConfirmBlockUpload(confirmation) => confirmation.to_raw(),
            ClientRequest::StartBlockUpload => Raw::bare(5 << 5 | 3),
            ClientRequest::InitiateBlockDownload { address, crc, size } => initiate_sized(address, crc, size),
            ClientRequest::EndBlockDownload(end) => end.to_raw(),
        }
    }

    /// The entry of the transfer that this begins; `None` if it begins none.
    #[inline]
    #[must_use]
    pub const fn initiates(&self) -> Option<Address> {
        match *self {
            ClientRequest::InitiateDownload { address, .. }
            | ClientRequest::InitiateUpload { address }
            | ClientRequest::InitiateBlockUpload { address, .. }
            | ClientRequest::InitiateBlockDownload { address, .. } => Some(address),
            _ => None,
        }
    }
}

impl ServerResponse {
    /// `None` if there are not eight bytes, or the command is not in CiA 301.
    #[inline]
    #[must_use]
    pub fn parse(bytes: &[u8]) -> Option<Self> {
        ServerResponse::from_raw(Raw::parse(bytes)?)
    }

    #[inline(always)]
    pub(crate) fn from_raw(raw: Raw) -> Option<Self> {
        let address = raw.address();
        Some(match raw.specifier() {
            0 => ServerResponse::UploadSegment(Segment::parse(raw)),
            1 => ServerResponse::DownloadSegment { toggle: raw.has(TOGGLE) },
            2 => ServerResponse::InitiateUpload { address, content: Content::parse(raw) },
            3 => ServerResponse::InitiateDownload { address },
            4 => ServerResponse::Abort(Abort::parse(raw)),
            5 => match raw.command() & 0b11 {
                0 => {
                    let [block_size, ..] = raw.data().to_le_bytes();
                    ServerResponse::InitiateBlockDownload { address, crc: raw.has(CRC), block_size }
                }
                1 => ServerResponse::EndBlockDownload,
                2 => ServerResponse::ConfirmBlockDownload(Confirmation::parse(raw)),
                _ => return None,
            },
            6 if raw.has(END) => ServerResponse::EndBlockUpload(BlockEnd::parse(raw)),
            6 => {
                let size = raw.has(BLOCK_SIZED).then(|| raw.data());
                ServerResponse::InitiateBlockUpload { address, crc: raw.has(CRC), size }
            }
            _ => return None,
        })
    }

    /// The eight bytes of the frame.
    #[inline]
    #[must_use]
    pub fn to_bytes(&self) -> [u8; 8] {
        self.to_raw().to_bytes()
    }

    // Always inlined: the caller knows the variant, so that most of the match disappears (README: SDO read of 4 bytes).
    #[inline(always)]
    pub(crate) fn to_raw(self) -> Raw {
        match self {
            ServerResponse::UploadSegment(segment) => segment.to_raw(),
            ServerResponse::DownloadSegment { toggle } => Raw::bare(1 << 5 | flag(toggle, TOGGLE)),
            ServerResponse::InitiateUpload { address, content } => content.to_raw(2 << 5, address),
            ServerResponse::InitiateDownload { address } => Raw::addressed(3 << 5, address, 0),
            ServerResponse::Abort(abort) => abort.to_raw(),
            ServerResponse::InitiateBlockDownload { address, crc, block_size } => {
                Raw::addressed(5 << 5 | flag(crc, CRC), address, u32::from(block_size))
            }
            ServerResponse::EndBlockDownload => Raw::bare(5 << 5 | 1),
            ServerResponse::ConfirmBlockDownload(confirmation) => confirmation.to_raw(),
            ServerResponse::InitiateBlockUpload { address, crc, size } => initiate_sized(address, crc, size),
            ServerResponse::EndBlockUpload(end) => end.to_raw(),
        }
    }
}

/// What an initiate frame carries after the address: the data, or their length.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Content {
    /// The data itself (e = 1).
    Expedited(Expedited),
    /// Segments will follow (e = 0).
    Segmented {
        /// The number of bytes, if indicated (s = 1).
        size: Option<u32>,
    },
}

impl Content {
    #[inline]
    fn parse(raw: Raw) -> Self {
        if !raw.has(EXPEDITED) {
            return Content::Segmented { size: raw.has(SIZED).then(|| raw.data()) };
        }
        if !raw.has(SIZED) {
            return Content::Expedited(Expedited::of_unknown_len(raw.data().to_le_bytes()));
        }
        let unused = raw.command() >> 2 & 0b11;
        let data = raw.data() << (8 * unused) >> (8 * unused);
        Content::Expedited(Expedited { len: 4 - unused, data: data.to_le_bytes() })
    }

    #[inline]
    fn to_raw(self, specifier: u8, address: Address) -> Raw {
        match self {
            Content::Expedited(Expedited { len, data }) => {
                let length = if len == 0 { 0 } else { (4 - len) << 2 | SIZED };
                Raw::addressed(specifier | EXPEDITED | length, address, u32::from_le_bytes(data))
            }
            Content::Segmented { size } => {
                Raw::addressed(specifier | flag(size.is_some(), SIZED), address, size.unwrap_or(0))
            }
        }
    }
}

/// One to four bytes, or four bytes of which an unknown number is valid (e = 1, s = 0).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
// Aligned like a number: a processor stalls if it reads as a number what was written as bytes (README: SDO read of 4
// bytes).
#[repr(C, align(4))]
pub struct Expedited {
    // Bytes beyond `len` are zero.
    data: [u8; 4],
    // 0 if the length is not indicated.
    len: u8,
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

    /// The first `len` of these bytes; `None` unless they are one to four.
    #[inline]
    pub(crate) fn of_buffer(buffer: [u8; 4], len: usize) -> Option<Self> {
        if !(1..=4).contains(&len) {
            return None;
        }
        let data = u32::from_le_bytes(buffer) & u32::MAX >> (8 * (4 - len));
        Some(Expedited { len: len as u8, data: data.to_le_bytes() })
    }

    /// The same bytes without a length.
    #[inline]
    pub(crate) const fn without_len(self) -> Self {
        Expedited::of_unknown_len(self.data)
    }

    /// Four bytes without a length.
    #[inline]
    #[must_use]
    pub const fn of_unknown_len(data: [u8; 4]) -> Self {
        Expedited { len: 0, data }
    }

    /// The number of valid bytes, 1 to 4; `None` if it is not indicated.
    #[inline]
    #[must_use]
    pub const fn len(&self) -> Option<usize> {
        if self.len == 0 { None } else { Some(self.len as usize) }
    }

    /// Always `false`: an expedited transfer has at least one byte.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        false
    }

    /// The valid bytes: all four if their number is not indicated.
    #[inline]
    #[must_use]
    pub fn data(&self) -> &[u8] {
        self.data.get(..self.len().unwrap_or(4)).unwrap_or(&self.data)
    }
}

/// Up to seven bytes of a segmented transfer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Segment {
    /// Alternates, beginning with `false`.
    pub toggle: bool,
    /// Whether no segment follows (c = 1).
    pub last: bool,
    len: u8,
    // Seven bytes; those beyond `len` are zero. The eighth byte, also zero, allows handling them as one number.
    data: [u8; 8],
}

impl Segment {
    /// `None` if `data` are longer than seven bytes.
    #[must_use]
    pub fn new(toggle: bool, data: &[u8], last: bool) -> Option<Self> {
        let mut bytes = [0; 8];
        bytes.get_mut(..data.len()).filter(|room| room.len() < 8)?.copy_from_slice(data);
        Some(Segment { toggle, last, len: data.len() as u8, data: bytes })
    }

    /// The first `len` of these bytes, at most seven.
    #[inline]
    pub(crate) fn of_buffer(toggle: bool, buffer: [u8; 8], len: usize, last: bool) -> Self {
        let len = len.min(7) as u8;
        let data = u64::from_le_bytes(buffer) & !(u64::MAX << (8 * len));
        Segment { toggle, last, len, data: data.to_le_bytes() }
    }

    /// The data.
    #[inline]
    #[must_use]
    pub fn data(&self) -> &[u8] {
        self.data.get(..usize::from(self.len)).unwrap_or(&self.data)
    }

    #[inline]
    fn parse(raw: Raw) -> Self {
        let len = usize::from(7 - (raw.command() >> 1 & 0b111));
        Segment::of_buffer(raw.has(TOGGLE), (raw.0 >> 8).to_le_bytes(), len, raw.has(LAST_SEGMENT))
    }

    #[inline]
    fn to_raw(self) -> Raw {
        let command = flag(self.toggle, TOGGLE) | (7 - self.len) << 1 | flag(self.last, LAST_SEGMENT);
        Raw(u64::from_le_bytes(self.data) << 8 | u64::from(command))
    }
}

/// One side aborts a transfer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "the names say what it is")]
pub struct Abort {
    pub address: Address,
    pub code: AbortCode,
}

impl Abort {
    fn parse(raw: Raw) -> Self {
        Abort { address: raw.address(), code: AbortCode(raw.data()) }
    }

    fn to_raw(self) -> Raw {
        Raw::addressed(4 << 5, self.address, self.code.0)
    }
}

/// The receiver of a block confirms how much of it has arrived.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Confirmation {
    /// The last segment that arrived with all before it; 0 if the first one was lost.
    pub sequence: u8,
    /// Segments of the next block, 1 to 127 if the receiver conforms to the standard.
    pub block_size: u8,
}

impl Confirmation {
    fn parse(raw: Raw) -> Self {
        let [_, sequence, block_size, ..] = raw.0.to_le_bytes();
        Confirmation { sequence, block_size }
    }

    fn to_raw(self) -> Raw {
        Raw(u64::from_le_bytes([5 << 5 | 2, self.sequence, self.block_size, 0, 0, 0, 0, 0]))
    }
}

/// The sender of blocks has sent all data.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct BlockEnd {
    /// How many bytes of the last segment are padding; the frame has three bits for it.
    unused: u8,
    /// The checksum of all data; 0 if a side cannot compute it.
    pub crc: u16,
}

impl BlockEnd {
    /// `None` if `unused`, the number of padding bytes in the last segment, is above seven.
    #[must_use]
    pub const fn new(unused: u8, crc: u16) -> Option<Self> {
        if unused > 7 { None } else { Some(BlockEnd { unused, crc }) }
    }

    /// The number of padding bytes in the last segment, 0 to 7.
    #[must_use]
    pub const fn unused(&self) -> u8 {
        self.unused
    }

    fn parse(raw: Raw) -> Self {
        BlockEnd { unused: raw.command() >> 2 & 0b111, crc: (raw.0 >> 8) as u16 }
    }

    fn to_raw(self) -> Raw {
        Raw(u64::from(self.crc) << 8 | u64::from(6 << 5 | self.unused << 2 | END))
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

/// The frame for a block command with specifier 6, the same in both directions.
fn initiate_sized(address: Address, crc: bool, size: Option<u32>) -> Raw {
    let command = 6 << 5 | flag(crc, CRC) | flag(size.is_some(), BLOCK_SIZED);
    Raw::addressed(command, address, size.unwrap_or(0))
}

/// The eight bytes of a frame as one little-endian number: command, index, sub-index and data, from the lowest byte on.
/// It is composed and parsed in a register by shifts, instead of byte by byte (README: SDO read of 4 bytes).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Raw(pub(crate) u64);

impl Raw {
    #[inline]
    pub(crate) fn parse(bytes: &[u8]) -> Option<Self> {
        Some(Raw(u64::from_le_bytes(bytes.try_into().ok()?)))
    }

    #[inline]
    pub(crate) fn to_bytes(self) -> [u8; 8] {
        self.0.to_le_bytes()
    }

    #[inline]
    fn bare(command: u8) -> Self {
        Raw(u64::from(command))
    }

    #[inline]
    fn addressed(command: u8, address: Address, data: u32) -> Self {
        let head = u32::from(command) | u32::from(address.index()) << 8 | u32::from(address.sub()) << 24;
        Raw(u64::from(head) | u64::from(data) << 32)
    }

    #[inline]
    fn command(self) -> u8 {
        self.0 as u8
    }

    #[inline]
    fn specifier(self) -> u8 {
        self.command() >> 5
    }

    /// The toggle bit of a request for a segment, if this is one.
    #[inline]
    pub(crate) fn upload_segment(self) -> Option<bool> {
        (self.specifier() == 3).then(|| self.has(TOGGLE))
    }

    /// The toggle bit of the confirmation of a segment, if this is one.
    #[inline]
    pub(crate) fn download_segment(self) -> Option<bool> {
        (self.specifier() == 1).then(|| self.has(TOGGLE))
    }

    /// The segment in the direction of the data, if this is one.
    #[inline]
    pub(crate) fn segment(self) -> Option<Segment> {
        (self.specifier() == 0).then(|| Segment::parse(self))
    }

    /// The abort, if this is one.
    #[inline]
    pub(crate) fn abort(self) -> Option<Abort> {
        (self.specifier() == 4).then(|| Abort::parse(self))
    }

    #[inline]
    fn has(self, flag: u8) -> bool {
        self.command() & flag != 0
    }

    /// The entry in the frame, if the command has one.
    #[inline]
    pub(crate) fn address(self) -> Address {
        Address::new((self.0 >> 8) as u16, (self.0 >> 24) as u8)
    }

    #[inline]
    fn data(self) -> u32 {
        (self.0 >> 32) as u32
    }
}
