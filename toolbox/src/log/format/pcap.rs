//! pcap: a header of 24 bytes, then for each packet a header of 16 bytes and the packet, in the byte order of the
//! machine that wrote it.

use std::sync::Arc;

use lexican_runtime::Instant;

use crate::log::codec::{Decode, Encode, Skipped, WriteError};
use crate::log::input::{Fault, Flaw, Input};
use crate::log::{Direction, INTERFACE, Record, socketcan};

const MICROSECONDS: u32 = 0xA1B2_C3D4;
const NANOSECONDS: u32 = 0xA1B2_3C4D;

/// Longer than any packet that tools write.
pub(super) const LONGEST_PACKET: u64 = 1 << 20;

/// The byte order of numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Order {
    #[default]
    Little,
    Big,
}

impl Order {
    /// The byte order in which these bytes are `number`.
    pub(super) fn of(bytes: [u8; 4], number: u32) -> Option<Order> {
        [Order::Little, Order::Big].into_iter().find(|order| order.u32(bytes) == number)
    }

    pub(super) fn u32(self, bytes: [u8; 4]) -> u32 {
        match self {
            Order::Little => u32::from_le_bytes(bytes),
            Order::Big => u32::from_be_bytes(bytes),
        }
    }

    pub(super) fn u16(self, bytes: [u8; 2]) -> u16 {
        match self {
            Order::Little => u16::from_le_bytes(bytes),
            Order::Big => u16::from_be_bytes(bytes),
        }
    }
}

#[derive(Default)]
pub(super) struct Read {
    head: Option<Head>,
    packet: Vec<u8>,
}

#[derive(Clone)]
struct Head {
    order: Order,
    /// The number of time units per microsecond.
    per_microsecond: u32,
    interface: Arc<str>,
}

impl Head {
    fn read(input: &mut Input) -> Result<Self, Fault> {
        let magic = input.array()?;
        let kinds = [(MICROSECONDS, 1), (NANOSECONDS, 1000)];
        let found = kinds.iter().find_map(|(number, per)| Some((Order::of(magic, *number)?, *per)));
        let (order, per_microsecond) = found.ok_or(Flaw::ByteOrder)?;
        // Skip version, time zone, accuracy, longest packet.
        input.skip(16)?;
        let link_type = order.u32(input.array()?) & 0xFFFF;
        if link_type != socketcan::LINK_TYPE {
            return Err(Flaw::LinkType(link_type).into());
        }
        Ok(Head { order, per_microsecond, interface: INTERFACE.into() })
    }
}

impl Decode for Read {
    fn next(&mut self, input: &mut Input, skipped: &mut Skipped) -> Result<Option<Record>, Fault> {
        let head = match &self.head {
            Some(head) => head,
            None => self.head.insert(Head::read(input)?),
        };
        let mut field = [0; 4];
        while input.fill(&mut field)? {
            let seconds = u64::from(head.order.u32(field));
            let parts = head.order.u32(input.array()?) / head.per_microsecond;
            let captured = u64::from(head.order.u32(input.array()?));
            input.skip(4)?;
            if captured > LONGEST_PACKET {
                return Err(Flaw::Length(captured).into());
            }
            input.vec(&mut self.packet, captured)?;
            if let Some(frame) = socketcan::frame(&self.packet, skipped) {
                let at = Instant::from_micros(seconds * 1_000_000 + u64::from(parts));
                let interface = Arc::clone(&head.interface);
                return Ok(Some(Record { at, interface, direction: Direction::Received, frame }));
            }
        }
        Ok(None)
    }
}

#[derive(Default)]
pub(super) struct Write {
    has_begun: bool,
}

impl Write {
    fn begin(&mut self, out: &mut Vec<u8>) {
        if !std::mem::replace(&mut self.has_begun, true) {
            // Version 2.4, no time zone, packets of any length.
            for word in [MICROSECONDS, 4 << 16 | 2, 0, 0, 65_535, socketcan::LINK_TYPE] {
                out.extend(word.to_le_bytes());
            }
        }
    }
}

impl Encode for Write {
    fn record(&mut self, out: &mut Vec<u8>, record: &Record) -> Result<(), WriteError> {
        let us = record.at.as_micros();
        let out_of_range = |_| WriteError::Time { at: record.at };
        let seconds = u32::try_from(us / 1_000_000).map_err(out_of_range)?;
        self.begin(out);
        for word in [seconds, (us % 1_000_000) as u32, socketcan::LEN as u32, socketcan::LEN as u32] {
            out.extend(word.to_le_bytes());
        }
        out.extend(socketcan::bytes(&record.frame));
        Ok(())
    }

    fn finish(&mut self, out: &mut Vec<u8>) {
        self.begin(out);
    }
}
