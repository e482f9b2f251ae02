//! What other CANopen stacks got wrong, each as a test that this one must pass. The defects were reproduced with
//! zencan 0.0.5, canopen-rs 0.6.1, canopen-sdo 0.2.0, oze-canopen 0.1.0, or are reported in public threads of
//! canopen-python and CANopenNode; the comment says where.

mod sdo_support;

use lexican_runtime::object::{Access, Address, DataType, Entry, ObjectDictionary};
use lexican_runtime::service::sdo_client::{Event, Payload, Scalar, SdoClient, SdoError};
use lexican_runtime::service::sdo_server::{self, SdoServer};
use lexican_runtime::{AbortCode, Duration, Frame, Instant};
use sdo_support::{Bus, Growing, NODE, Od, at, frame, pattern};

const TEXT: Address = at(0x1008, 0);

fn dictionary(text: &[u8]) -> Od {
    Od::default()
        .with(TEXT, DataType::VisibleString, Access::Rw, text)
        .with(at(0x1017, 0), DataType::Unsigned16, Access::Rw, &[0, 0])
        .with(at(0x1018, 1), DataType::Unsigned32, Access::Ro, &[1, 2, 3, 4])
        .with(at(0x1A00, 0), DataType::Unsigned8, Access::Rw, &[0])
}

fn bus(text: &[u8]) -> Bus {
    Bus::new(dictionary(text))
}

fn data_of(frame: Option<Frame>) -> Vec<u8> {
    frame.expect("there is a frame").data().to_vec()
}

/// One request to a server, and its answer.
fn ask(server: &mut SdoServer, od: &mut Od, request: &str) -> Vec<u8> {
    server.handle_frame(Instant::ZERO, &frame(request), od);
    data_of(server.poll_transmit(Instant::ZERO, od))
}

/// A client that has just sent its request to read.
fn reading(address: Address) -> SdoClient {
    let mut client = SdoClient::of_node(NODE);
    client.read(Instant::ZERO, address).unwrap();
    client.poll_transmit(Instant::ZERO, &mut [0_u8; 0]).unwrap();
    client
}

// zencan 1: index out of bounds.
#[test]
fn an_empty_segmented_write_of_a_value_is_refused_without_a_panic() {
    let (mut server, mut od) = (SdoServer::of_node(NODE), dictionary(b""));
    assert_eq!(ask(&mut server, &mut od, "605#20001A0000000000"), frame("585#60001A0000000000").data());
    assert_eq!(ask(&mut server, &mut od, "605#0F00000000000000"), frame("585#80001A0013000706").data());
}

// zencan 2: slice out of range.
#[test]
fn an_empty_text_is_read_by_block_without_a_panic() {
    let mut bus = bus(b"");
    let (mut server, mut od) = (bus.server.clone(), bus.od.clone());
    assert_eq!(ask(&mut server, &mut od, "605#A00810007F000000"), frame("585#C608100000000000").data());
    assert_eq!(ask(&mut server, &mut od, "605#A300000000000000"), frame("585#8100000000000000").data());
    assert_eq!(ask(&mut server, &mut od, "605#A2017F0000000000"), frame("585#DD00000000000000").data());
    assert_eq!(bus.read_block(TEXT), (Event::Done { address: TEXT, len: 0 }, vec![]));
}

// zencan 3: seven unused bytes instead of none.
#[test]
fn a_block_read_of_a_multiple_of_seven_bytes_has_no_unused_bytes() {
    for len in [28, 7 * 127, 7 * 128] {
        let mut bus = bus(&pattern(len));
        assert_eq!(bus.read_block(TEXT), (Event::Done { address: TEXT, len: len as u32 }, pattern(len)));
        assert_eq!(bus.log.last().unwrap().data()[0], 0xC1);
    }
}

// zencan 4: the end was answered by an abort, which failed the next transfer.
#[test]
fn the_end_of_a_block_read_is_not_answered() {
    let mut bus = bus(&pattern(30));
    bus.read_block(TEXT);
    bus.settle();
    assert_eq!(bus.log.last().unwrap().data()[0], 0xA1);
    assert_eq!(bus.read(at(0x1018, 1)).1, [1, 2, 3, 4]);
}

// zencan 6: e = 1, s = 0 gave no data. The AG03/1 answers so, by the example of its manual.
#[test]
fn an_answer_that_does_not_tell_the_number_of_bytes_has_data() {
    let mut client = reading(at(0x1017, 0));
    let mut value = Scalar::room_for::<u16>();
    let event = client.handle_frame(Instant::ZERO, &frame("585#42171000E8030000"), &mut value);
    assert_eq!(event, Some(Event::Done { address: at(0x1017, 0), len: 2 }));
    assert_eq!(value.get(), Ok(1000_u16));
}

// zencan 6; also canopen-python #125 and #143, where threads get each other's answers.
#[test]
fn an_answer_for_another_entry_is_ignored() {
    let mut client = reading(at(0x1017, 0));
    let mut value = Scalar::room_for::<u16>();
    for foreign in ["585#4B181000FFFF0000", "585#4B171001FFFF0000", "585#8018100000000206", "585#4118100008000000"] {
        assert_eq!(client.handle_frame(Instant::ZERO, &frame(foreign), &mut value), None, "{foreign}");
        assert_eq!(client.poll_transmit(Instant::ZERO, &mut value), None, "{foreign}");
    }
    client.handle_frame(Instant::ZERO, &frame("585#4B171000E8030000"), &mut value).expect("the right answer");
    assert_eq!(value.get(), Ok(1000_u16));
}

// zencan 6.
#[test]
fn a_client_that_waits_no_longer_sends_an_abort() {
    let mut client = reading(at(0x1017, 0));
    let deadline = client.poll_timeout().expect("it waits");
    assert_eq!(deadline, Instant::ZERO + Duration::from_secs(1));
    assert_eq!(client.handle_timeout(Instant::from_micros(999_999)), None);
    let timed_out = Event::Failed(SdoError::TimedOut { address: at(0x1017, 0) });
    assert_eq!(client.handle_timeout(deadline), Some(timed_out));
    let sent = client.poll_transmit(deadline, &mut [0_u8; 0]);
    assert_eq!(sent, Some(frame("605#8017100000000405")));
    assert_eq!(client.poll_transmit(deadline, &mut [0_u8; 0]), None);
}

// zencan 6: command 33h, which means nothing. canopen-sdo refuses to write nothing.
#[test]
fn nothing_is_written_as_a_segment_without_bytes() {
    let mut bus = bus(b"old");
    assert_eq!(bus.write(TEXT, b""), Event::Done { address: TEXT, len: 0 });
    let sent: Vec<_> = bus.log.iter().map(|frame| frame.data().to_vec()).collect();
    assert_eq!(sent[0], frame("605#2108100000000000").data());
    assert_eq!(sent[2], frame("605#0F00000000000000").data());
    assert_eq!((bus.od.value(TEXT), bus.od.completed), (&b""[..], 1));
}

// zencan 6; canopen-python #312: no retransmission.
#[test]
fn segments_that_are_sent_again_are_numbered_from_one() {
    let mut client = SdoClient::of_node(NODE).with_block_writes_from(0);
    let mut data = [0xAA; 21];
    client.write(Instant::ZERO, TEXT, 21).unwrap();
    let mut sent = |response: &str| {
        client.handle_frame(Instant::ZERO, &frame(response), &mut data);
        core::iter::from_fn(|| client.poll_transmit(Instant::ZERO, &mut data)).map(|f| f.data()[0]).collect::<Vec<_>>()
    };
    assert_eq!(sent("585#00"), [0xC6]);
    assert_eq!(sent("585#A40810007F000000"), [0x01, 0x02, 0x83]);
    assert_eq!(sent("585#A2010A0000000000"), [0x01, 0x82]);
    assert_eq!(sent("585#A200010000000000"), [0x01]);
    assert_eq!(sent("585#A201010000000000"), [0x81]);
    assert_eq!(sent("585#A201010000000000"), [0xC1]);
}

// zencan 6, by its own note.
#[test]
fn a_gap_in_a_block_is_noticed_at_its_end() {
    let mut client = SdoClient::of_node(NODE);
    client.read_block(Instant::ZERO, TEXT).unwrap();
    let mut data = [0; 21];
    let mut sent = |response: &str| {
        client.handle_frame(Instant::ZERO, &frame(response), &mut data);
        client.poll_transmit(Instant::ZERO, &mut data).map(|frame| frame.data()[..2].to_vec())
    };
    assert_eq!(sent("585#00"), Some(vec![0xA4, 0x08]));
    assert_eq!(sent("585#C208100015000000"), Some(vec![0xA3, 0]));
    assert_eq!(sent("585#0101010101010101"), None);
    assert_eq!(sent("585#8303030303030303"), Some(vec![0xA2, 1]));
    assert_eq!(sent("585#0102020202020202"), None);
    assert_eq!(sent("585#8203030303030303"), Some(vec![0xA2, 2]));
    assert_eq!(sent("585#C100000000000000"), Some(vec![0xA1, 0]));
    assert_eq!(data, [1, 1, 1, 1, 1, 1, 1, 2, 2, 2, 2, 2, 2, 2, 3, 3, 3, 3, 3, 3, 3]);
}

// zencan 7: silence.
#[test]
fn a_command_that_is_not_known_is_answered() {
    let (mut server, mut od) = (SdoServer::of_node(NODE), dictionary(b""));
    assert_eq!(ask(&mut server, &mut od, "605#E017100000000000"), frame("585#8017100001000405").data());
}

// zencan 7: refused.
#[test]
fn a_write_without_the_number_of_bytes_is_taken() {
    let (mut server, mut od) = (SdoServer::of_node(NODE), dictionary(b""));
    assert_eq!(ask(&mut server, &mut od, "605#22171000E8030000"), frame("585#6017100000000000").data());
    assert_eq!(od.value(at(0x1017, 0)), [0xE8, 0x03]);
}

// zencan 7: 25 ms, fixed. ros2_canopen #194: not to be set.
#[test]
fn both_sides_wait_as_long_as_they_are_told() {
    let patience = Duration::from_millis(70);
    let mut server = SdoServer::of_node(NODE).with_timeout(patience);
    let mut od = dictionary(b"some text");
    ask(&mut server, &mut od, "605#4008100000000000");
    assert_eq!(server.poll_timeout(), Some(Instant::ZERO + patience));
    let mut client = SdoClient::of_node(NODE).with_timeout(patience);
    client.read(Instant::ZERO, TEXT).unwrap();
    assert_eq!(client.poll_timeout(), Some(Instant::ZERO + patience));
}

// canopen-rs 4.
#[test]
fn a_missing_sub_index_is_told_from_a_missing_object() {
    let (mut server, mut od) = (SdoServer::of_node(NODE), dictionary(b""));
    assert_eq!(ask(&mut server, &mut od, "605#4018100900000000"), frame("585#8018100911000906").data());
    assert_eq!(ask(&mut server, &mut od, "605#4019100000000000"), frame("585#8019100000000206").data());
}

// canopen-rs 4.
#[test]
fn a_segmented_write_need_not_tell_its_size() {
    let (mut server, mut od) = (SdoServer::of_node(NODE), dictionary(b"old text"));
    assert_eq!(ask(&mut server, &mut od, "605#2008100000000000"), frame("585#6008100000000000").data());
    assert_eq!(ask(&mut server, &mut od, "605#096E657700000000"), frame("585#2000000000000000").data());
    assert_eq!(od.value(TEXT), b"new");
}

// canopen-rs 4: objects of at most 32 bytes.
#[test]
fn an_object_may_have_more_than_32_bytes() {
    let mut bus = bus(b"");
    assert_eq!(bus.write(TEXT, &pattern(33)), Event::Done { address: TEXT, len: 33 });
    assert_eq!(bus.read(TEXT).1, pattern(33));
}

// canopen-rs 4.
#[test]
fn a_request_of_less_than_eight_bytes_is_none() {
    let (mut server, mut od) = (SdoServer::of_node(NODE), dictionary(b""));
    for request in ["605#40181001", "605#2B171000E803", "605#401810010000", "605#"] {
        assert_eq!(server.handle_frame(Instant::ZERO, &frame(request), &mut od), None);
        assert_eq!(server.poll_transmit(Instant::ZERO, &mut od), None);
    }
    assert_eq!(od.value(at(0x1017, 0)), [0, 0]);
}

// canopen-rs 5: a dead node never timed out on a busy bus.
#[test]
fn frames_of_others_do_not_make_a_client_wait_longer() {
    let mut client = reading(at(0x1017, 0));
    let deadline = client.poll_timeout();
    for us in 0..1_000 {
        let now = Instant::from_micros(us * 1_000);
        client.handle_frame(now, &frame("185#0102030405060708"), &mut [0_u8; 0]);
        client.handle_frame(now, &frame("585#4B181000FFFF0000"), &mut [0_u8; 0]);
    }
    assert_eq!(client.poll_timeout(), deadline);
}

// canopen-sdo: reserves what the server announces, up to 4 GiB.
#[test]
fn an_announced_size_is_not_trusted() {
    let mut client = reading(TEXT);
    let mut data = [0; 4];
    client.handle_frame(Instant::ZERO, &frame("585#41081000FFFFFFFF"), &mut data);
    client.poll_transmit(Instant::ZERO, &mut data).unwrap();
    // Less comes than was announced,
    let event = client.handle_frame(Instant::ZERO, &frame("585#0701020304000000"), &mut data);
    let violation = SdoError::Violation { address: TEXT, code: AbortCode::LENGTH_TOO_LOW };
    assert_eq!(event, Some(Event::Failed(violation)));
    assert_eq!(data_of(client.poll_transmit(Instant::ZERO, &mut data)), frame("605#8008100013000706").data());
    // or more.
    let mut client = reading(TEXT);
    client.handle_frame(Instant::ZERO, &frame("585#4108100002000000"), &mut data);
    client.poll_transmit(Instant::ZERO, &mut data).unwrap();
    let event = client.handle_frame(Instant::ZERO, &frame("585#0901020300000000"), &mut data);
    let violation = SdoError::Violation { address: TEXT, code: AbortCode::LENGTH_TOO_HIGH };
    assert_eq!(event, Some(Event::Failed(violation)));
}

// oze-canopen: c = 0 in the last segment, so that no transfer ends.
#[test]
fn the_last_segment_of_a_write_says_that_it_is_the_last() {
    for (len, command) in [(5, 0x05), (7, 0x01), (8, 0x1D), (14, 0x11)] {
        let mut bus = bus(b"");
        bus.write(TEXT, &pattern(len));
        assert_eq!(bus.log[bus.log.len() - 2].data()[0], command, "{len} bytes");
    }
}

// oze-canopen.
#[test]
fn a_segmented_read_need_not_tell_its_size() {
    let mut client = reading(TEXT);
    let mut data = Growing(vec![]);
    client.handle_frame(Instant::ZERO, &frame("585#4008100000000000"), &mut data);
    assert_eq!(data_of(client.poll_transmit(Instant::ZERO, &mut data)), frame("605#6000000000000000").data());
    let event = client.handle_frame(Instant::ZERO, &frame("585#0768656C6C000000"), &mut data);
    assert_eq!((event, &data.0[..]), (Some(Event::Done { address: TEXT, len: 4 }), &b"hell"[..]));
}

// canopen-python #618: a block write without a checksum ends with DDh 00h when it comes in portions.
#[test]
fn a_block_write_without_checksum_ends_with_its_own_number_of_unused_bytes() {
    let mut client = SdoClient::of_node(NODE).with_block_writes_from(0);
    let mut data = [0xAA; 10];
    client.write(Instant::ZERO, TEXT, 10).unwrap();
    let mut sent = |response: &str| {
        client.handle_frame(Instant::ZERO, &frame(response), &mut data);
        core::iter::from_fn(|| client.poll_transmit(Instant::ZERO, &mut data)).last().map(|frame| frame.data().to_vec())
    };
    sent("585#00");
    assert_eq!(sent("585#A00810007F000000"), Some(frame("605#82AAAAAA00000000").data().to_vec()));
    assert_eq!(sent("585#A2027F0000000000"), Some(frame("605#D100000000000000").data().to_vec()));
}

// CANopenNode #39, found by the conformance test: the request after a block read was dropped.
#[test]
fn a_request_right_after_the_end_of_a_block_read_is_answered() {
    let (mut server, mut od) = (SdoServer::of_node(NODE), dictionary(&pattern(30)));
    ask(&mut server, &mut od, "605#A00810007F000000");
    server.handle_frame(Instant::ZERO, &frame("605#A300000000000000"), &mut od);
    while server.poll_transmit(Instant::ZERO, &mut od).is_some() {}
    ask(&mut server, &mut od, "605#A2057F0000000000");
    let event = server.handle_frame(Instant::ZERO, &frame("605#A100000000000000"), &mut od);
    assert_eq!(event, Some(sdo_server::Event::Read(TEXT)));
    assert_eq!(ask(&mut server, &mut od, "605#4018100100000000"), frame("585#4318100101020304").data());
}

// CANopenNode #426: a server confirms a block before its end.
#[test]
fn a_block_may_be_confirmed_before_its_end() {
    let mut client = SdoClient::of_node(NODE).with_block_writes_from(0);
    let mut data = pattern(42);
    let mut payload = &mut data[..];
    client.write(Instant::ZERO, TEXT, 42).unwrap();
    client.poll_transmit(Instant::ZERO, &mut payload).unwrap();
    client.handle_frame(Instant::ZERO, &frame("585#A40810007F000000"), &mut payload);
    for sequence in 1..=4 {
        assert_eq!(data_of(client.poll_transmit(Instant::ZERO, &mut payload))[0], sequence);
    }
    // The server has got three of the four, and asks to begin anew after these.
    client.handle_frame(Instant::ZERO, &frame("585#A2037F0000000000"), &mut payload);
    let next = data_of(client.poll_transmit(Instant::ZERO, &mut payload));
    assert_eq!((next[0], &next[1..]), (1, &pattern(42)[21..28]));
}

// canopen-python #623: an answer next to a SYNC. Nothing but the identifier and its data count.
#[test]
fn a_sync_next_to_an_answer_changes_nothing() {
    let mut bus = bus(&pattern(40));
    bus.client.read(bus.now, TEXT).unwrap();
    let mut data = Growing(vec![]);
    let event = bus.run(&mut data, &mut |_, sent| vec![frame("080#"), sent, frame("080#05")]);
    assert_eq!((event, data.0), (Event::Done { address: TEXT, len: 40 }, pattern(40)));
}

/// An entry of three million bytes, which nobody holds.
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
fn megabytes_stream_in_both_directions_and_nobody_holds_them() {
    for verb in ["read", "read by block", "write", "write by block"] {
        let blocks_from = if verb == "write by block" { 0 } else { u32::MAX };
        let mut client = SdoClient::of_node(NODE).with_block_writes_from(blocks_from);
        let mut server = SdoServer::of_node(NODE);
        let mut od = Megabytes { written: 0, ended: false };
        let mut payload = Megabytes { written: 0, ended: false };
        let now = Instant::ZERO;
        match verb {
            "read" => client.read(now, TEXT),
            "read by block" => client.read_block(now, TEXT),
            _ => client.write(now, TEXT, Megabytes::LEN),
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
        assert_eq!(ended, Some(Event::Done { address: TEXT, len: Megabytes::LEN }), "{verb}");
        let (read, written) = (payload.written == Megabytes::LEN, od.written == Megabytes::LEN && od.ended);
        assert_eq!((read, written), (verb.starts_with("read"), verb.starts_with("write")), "{verb}");
    }
}
