//! Vector BLF: a header, then containers, mostly compressed by zlib, with objects in sequence; an object may continue
//! in the next container. All numbers are little-endian.

use lexican_runtime::{Duration, Frame, Instant};
use miniz_oxide::deflate::compress_to_vec_zlib;
use miniz_oxide::inflate::decompress_to_vec_zlib_with_limit;

use crate::log::channel::{Channels, Interfaces};
use crate::log::codec::{Decode, Encode, Skipped, WriteError};
use crate::log::input::{Fault, Flaw, Input};
use crate::log::{Direction, Record, socketcan};
use crate::text::calendar::{Civil, DAY};

/// Types of objects. The second type of message appends fields to those of the first.
const CAN_MESSAGE: u32 = 1;
const CAN_ERROR: u32 = 2;
const CONTAINER: u32 = 10;
const CAN_ERROR_EXT: u32 = 73;
const CAN_MESSAGE_2: u32 = 86;
const CAN_FD_MESSAGE: u32 = 100;
const CAN_FD_MESSAGE_64: u32 = 101;
const CAN_FD_ERROR_64: u32 = 104;

/// Compression of containers.
const PLAIN: u16 = 0;
const ZLIB: u16 = 2;

/// Units of time stamps.
const TEN_MICROSECONDS: u32 = 1;
const NANOSECONDS: u32 = 2;

/// Flags of a message.
const SENT: u8 = 1;
const REMOTE: u8 = 0x80;

const FILE_HEADER: usize = 144;
/// The size of an object's base header: signature, header length, version, object length, type.
const BASE: usize = 16;
/// The size of object headers including [`BASE`]; the newer one adds the sender's time.
const HEADER: usize = 32;
const LONG_HEADER: usize = 40;
/// The size of a message after its header: channel, flags, length, identifier, data.
const MESSAGE: usize = 16;
/// The size of a container's header after [`BASE`]: compression and unpacked length.
const CONTAINER_HEAD: u64 = 16;

/// The largest accepted container, packed or unpacked; Vector's tools use 128 KiB.
const LARGEST_CONTAINER: u64 = 16 << 20;
const CONTAINER_SIZE: usize = 128 << 10;
/// The compression level, 1 to 10: a third of level 6's time, for a few percent more bytes.
const LEVEL: u8 = 1;

#[derive(Default)]
pub(super) struct Read {
    start: Option<Instant>,
    packed: Vec<u8>,
    /// Unpacked bytes; those before `at` are done.
    objects: Vec<u8>,
    at: usize,
    /// The remaining bytes of an object to skip.
    to_skip: u64,
    interfaces: Interfaces,
}

impl Decode for Read {
    fn next(&mut self, input: &mut Input, skipped: &mut Skipped) -> Result<Option<Record>, Fault> {
        let start = match self.start {
            Some(start) => start,
            None => *self.start.insert(file_header(input, skipped)?),
        };
        loop {
            if let Some(object) = self.object()? {
                if let Some(record) = self.message(object, start, skipped) {
                    return Ok(Some(record));
                }
            } else if !self.container(input)? {
                let is_cut = self.to_skip > 0 || self.objects[self.at..].len() > 3;
                return if is_cut { Err(Fault::Cut) } else { Ok(None) };
            }
        }
    }
}

/// A Windows SYSTEMTIME: year, month, weekday, day, hours, minutes, seconds, milliseconds.
fn system_time(fields: &[u8; 16]) -> Option<Instant> {
    let (fields, _) = fields.as_chunks::<2>();
    let [year, month, _, day, hours, minutes, seconds, ms] =
        *fields.iter().map(|field| u64::from(u16::from_le_bytes(*field))).collect::<Vec<_>>()
    else {
        return None;
    };
    let time = (((hours * 60 + minutes) * 60 + seconds) * 1000 + ms) * 1000;
    Civil { year, month, day, time }.at()
}

fn to_system_time(at: Instant) -> [u8; 16] {
    let civil = Civil::of(at);
    let [hours, minutes, seconds, ms] = civil.clock();
    let fields = [civil.year, civil.month, civil.weekday(), civil.day, hours, minutes, seconds, ms];
    let mut bytes = [0; 16];
    for (place, field) in bytes.chunks_mut(2).zip(fields) {
        place.copy_from_slice(&(field as u16).to_le_bytes());
    }
    bytes
}

/// Reads the file header; returns the start of the measurement.
fn file_header(input: &mut Input, skipped: &mut Skipped) -> Result<Instant, Fault> {
    let head = input.array::<8>()?;
    let len = u64::from(u32::from_le_bytes([head[4], head[5], head[6], head[7]]));
    if !head.starts_with(b"LOGG") || len < 72 {
        return Err(Flaw::Object.into());
    }
    // Skip versions, lengths and counts.
    input.skip(32)?;
    let start = input.array::<16>()?;
    input.skip(len - 56)?;
    let start = if start == [0; 16] { Some(Instant::ZERO) } else { system_time(&start) };
    skipped.other += u64::from(start.is_none());
    Ok(start.unwrap_or_default())
}

impl Read {
    /// Unpacks the next container; `false` at the end of the file.
    fn container(&mut self, input: &mut Input) -> Result<bool, Fault> {
        let mut head = [0; BASE];
        if !input.fill(&mut head)? {
            return Ok(false);
        }
        let (len, kind) = lengths(&head).ok_or(Flaw::Object)?;
        let body = len - BASE as u64;
        if kind != CONTAINER {
            input.skip(body)?;
            pad(input, len)?;
            return Ok(true);
        }
        if !(CONTAINER_HEAD..=LARGEST_CONTAINER).contains(&body) {
            return Err(Flaw::Length(len).into());
        }
        let head = input.array::<{ CONTAINER_HEAD as usize }>()?;
        let method = u16::from_le_bytes([head[0], head[1]]);
        input.vec(&mut self.packed, body - CONTAINER_HEAD)?;
        pad(input, len)?;
        // Keep the rest of an object that began in the last container.
        self.objects.drain(..self.at);
        self.at = 0;
        match method {
            PLAIN => self.objects.extend_from_slice(&self.packed),
            ZLIB => {
                let unpacked = decompress_to_vec_zlib_with_limit(&self.packed, LARGEST_CONTAINER as usize);
                self.objects.extend(unpacked.map_err(|_| Flaw::Inflate)?);
            }
            other => return Err(Flaw::Compression(other).into()),
        }
        Ok(true)
    }

    /// The next object; `None` if it continues in the next container.
    fn object(&mut self) -> Result<Option<Object>, Flaw> {
        let skip = self.to_skip.min((self.objects.len() - self.at) as u64);
        self.at += skip as usize;
        self.to_skip -= skip;
        // Objects are padded, by some writers to four bytes and by others by their length modulo 4.
        let rest = &self.objects[self.at..];
        let padding = rest.iter().take(MOST_PADDING).take_while(|byte| **byte != b'L').count();
        let Some(head) = rest.get(padding..).and_then(<[u8]>::first_chunk::<BASE>) else { return Ok(None) };
        let (len, kind) = lengths(head).ok_or(Flaw::Object)?;
        let mut object = Object { kind, bytes: [0; LONG_HEADER + MESSAGE] };
        if matches!(kind, CAN_MESSAGE | CAN_MESSAGE_2) {
            let wanted = object.bytes.len().min(usize::try_from(len).unwrap_or(usize::MAX));
            let Some(bytes) = rest.get(padding..padding + wanted) else { return Ok(None) };
            object.bytes[..wanted].copy_from_slice(bytes);
        }
        self.at += padding;
        self.to_skip = len;
        Ok(Some(object))
    }

    fn message(&mut self, object: Object, start: Instant, skipped: &mut Skipped) -> Option<Record> {
        let counter = match object.kind {
            CAN_MESSAGE | CAN_MESSAGE_2 => return self.record(&object.bytes, start, skipped),
            CAN_FD_MESSAGE | CAN_FD_MESSAGE_64 => &mut skipped.fd,
            CAN_ERROR | CAN_ERROR_EXT | CAN_FD_ERROR_64 => &mut skipped.errors,
            _ => &mut skipped.other,
        };
        *counter += 1;
        None
    }

    fn record(
        &mut self,
        object: &[u8; LONG_HEADER + MESSAGE],
        start: Instant,
        skipped: &mut Skipped,
    ) -> Option<Record> {
        let u16_at = |at: usize| u16::from_le_bytes([object[at], object[at + 1]]);
        let u32_at = |at: usize| u32::from_le_bytes([object[at], object[at + 1], object[at + 2], object[at + 3]]);
        let ticks = u64::from(u32_at(28)) << 32 | u64::from(u32_at(24));
        let us = match u32_at(16) {
            TEN_MICROSECONDS => ticks.saturating_mul(10),
            // Nanoseconds, even if an older tool does not say so.
            _ => ticks / 1000,
        };
        // The newer header is longer, by the sender's time.
        let body = usize::from(u16_at(4)).max(HEADER);
        let fields = object.get(body..body + MESSAGE);
        let Some([c0, c1, flags, len, i0, i1, i2, i3, data @ ..]) = fields else {
            skipped.other += 1;
            return None;
        };
        let len = (*len).min(8);
        let id = socketcan::identifier(u32::from_le_bytes([*i0, *i1, *i2, *i3]));
        let frame = id.and_then(|id| {
            if flags & REMOTE != 0 { Frame::remote(id, len) } else { Frame::new(id, data.get(..usize::from(len))?) }
        });
        let Some(frame) = frame else {
            skipped.other += 1;
            return None;
        };
        let interface = self.interfaces.of(u16::from_le_bytes([*c0, *c1]));
        let direction = if flags & SENT == 0 { Direction::Received } else { Direction::Sent };
        Some(Record { at: start + Duration::from_micros(us), interface, direction, frame })
    }
}

/// An object. For a message, it has the bytes from the header on, filled up with zeros.
struct Object {
    kind: u32,
    bytes: [u8; LONG_HEADER + MESSAGE],
}

/// The most padding before an object.
const MOST_PADDING: usize = 7;

/// The length and the type of an object, from its base header.
fn lengths(head: &[u8; BASE]) -> Option<(u64, u32)> {
    let number = |at: usize| u32::from_le_bytes([head[at], head[at + 1], head[at + 2], head[at + 3]]);
    (head.starts_with(b"LOBJ") && number(8) as usize >= BASE).then(|| (u64::from(number(8)), number(12)))
}

/// Skips the padding after an object of this length, which may be missing at the end of a file.
fn pad(input: &mut Input, len: u64) -> Result<(), Fault> {
    match input.skip(len % 4) {
        Err(Fault::Cut) => Ok(()),
        result => result,
    }
}

/// Writes messages in compressed containers.
#[derive(Default)]
pub(super) struct Write {
    has_begun: bool,
    /// The first time, rounded to milliseconds as in the header, and the last one.
    times: Option<(Instant, Instant)>,
    objects: Vec<u8>,
    count: u32,
    /// The size of the uncompressed file without its header.
    unpacked: u64,
    channels: Channels,
}

impl Write {
    fn begin(&mut self, out: &mut Vec<u8>) {
        if !std::mem::replace(&mut self.has_begun, true) {
            out.extend(self.header(FILE_HEADER as u64));
        }
    }

    fn header(&self, len: u64) -> Vec<u8> {
        // Signature, header length, application 0, and the version of the format.
        let mut header = Vec::from(*b"LOGG");
        header.extend((FILE_HEADER as u32).to_le_bytes());
        header.extend([0, 0, 0, 0, 2, 6, 8, 1]);
        header.extend(len.to_le_bytes());
        header.extend((FILE_HEADER as u64 + self.unpacked).to_le_bytes());
        header.extend(self.count.to_le_bytes());
        header.extend(0u32.to_le_bytes());
        let (first, last) = self.times.unwrap_or_default();
        header.extend(to_system_time(first));
        header.extend(to_system_time(last));
        header.resize(FILE_HEADER, 0);
        header
    }
}

/// The first bytes of an object.
fn base(out: &mut Vec<u8>, header: u16, len: usize, kind: u32) {
    out.extend(b"LOBJ");
    out.extend(header.to_le_bytes());
    out.extend(1u16.to_le_bytes());
    out.extend((len as u32).to_le_bytes());
    out.extend(kind.to_le_bytes());
}

impl Encode for Write {
    fn record(&mut self, out: &mut Vec<u8>, record: &Record) -> Result<(), WriteError> {
        let Record { at, interface, direction, frame } = record;
        if at.as_micros() / DAY > LAST_DAY {
            return Err(WriteError::Time { at: *at });
        }
        let channel = self.channels.of(interface)?;
        // The file header needs the first time, so it is written with the first frame.
        let first = self.times.map_or(Instant::from_micros(at.as_micros() / 1000 * 1000), |(first, _)| first);
        self.times = Some((first, *at));
        self.begin(out);
        base(&mut self.objects, HEADER as u16, HEADER + MESSAGE, CAN_MESSAGE);
        self.objects.extend(NANOSECONDS.to_le_bytes());
        self.objects.extend([0; 4]);
        self.objects.extend(at.since(first).as_micros().saturating_mul(1000).to_le_bytes());
        let flags = if *direction == Direction::Sent { SENT } else { 0 } | if frame.is_remote() { REMOTE } else { 0 };
        self.objects.extend([channel, 0, flags, frame.dlc()]);
        self.objects.extend(socketcan::number(frame.id()).to_le_bytes());
        let data = self.objects.len();
        self.objects.extend(frame.data());
        self.objects.resize(data + 8, 0);
        self.count = self.count.saturating_add(1);
        if self.objects.len() >= CONTAINER_SIZE {
            self.flush(out);
        }
        Ok(())
    }

    fn flush(&mut self, out: &mut Vec<u8>) {
        if self.objects.is_empty() {
            return;
        }
        let packed = compress_to_vec_zlib(&self.objects, LEVEL);
        let head = BASE + CONTAINER_HEAD as usize;
        self.unpacked += (head + self.objects.len()) as u64;
        let len = head + packed.len();
        base(out, BASE as u16, len, CONTAINER);
        out.extend(ZLIB.to_le_bytes());
        out.extend([0; 6]);
        out.extend((self.objects.len() as u32).to_le_bytes());
        out.extend([0; 4]);
        out.extend(packed);
        out.extend(std::iter::repeat_n(0, len % 4));
        self.objects.clear();
    }

    fn finish(&mut self, out: &mut Vec<u8>) {
        self.begin(out);
    }

    fn beginning(&self, len: u64) -> Option<Vec<u8>> {
        Some(self.header(len))
    }
}

/// 31 December 9999.
const LAST_DAY: u64 = 2_932_896;
