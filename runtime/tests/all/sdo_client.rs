//! The frames that the client sends, and how it handles a server's answers. Other CANopen stacks got some of this
//! wrong: zencan 0.0.5, canopen-rs 0.6.1, canopen-sdo 0.2.0 and oze-canopen 0.1.0, where it was reproduced; and
//! canopen-python, CANopenNode and ros2_canopen, according to public threads. The comments say which.

use crate::sdo_support::{Growing, NODE, at, check_client, frame, pattern};
use lexican_runtime::object::Address;
use lexican_runtime::service::sdo_client::{Event, Scalar, SdoClient, SdoError};
use lexican_runtime::{AbortCode, Duration, Instant};

const DOMAIN: Address = at(0x2003, 0);
const POSITION: Address = at(0x607C, 0);
const NOW: Instant = Instant::ZERO;

fn reading(address: Address) -> SdoClient {
    let mut client = SdoClient::of_node(NODE);
    client.read(NOW, address).unwrap();
    client
}

fn reading_block() -> SdoClient {
    let mut client = SdoClient::of_node(NODE);
    client.read_block(NOW, DOMAIN).unwrap();
    client
}

fn writing_block(len: u32) -> SdoClient {
    let mut client = SdoClient::of_node(NODE).with_block_writes_from(0);
    client.write(NOW, DOMAIN, len).unwrap();
    client
}

/// A client that uses blocks from 30 bytes on.
fn by_size() -> SdoClient {
    SdoClient::of_node(NODE).with_block_writes_from(30).with_block_reads_from(30)
}

const fn done(len: u32) -> Option<Event> {
    Some(Event::Done { address: DOMAIN, len })
}

#[test]
fn the_examples_of_the_manual_are_sent_byte_for_byte() {
    let mut client = reading(POSITION);
    let mut value = Scalar::room_for::<i32>();
    let event = check_client(&mut client, &mut value, "407C6000 > 427C6000C409");
    assert_eq!((event, value.get()), (Some(Event::Done { address: POSITION, len: 4 }), Ok(2500_i32)));
    let mut value = Scalar::of(2_000_000_i32);
    client.write(NOW, at(0x607D, 2), value.len()).unwrap();
    let event = check_client(&mut client, &mut value, "237D600280841E00 > 607D6002");
    assert_eq!(event, Some(Event::Done { address: at(0x607D, 2), len: 4 }));
    // zencan 6 takes no data from an answer that does not indicate the number of bytes.
    let mut value = Scalar::room_for::<u16>();
    let event = check_client(&mut reading(DOMAIN), &mut value, "40032000 > 42032000E803");
    assert_eq!((event, value.get()), (done(2), Ok(1000_u16)));
}

#[test]
fn values_are_padded_to_four_bytes_for_devices_that_take_no_fewer() {
    let mut client = SdoClient::of_node(NODE).with_always_four_bytes(true);
    let mut value = Scalar::of(0x0807_u16);
    client.write(NOW, DOMAIN, value.len()).unwrap();
    assert_eq!(check_client(&mut client, &mut value, "230320000708 > 60032000"), done(2));
}

#[test]
fn a_value_that_has_another_size_than_the_device_sends_is_an_error() {
    let mut client = reading(POSITION);
    let mut value = Scalar::room_for::<u16>();
    // There is nothing left to abort.
    let event = check_client(&mut client, &mut value, "407C6000 > 437C6000C409\n >");
    assert_eq!(event, Some(Event::Failed(SdoError::TooLong { address: POSITION, capacity: 2 })));
    client.read(NOW, DOMAIN).unwrap();
    assert_eq!(check_client(&mut client, &mut value, "40032000 > 4F03200001"), done(1));
    assert!(value.get::<u16>().is_err());
}

// zencan 6; also canopen-python #125 and #143, where threads get each other's answers.
#[test]
fn an_answer_for_another_entry_is_ignored() {
    let mut value = Scalar::room_for::<u16>();
    let script = "
        40032000 > 4B042000FFFF
        > 4B032001FFFF
        > 8004200000000206
        > 4104200008
        > 4B032000E803
        >";
    assert_eq!(check_client(&mut reading(DOMAIN), &mut value, script), done(2));
    assert_eq!(value.get(), Ok(1000_u16));
}

#[test]
fn one_transfer_at_a_time() {
    let busy = reading(DOMAIN).write(NOW, POSITION, 1).unwrap_err();
    assert_eq!(busy.to_string(), "2003:00: an SDO transfer is still under way");
}

#[test]
fn a_server_that_was_asked_for_nothing_yet_is_sent_no_abort() {
    let mut client = reading(DOMAIN);
    client.abort(AbortCode::GENERAL);
    check_client(&mut client, &mut [0; 0], ">");
    // The abort of the previous transfer is sent all the same.
    client.read(NOW, DOMAIN).unwrap();
    check_client(&mut client, &mut [0; 0], "40032000 >");
    client.abort(AbortCode::GENERAL);
    client.read(NOW, POSITION).unwrap();
    client.abort(AbortCode::GENERAL);
    check_client(&mut client, &mut [0; 0], "8003200000000008 >");
}

// zencan 6. ros2_canopen #194: the time-out cannot be set.
#[test]
fn a_client_that_waits_no_longer_sends_an_abort() {
    for patience_us in [1_000_000, 70_000] {
        let mut client = SdoClient::of_node(NODE).with_timeout(Duration::from_micros(patience_us));
        client.read(NOW, DOMAIN).unwrap();
        check_client(&mut client, &mut [0; 0], "40032000 >");
        let deadline = Instant::from_micros(patience_us);
        assert_eq!(client.poll_timeout(), Some(deadline));
        assert_eq!(client.handle_timeout(deadline - Duration::from_micros(1)), None);
        let timed_out = Event::Failed(SdoError::TimedOut { address: DOMAIN });
        assert_eq!(client.handle_timeout(deadline), Some(timed_out));
        check_client(&mut client, &mut [0; 0], "8003200000000405 >\n >");
    }
    assert_eq!(reading(DOMAIN).poll_timeout(), Some(NOW + Duration::from_secs(1)), "unless it is set");
}

// canopen-rs 5: a dead node never timed out on a busy bus.
#[test]
fn frames_of_others_do_not_make_a_client_wait_longer() {
    let mut client = reading(DOMAIN);
    check_client(&mut client, &mut [0; 0], "40032000 >");
    let deadline = client.poll_timeout();
    for us in 0..1_000 {
        let now = Instant::from_micros(us * 1_000);
        client.handle_frame(now, &frame("185#0102030405060708"), &mut [0_u8; 0]);
        client.handle_frame(now, &frame("585#4B181000FFFF0000"), &mut [0_u8; 0]);
    }
    assert_eq!(client.poll_timeout(), deadline);
}

// canopen-sdo reserves what the server announces, up to 4 GiB.
#[test]
fn an_announced_size_is_not_trusted() {
    for (announced, segment, code, abort) in [
        ("FFFFFFFF", "0701020304", AbortCode::LENGTH_TOO_LOW, "8003200013000706 >"),
        ("02", "09010203", AbortCode::LENGTH_TOO_HIGH, "8003200012000706 >"),
    ] {
        let script = format!("40032000 > 41032000{announced}\n 60 > {segment}\n");
        let (mut client, mut data) = (reading(DOMAIN), [0; 4]);
        let violation = SdoError::Violation { address: DOMAIN, code };
        assert_eq!(check_client(&mut client, &mut data, &script), Some(Event::Failed(violation)));
        check_client(&mut client, &mut data, abort);
    }
}

// oze-canopen.
#[test]
fn a_segmented_read_need_not_announce_its_size() {
    let mut data = Growing(vec![]);
    let event = check_client(&mut reading(DOMAIN), &mut data, "40032000 > 40032000\n 60 > 0768656C6C");
    assert_eq!((event, &data.0[..]), (done(4), &b"hell"[..]));
}

#[test]
fn a_server_may_answer_a_block_request_with_segments() {
    let mut data = [1, 2, 3, 4, 5];
    for script in [
        // It does not support blocks,
        "A40320007F15 > 8003200001000405\n 40032000 > 4103200005\n 60 > 050102030405",
        // or it has few bytes.
        "A40320007F15 > 4103200005\n 60 > 050102030405",
    ] {
        assert_eq!(check_client(&mut reading_block(), &mut data, script), done(5));
    }
    assert_eq!(check_client(&mut reading_block(), &mut data, "A40320007F15 > 4303200001020304"), done(4));
    for script in [
        "C603200005 > 8003200001000405\n 2103200005 > 60032000\n 050102030405 > 20",
        "C603200005 > 60032000\n 050102030405 > 20",
    ] {
        assert_eq!(check_client(&mut writing_block(5), &mut data, script), done(5));
    }
}

#[test]
fn other_refusals_of_a_block_request_are_final() {
    let event = check_client(&mut reading_block(), &mut [0; 8], "A40320007F15 > 8003200000000206");
    let error = SdoError::Aborted { address: DOMAIN, code: AbortCode::NO_SUCH_OBJECT };
    assert_eq!(event, Some(Event::Failed(error)));
}

// zencan 6; canopen-python #312: no retransmission.
#[test]
fn segments_that_are_sent_again_are_numbered_from_one() {
    let script = "
        C603200015 > A40320007F
        01AAAAAAAAAAAAAA 02AAAAAAAAAAAAAA 83AAAAAAAAAAAAAA > A2010A
        01AAAAAAAAAAAAAA 82AAAAAAAAAAAAAA > A20001
        01AAAAAAAAAAAAAA > A20101
        81AAAAAAAAAAAAAA > A20101
        C17092 > A1";
    assert_eq!(check_client(&mut writing_block(21), &mut [0xAA; 21], script), done(21));
}

// zencan 6, according to its own note.
#[test]
fn a_gap_in_a_block_is_noticed_at_its_end() {
    let mut data = [0; 21];
    let script = "
        A40320007F15 > C203200015
        A3 > 0101010101010101
        > 8303030303030303
        A2017F > 0102020202020202
        > 8203030303030303
        A2027F > C1
        A1 >";
    assert_eq!(check_client(&mut reading_block(), &mut data, script), done(21));
    assert_eq!(data, [1, 1, 1, 1, 1, 1, 1, 2, 2, 2, 2, 2, 2, 2, 3, 3, 3, 3, 3, 3, 3]);
}

// canopen-python #618: a block write without a checksum ends with DDh 00h if the data come in portions.
#[test]
fn a_block_write_without_checksum_ends_with_its_own_number_of_unused_bytes() {
    let script = "C60320000A > A00320007F\n 01AAAAAAAAAAAAAA 82AAAAAA > A2027F\n D1 > A1";
    assert_eq!(check_client(&mut writing_block(10), &mut [0xAA; 10], script), done(10));
}

// CANopenNode #426: a server confirms a block before its end.
#[test]
fn a_block_may_be_confirmed_before_its_end() {
    let (mut client, mut data) = (writing_block(42), pattern(42));
    let mut payload = &mut data[..];
    client.poll_transmit(NOW, &mut payload).unwrap();
    client.handle_frame(NOW, &frame("585#A40320007F000000"), &mut payload);
    for sequence in 1..=4 {
        assert_eq!(client.poll_transmit(NOW, &mut payload).unwrap().data()[0], sequence);
    }
    // The server has received three of four segments, and asks to continue after these.
    client.handle_frame(NOW, &frame("585#A2037F0000000000"), &mut payload);
    let next = client.poll_transmit(NOW, &mut payload).unwrap();
    assert_eq!((next.data()[0], &next.data()[1..]), (1, &pattern(42)[21..28]));
}

/// The server is silent: the time-out ends, and the client tries another way.
fn time_passes(client: &mut SdoClient) {
    let deadline = client.poll_timeout().unwrap();
    assert_eq!(client.handle_timeout(deadline), None);
}

#[test]
fn a_server_that_begins_no_block_read_is_asked_for_segments_from_then_on() {
    let segments = "
        40032000 > 4103200020
        60 > 0001020304050607
        70 > 1001020304050607
        60 > 0001020304050607
        70 > 1001020304050607
        60 > 0701020304";
    // The server aborts with some code, or is silent.
    for refusal in ["8003200001000405", "8003200000000008", ""] {
        let (mut client, mut data) = (by_size(), [0; 40]);
        client.read(NOW, DOMAIN).unwrap();
        let script = format!("40032000 > 4103200020\n 8003200000000008 A40320007F15 > {refusal}");
        assert_eq!(check_client(&mut client, &mut data, &script), None);
        if refusal.is_empty() {
            time_passes(&mut client);
        }
        for _ in 0..2 {
            assert_eq!(check_client(&mut client, &mut data, segments), done(32));
            client.read(NOW, DOMAIN).unwrap();
        }
    }
}

#[test]
fn a_server_that_begins_no_block_write_gets_segments_from_then_on() {
    let segments = "
        210320001E > 60032000
        0007070707070707 > 20
        1007070707070707 > 30
        0007070707070707 > 20
        1007070707070707 > 30
        0B0707 > 20";
    for refusal in ["8003200001000405", ""] {
        let (mut client, mut data) = (by_size(), [7; 30]);
        client.write(NOW, DOMAIN, 30).unwrap();
        assert_eq!(check_client(&mut client, &mut data, &format!("C60320001E > {refusal}")), None);
        if refusal.is_empty() {
            time_passes(&mut client);
        }
        for _ in 0..2 {
            assert_eq!(check_client(&mut client, &mut data, segments), done(30));
            client.write(NOW, DOMAIN, 30).unwrap();
        }
    }
}

#[test]
fn a_dead_node_does_not_count_as_one_without_blocks() {
    let (mut client, mut data) = (by_size(), [7; 30]);
    client.write(Instant::ZERO, DOMAIN, 30).unwrap();
    client.poll_transmit(Instant::ZERO, &mut data);
    let mut ended = None;
    while ended.is_none() {
        let now = client.poll_timeout().unwrap();
        ended = client.handle_timeout(now);
        client.poll_transmit(now, &mut data);
    }
    assert_eq!(ended, Some(Event::Failed(SdoError::TimedOut { address: DOMAIN })));
    client.write(Instant::ZERO, DOMAIN, 30).unwrap();
    assert_eq!(client.poll_transmit(Instant::ZERO, &mut data), Some(frame("605#C60320001E000000")));
}

/// How long a transfer lasts with a server that gives the same answers to every request, each after 100 ms; and how it
/// ends.
fn stalling(mut client: SdoClient, answers: &[&str]) -> (Duration, Event) {
    let (mut now, mut data) = (Instant::ZERO, [0; 64]);
    let mut at = answers.iter().cycle();
    for _ in 0..100_000 {
        while client.poll_transmit(now, &mut data).is_some() {}
        let deadline = client.poll_timeout().unwrap();
        let answer = now + Duration::from_millis(100);
        now = deadline.min(answer);
        let event = match deadline <= answer {
            true => client.handle_timeout(now),
            false => client.handle_frame(now, &frame(at.next().unwrap()), &mut data),
        };
        if let Some(event) = event {
            return (now.since(Instant::ZERO), event);
        }
    }
    panic!("the transfer never ends");
}

#[test]
fn a_transfer_that_makes_no_progress_ends() {
    let stalled = Event::Failed(SdoError::Stalled { address: DOMAIN });
    let begun = |mut client: SdoClient, first: &str, read: bool| {
        let now = Instant::ZERO;
        if read { client.read(now, DOMAIN) } else { client.write(now, DOMAIN, 60) }.unwrap();
        client.poll_transmit(now, &mut [0; 64]);
        client.handle_frame(now, &frame(first), &mut [0; 64]);
        client
    };
    let ten_seconds = Duration::from_secs(10);
    // Segments without data.
    let client = begun(SdoClient::of_node(NODE), "585#4003200000000000", true);
    assert_eq!(stalling(client, &["585#0E00000000000000", "585#1E00000000000000"]), (ten_seconds, stalled));
    // Always the first segment of a block.
    let mut client = begun(by_size(), "585#4103200040000000", true);
    while client.poll_transmit(Instant::ZERO, &mut [0; 64]).is_some() {}
    client.handle_frame(Instant::ZERO, &frame("585#C603200040000000"), &mut [0; 64]);
    let (lasted, event) = stalling(client, &["585#0101020304050607"]);
    assert_eq!(event, stalled);
    assert!(lasted > ten_seconds && lasted < Duration::from_millis(10_200), "{lasted:?}: seven bytes came");
    // No segment of a block is ever confirmed.
    let client = begun(by_size(), "585#A40320007F000000", false);
    let (lasted, event) = stalling(client, &["585#A2007F0000000000"]);
    assert!(matches!(event, Event::Failed(_)) && lasted <= ten_seconds, "{event:?}");
}

#[test]
fn a_slow_transfer_that_makes_progress_does_not_end() {
    let mut client = SdoClient::of_node(NODE);
    let (mut now, mut data) = (Instant::ZERO, vec![0; 7000]);
    client.read(now, DOMAIN).unwrap();
    client.poll_transmit(now, &mut &mut data[..]);
    client.handle_frame(now, &frame("585#4003200000000000"), &mut &mut data[..]);
    // Each segment takes a tenth of the time-out.
    for toggle in [0x00, 0x10].into_iter().cycle().take(999) {
        assert!(client.poll_transmit(now, &mut &mut data[..]).is_some());
        now += Duration::from_millis(100);
        assert!(client.poll_timeout().unwrap() > now);
        let segment = frame(&format!("585#{toggle:02X}01020304050607"));
        assert_eq!(client.handle_frame(now, &segment, &mut &mut data[..]), None);
    }
}
