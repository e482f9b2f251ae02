//! Transfers between the client and the server of the runtime, without faults. Other CANopen stacks got some of them
//! wrong: zencan 0.0.5, canopen-sdo 0.2.0 and oze-canopen 0.1.0, where it was reproduced; and canopen-python and
//! CANopenNode, according to public threads. The comments say which.

use crate::sdo_support::{Bus, Growing, NODE, Od, at, frame, pattern};
use lexican_runtime::object::{Access, Address, DataType, Entry, ObjectDictionary};
use lexican_runtime::service::sdo_client::{Event, Payload, SdoClient, SdoError};
use lexican_runtime::service::sdo_server::{self, SdoServer};
use lexican_runtime::{AbortCode, Instant};

const DOMAIN: Address = at(0x2003, 0);
const VALUE: Address = at(0x2000, 8);
const FIXED: Address = at(0x1018, 1);

fn bus(data: &[u8]) -> Bus {
    Bus::new(
        Od::default()
            .with(DOMAIN, DataType::Domain, Access::Rw, data)
            .with(VALUE, DataType::Unsigned64, Access::Rw, &[1, 2, 3, 4, 5, 6, 7, 8])
            .with(FIXED, DataType::Unsigned32, Access::Ro, &[1, 2, 3, 4]),
    )
}

/// A bus whose client writes by block.
fn block_bus(data: &[u8]) -> Bus {
    let mut bus = bus(data);
    bus.client = bus.client.with_block_writes_from(0);
    bus
}

/// Writes and reads of each length arrive, and the server reports them. canopen-rs 4 has no objects of more than 32
/// bytes; canopen-sdo refuses to write zero bytes.
fn check_lengths(bus: &mut Bus, lengths: impl Iterator<Item = usize>, read: fn(&mut Bus, Address) -> (Event, Vec<u8>)) {
    for len in lengths {
        let data = pattern(len);
        let done = Event::Done { address: DOMAIN, len: len as u32 };
        assert_eq!(bus.write(DOMAIN, &data), done);
        assert_eq!(read(bus, DOMAIN), (done, data));
        bus.settle();
        assert_eq!(bus.events.pop(), Some(sdo_server::Event::Read(DOMAIN)));
        assert_eq!(bus.events.pop(), Some(sdo_server::Event::Written(DOMAIN)));
        assert_eq!(bus.events, []);
    }
}

#[test]
fn every_length_survives_a_write_and_a_read() {
    for hides_len in [false, true] {
        let mut bus = bus(b"");
        bus.od.hides_len = hides_len;
        check_lengths(&mut bus, 0..100, Bus::read);
    }
}

#[test]
fn every_length_survives_a_block_write_and_a_block_read() {
    for (hides_len, block_size) in [(false, 127), (true, 127), (false, 1), (true, 2), (false, 3)] {
        let mut bus = block_bus(b"");
        bus.od.hides_len = hides_len;
        bus.client = bus.client.with_block_size(block_size);
        bus.server = bus.server.with_block_size(block_size);
        check_lengths(&mut bus, (0..60).chain([888, 889, 890, 1777, 1778, 1779]), Bus::read_block);
    }
}

#[test]
fn a_block_write_is_what_the_standard_says() {
    let mut bus = block_bus(b"");
    bus.server = bus.server.with_block_size(2);
    bus.write(DOMAIN, b"123456789123456789");
    let log = [
        "605#C6 0320 00 12000000",
        "585#A4 0320 00 02000000",
        "605#01 31323334353637",
        "605#02 38393132333435",
        "585#A2 02 02 0000000000",
        "605#81 36373839000000",
        "585#A2 01 02 0000000000",
        "605#CD C6ED 0000000000",
        "585#A1 00000000000000",
    ];
    assert_eq!(bus.log, log.map(frame));
}

#[test]
fn a_block_read_is_what_the_standard_says() {
    let mut bus = bus(b"1234567891234567891234");
    bus.client = bus.client.with_block_size(3);
    bus.read_block(DOMAIN);
    bus.settle();
    let log = [
        "605#A4 0320 00 03 15 0000",
        "585#C6 0320 00 16000000",
        "605#A3 00000000000000",
        "585#01 31323334353637",
        "585#02 38393132333435",
        "585#03 36373839313233",
        "605#A2 03 03 0000000000",
        "585#81 34000000000000",
        "605#A2 01 03 0000000000",
        "585#D9 B2FE 0000000000",
        "605#A1 00000000000000",
    ];
    assert_eq!(bus.log, log.map(frame));
    assert_eq!(bus.events, [sdo_server::Event::Read(DOMAIN)], "the client has confirmed the end");
    // zencan 4 answers the end of the transfer, which makes the next transfer fail.
    assert_eq!(bus.read(FIXED).1, [1, 2, 3, 4]);
}

// zencan 3: seven unused bytes instead of none.
#[test]
fn a_block_read_of_a_multiple_of_seven_bytes_has_no_unused_bytes() {
    for len in [28, 7 * 127, 7 * 128] {
        let mut bus = bus(&pattern(len));
        assert_eq!(bus.read_block(DOMAIN), (Event::Done { address: DOMAIN, len: len as u32 }, pattern(len)));
        assert_eq!(bus.log.last().unwrap().data()[0], 0xC1);
    }
}

#[test]
fn few_bytes_are_read_without_blocks_though_asked_for() {
    let mut bus = bus(&pattern(21));
    assert_eq!(bus.read_block(DOMAIN).1, pattern(21));
    assert_eq!(bus.log[1], frame("585#4103200015000000"));
    assert_eq!(bus.read_block(VALUE).1, [1, 2, 3, 4, 5, 6, 7, 8]);
}

#[test]
fn a_value_is_written_by_block_as_a_whole() {
    let mut bus = block_bus(b"");
    bus.write(VALUE, &[8, 7, 6, 5, 4, 3, 2, 1]);
    assert_eq!(bus.od.value(VALUE), [8, 7, 6, 5, 4, 3, 2, 1]);
    let error = SdoError::Aborted { address: VALUE, code: AbortCode::LENGTH_TOO_HIGH };
    assert_eq!(bus.write(VALUE, &[0; 9]), Event::Failed(error));
}

#[test]
fn an_abort_of_the_server_is_reported_with_entry_and_code() {
    let error = SdoError::Aborted { address: FIXED, code: AbortCode::READ_ONLY };
    assert_eq!(bus(b"").write(FIXED, &[1, 2]), Event::Failed(error));
    assert_eq!(error.to_string(), "1018:01: the device aborts: 0601 0002: attempt to write a read only object");
}

// zencan 6 sends command 33h, which has no meaning.
#[test]
fn nothing_is_written_as_a_segment_without_bytes() {
    let mut bus = bus(b"old");
    assert_eq!(bus.write(DOMAIN, b""), Event::Done { address: DOMAIN, len: 0 });
    assert_eq!([bus.log[0], bus.log[2]], ["605#2103200000000000", "605#0F00000000000000"].map(frame));
    assert_eq!((bus.od.value(DOMAIN), bus.od.completed), (&b""[..], 1));
}

// oze-canopen sends c = 0 in the last segment, so that no transfer ends.
#[test]
fn the_last_segment_of_a_write_says_that_it_is_the_last() {
    for (len, command) in [(5, 0x05), (7, 0x01), (8, 0x1D), (14, 0x11)] {
        let mut bus = bus(b"");
        bus.write(DOMAIN, &pattern(len));
        assert_eq!(bus.log[bus.log.len() - 2].data()[0], command, "{len} bytes");
    }
}

#[test]
fn a_payload_that_is_too_small_ends_a_block_transfer() {
    for is_read in [true, false] {
        let mut bus = block_bus(&pattern(40));
        let (begun, error) = if is_read {
            (bus.client.read_block(bus.now, DOMAIN), SdoError::TooLong { address: DOMAIN, capacity: 20 })
        } else {
            (bus.client.write(bus.now, DOMAIN, 40), SdoError::TooShort { address: DOMAIN, len: 20 })
        };
        begun.unwrap();
        assert_eq!(bus.run(&mut [0_u8; 20], &mut |_, frame| vec![frame]), Event::Failed(error));
        bus.settle();
        assert_eq!(bus.write(DOMAIN, &pattern(40)), Event::Done { address: DOMAIN, len: 40 });
        assert_eq!(bus.read_block(DOMAIN).1, pattern(40));
    }
}

#[test]
fn what_is_announced_to_be_long_is_read_by_block() {
    for len in [0, 1, 4, 5, 29, 30, 31, 890, 5000] {
        let mut bus = bus(&pattern(len));
        bus.client = SdoClient::of_node(NODE).with_block_reads_from(30);
        let done = Event::Done { address: DOMAIN, len: len as u32 };
        for (hides_len, is_by_block) in [(false, len >= 30), (false, len >= 30), (true, false)] {
            bus.od.hides_len = hides_len;
            bus.log.clear();
            assert_eq!(bus.read(DOMAIN), (done, pattern(len)));
            bus.settle();
            assert_eq!(bus.log.contains(&frame("605#A40320007F150000")), is_by_block, "{len} bytes, {hides_len}");
        }
    }
}

// canopen-python #623: an answer next to a SYNC. Only the identifier and its data matter.
#[test]
fn a_sync_next_to_an_answer_changes_nothing() {
    let mut bus = bus(&pattern(40));
    bus.client.read(bus.now, DOMAIN).unwrap();
    let mut data = Growing(vec![]);
    let event = bus.run(&mut data, &mut |_, sent| vec![frame("080#"), sent, frame("080#05")]);
    assert_eq!((event, data.0), (Event::Done { address: DOMAIN, len: 40 }, pattern(40)));
}

/// An entry of three million bytes that are never in memory.
struct Megabytes {
    written: u32,
    ended: bool,
}

impl Megabytes {
    const LEN: u32 = 3_000_001;

    fn byte(offset: u32) -> u8 {
        (offset ^ offset >> 8 ^ offset >> 16) as u8
    }

    fn entry_of(address: Address) -> Entry {
        Od::default().with(address, DataType::Domain, Access::Rw, b"").entry(address).unwrap()
    }
}

impl ObjectDictionary for Megabytes {
    fn entry(&self, address: Address) -> Result<Entry, AbortCode> {
        Ok(Megabytes::entry_of(address))
    }

    fn len(&self, _: &Entry) -> Option<u32> {
        Some(Megabytes::LEN)
    }

    fn read(&mut self, _: &Entry, offset: u32, buffer: &mut [u8]) -> Result<usize, AbortCode> {
        Ok(self.load(offset, buffer))
    }

    fn write(&mut self, _: &Entry, offset: u32, data: &[u8], last: bool) -> Result<(), AbortCode> {
        assert_eq!(offset, self.written, "ascending and without gaps");
        self.store(offset, data);
        self.ended = last;
        Ok(())
    }
}

impl Payload for Megabytes {
    fn load(&mut self, offset: u32, buffer: &mut [u8]) -> usize {
        let end = Megabytes::LEN.min(offset + buffer.len() as u32);
        buffer.iter_mut().zip(offset..end).for_each(|(byte, offset)| *byte = Megabytes::byte(offset));
        (end - offset) as usize
    }

    fn store(&mut self, offset: u32, data: &[u8]) -> usize {
        assert!(data.iter().zip(offset..).all(|(byte, offset)| *byte == Megabytes::byte(offset)));
        self.written = offset + data.len() as u32;
        data.len()
    }
}

// CANopenNode #123: a write of 100 kB stalls.
#[test]
fn megabytes_stream_in_both_directions_and_are_never_in_memory() {
    for verb in ["read", "read by block", "write", "write by block"] {
        let blocks_from = if verb == "write by block" { 0 } else { u32::MAX };
        let mut client = SdoClient::of_node(NODE).with_block_writes_from(blocks_from);
        let mut server = SdoServer::of_node(NODE);
        let mut od = Megabytes { written: 0, ended: false };
        let mut payload = Megabytes { written: 0, ended: false };
        let now = Instant::ZERO;
        match verb {
            "read" => client.read(now, DOMAIN),
            "read by block" => client.read_block(now, DOMAIN),
            _ => client.write(now, DOMAIN, Megabytes::LEN),
        }
        .unwrap();
        let mut ended = None;
        while ended.is_none() {
            while let Some(frame) = client.poll_transmit(now, &mut payload) {
                server.handle_frame(now, &frame, &mut od);
            }
            while let Some(frame) = server.poll_transmit(now, &mut od) {
                ended = ended.or(client.handle_frame(now, &frame, &mut payload));
            }
        }
        assert_eq!(ended, Some(Event::Done { address: DOMAIN, len: Megabytes::LEN }), "{verb}");
        let (read, written) = (payload.written == Megabytes::LEN, od.written == Megabytes::LEN && od.ended);
        assert_eq!((read, written), (verb.starts_with("read"), verb.starts_with("write")), "{verb}");
    }
}
