//! pcapng: sections of blocks; each section has its own byte order. Packet blocks refer to an interface, which an
//! earlier block describes. Blocks of other types are skipped.

use std::sync::Arc;

use lexican_runtime::Instant;

use super::pcap::{LONGEST_PACKET, Order};
use crate::log::codec::{Decode, Encode, Skipped, WriteError};
use crate::log::input::{Fault, Flaw, Input, MOST_INTERFACES};
use crate::log::{Direction, INTERFACE, Record, socketcan};

const SECTION: u32 = 0x0A0D_0D0A;
const INTERFACE_DESCRIPTION: u32 = 1;
/// Wireshark's packet block before [`ENHANCED_PACKET`].
const PACKET: u32 = 2;
const SIMPLE_PACKET: u32 = 3;
const ENHANCED_PACKET: u32 = 6;

const BYTE_ORDER: u32 = 0x1A2B_3C4D;

/// Option codes of interfaces and packets.
const IF_NAME: u16 = 2;
const IF_TSRESOL: u16 = 9;
const IF_TSOFFSET: u16 = 14;
const FLAGS: u16 = 2;
/// The bits of a packet's flags for its direction.
const DIRECTION: u32 = 3;
const OUTBOUND: u32 = 2;

#[derive(Default)]
pub(super) struct Read {
    order: Order,
    interfaces: Vec<Interface>,
    body: Vec<u8>,
}

struct Interface {
    name: Arc<str>,
    link_type: u16,
    /// The number of time units per second.
    per_second: u128,
    /// In seconds, added to time stamps.
    offset: i64,
}

impl Interface {
    fn instant(&self, ticks: u64) -> Instant {
        let us = u128::from(ticks) * 1_000_000 / self.per_second;
        let us = i128::try_from(us).unwrap_or(i128::MAX).saturating_add(i128::from(self.offset) * 1_000_000);
        Instant::from_micros(u64::try_from(us.max(0)).unwrap_or(u64::MAX))
    }
}

impl Decode for Read {
    fn next(&mut self, input: &mut Input, skipped: &mut Skipped) -> Result<Option<Record>, Fault> {
        let mut kind = [0; 4];
        while input.fill(&mut kind)? {
            // The type of a section block is the same in both byte orders.
            if u32::from_le_bytes(kind) == SECTION {
                self.section(input)?;
                continue;
            }
            let len = u64::from(self.order.u32(input.array()?));
            let body = len.checked_sub(12).filter(|_| len.is_multiple_of(4)).ok_or(Flaw::Length(len))?;
            let kind = self.order.u32(kind);
            if !matches!(kind, INTERFACE_DESCRIPTION | PACKET | SIMPLE_PACKET | ENHANCED_PACKET) {
                input.skip(body + 4)?;
                continue;
            }
            if body > LONGEST_PACKET {
                return Err(Flaw::Length(len).into());
            }
            input.vec(&mut self.body, body)?;
            if u64::from(self.order.u32(input.array()?)) != len {
                return Err(Flaw::Length(len).into());
            }
            if kind == INTERFACE_DESCRIPTION {
                self.describe(len)?;
            } else if let Some(record) = self.packet(kind, len, skipped)? {
                return Ok(Some(record));
            }
        }
        Ok(None)
    }
}

impl Read {
    fn section(&mut self, input: &mut Input) -> Result<(), Fault> {
        let len = input.array()?;
        self.order = Order::of(input.array()?, BYTE_ORDER).ok_or(Flaw::ByteOrder)?;
        self.interfaces.clear();
        let len = u64::from(self.order.u32(len));
        let rest = len.checked_sub(12).filter(|rest| *rest >= 16 && rest.is_multiple_of(4)).ok_or(Flaw::Length(len))?;
        let version = [input.array()?, input.array()?].map(|bytes| self.order.u16(bytes));
        if version[0] != 1 {
            return Err(Flaw::Version { major: version[0], minor: version[1] }.into());
        }
        input.skip(rest - 4)
    }

    fn describe(&mut self, len: u64) -> Result<(), Flaw> {
        if self.interfaces.len() == MOST_INTERFACES {
            return Err(Flaw::Interfaces);
        }
        let (head, options) = self.body.split_first_chunk::<8>().ok_or(Flaw::Length(len))?;
        let name = INTERFACE.into();
        let link_type = self.order.u16([head[0], head[1]]);
        let mut interface = Interface { name, link_type, per_second: 1_000_000, offset: 0 };
        for (code, value) in (Options { order: self.order, rest: options }) {
            match (code, value) {
                (IF_NAME, name) => interface.name = String::from_utf8_lossy(name).trim_end_matches('\0').into(),
                (IF_TSRESOL, [exponent, ..]) => {
                    let (base, exponent) = (if exponent & 0x80 == 0 { 10u128 } else { 2 }, u32::from(exponent & 0x7F));
                    // Finer than any clock; all times become 0.
                    interface.per_second = base.checked_pow(exponent).unwrap_or(u128::MAX);
                }
                (IF_TSOFFSET, value) => {
                    let bytes: Option<[u8; 8]> = value.try_into().ok();
                    let seconds = bytes.map(|bytes| match self.order {
                        Order::Little => i64::from_le_bytes(bytes),
                        Order::Big => i64::from_be_bytes(bytes),
                    });
                    interface.offset = seconds.unwrap_or_default();
                }
                _ => {}
            }
        }
        self.interfaces.push(interface);
        Ok(())
    }

    /// The frame in a packet block.
    fn packet(&self, kind: u32, len: u64, skipped: &mut Skipped) -> Result<Option<Record>, Flaw> {
        let mut rest = self.body.as_slice();
        let mut number = || {
            let (bytes, after) = rest.split_first_chunk().ok_or(Flaw::Length(len))?;
            rest = after;
            Ok::<_, Flaw>(self.order.u32(*bytes))
        };
        let (interface, ticks, captured) = match kind {
            SIMPLE_PACKET => (0, 0, number()?),
            _ => {
                let interface = number()?;
                let ticks = u64::from(number()?) << 32 | u64::from(number()?);
                let captured = number()?;
                number()?;
                (interface, ticks, captured)
            }
        };
        // In the older block, the other half of this word counts dropped packets.
        let interface = match (kind, self.order) {
            (PACKET, Order::Little) => interface & 0xFFFF,
            (PACKET, Order::Big) => interface >> 16,
            _ => interface,
        };
        // A simple packet block has only the original length, and the packet may be cut off.
        let captured = if kind == SIMPLE_PACKET { rest.len().min(captured as usize) } else { captured as usize };
        let packet = rest.get(..captured).ok_or(Flaw::Length(len))?;
        let options = rest.get(captured.next_multiple_of(4)..).unwrap_or_default();
        let known = self.interfaces.get(interface as usize).ok_or(Flaw::UnknownInterface(interface))?;
        if u32::from(known.link_type) != socketcan::LINK_TYPE {
            skipped.other += 1;
            return Ok(None);
        }
        let flags = (Options { order: self.order, rest: options }).find(|(code, _)| *code == FLAGS);
        let flags = flags.and_then(|(_, value)| Some(self.order.u32(value.try_into().ok()?)));
        let is_sent = kind != SIMPLE_PACKET && flags.is_some_and(|flags| flags & DIRECTION == OUTBOUND);
        let direction = if is_sent { Direction::Sent } else { Direction::Received };
        let record = |frame| Record { at: known.instant(ticks), interface: Arc::clone(&known.name), direction, frame };
        Ok(socketcan::frame(packet, skipped).map(record))
    }
}

/// The options at the end of a block: codes and values.
struct Options<'a> {
    order: Order,
    rest: &'a [u8],
}

impl<'a> Iterator for Options<'a> {
    type Item = (u16, &'a [u8]);

    fn next(&mut self) -> Option<Self::Item> {
        let ([a, b, c, d], rest) = self.rest.split_first_chunk()?;
        let (code, len) = (self.order.u16([*a, *b]), usize::from(self.order.u16([*c, *d])));
        let value = rest.get(..len)?;
        self.rest = rest.get(len.next_multiple_of(4)..).unwrap_or_default();
        (code != 0).then_some((code, value))
    }
}

#[derive(Default)]
pub(super) struct Write {
    has_begun: bool,
    interfaces: Vec<Arc<str>>,
}

impl Write {
    fn begin(&mut self, out: &mut Vec<u8>) {
        if !std::mem::replace(&mut self.has_begun, true) {
            // Version 1.0, section length unknown.
            let body = [BYTE_ORDER, 1, u32::MAX, u32::MAX].map(u32::to_le_bytes);
            block(out, SECTION, body.as_flattened());
        }
    }
}

impl Encode for Write {
    fn record(&mut self, out: &mut Vec<u8>, record: &Record) -> Result<(), WriteError> {
        let known = self.interfaces.iter().position(|name| *name == record.interface);
        if known.is_none() && self.interfaces.len() == MOST_INTERFACES {
            return Err(WriteError::Interfaces);
        }
        self.begin(out);
        let interface = known.unwrap_or_else(|| {
            let mut body = Vec::from(socketcan::LINK_TYPE.to_le_bytes());
            body.extend(0u32.to_le_bytes());
            // An option's length has 16 bits; no name is that long.
            let mut name = record.interface.as_bytes();
            name = name.get(..name.len().min(usize::from(u16::MAX) - 3)).unwrap_or_default();
            option(&mut body, IF_NAME, name);
            option(&mut body, 0, &[]);
            block(out, INTERFACE_DESCRIPTION, &body);
            self.interfaces.push(Arc::clone(&record.interface));
            self.interfaces.len() - 1
        });
        let (us, len) = (record.at.as_micros(), socketcan::LEN as u32);
        let mut body = Vec::with_capacity(64);
        for word in [interface as u32, (us >> 32) as u32, us as u32, len, len] {
            body.extend(word.to_le_bytes());
        }
        body.extend(socketcan::bytes(&record.frame));
        if record.direction == Direction::Sent {
            option(&mut body, FLAGS, &OUTBOUND.to_le_bytes());
            option(&mut body, 0, &[]);
        }
        block(out, ENHANCED_PACKET, &body);
        Ok(())
    }

    fn finish(&mut self, out: &mut Vec<u8>) {
        self.begin(out);
    }
}

/// Appends a block; the length of `body` is a multiple of 4.
fn block(out: &mut Vec<u8>, kind: u32, body: &[u8]) {
    let len = (body.len() as u32 + 12).to_le_bytes();
    out.extend(kind.to_le_bytes());
    out.extend(len);
    out.extend(body);
    out.extend(len);
}

fn option(body: &mut Vec<u8>, code: u16, value: &[u8]) {
    body.extend(code.to_le_bytes());
    body.extend((value.len() as u16).to_le_bytes());
    body.extend(value);
    body.resize(body.len().next_multiple_of(4), 0);
}
