//! Transfers between the client and the server of the runtime, without faults.

mod sdo_support;

use lexican_runtime::object::{Access, DataType};
use lexican_runtime::service::sdo_client::{Event, Scalar, SdoClient, SdoError};
use lexican_runtime::service::sdo_server::{self, SdoServer, SizesIndicated};
use lexican_runtime::{AbortCode, Frame, Instant};
use sdo_support::{Bus, NODE, Od, at, frame, pattern};

fn dictionary() -> Od {
    Od::default()
        .with(at(0x607C, 0), DataType::Integer32, Access::Rw, &2500_i32.to_le_bytes())
        .with(at(0x607D, 1), DataType::Integer32, Access::Rw, &[0; 4])
        .with(at(0x607D, 2), DataType::Integer32, Access::Rw, &[0; 4])
        .with(at(0x2000, 1), DataType::Unsigned8, Access::Rw, &[1])
        .with(at(0x2000, 2), DataType::Unsigned16, Access::Rw, &[1, 2])
        .with(at(0x2000, 3), DataType::Unsigned24, Access::Rw, &[1, 2, 3])
        .with(at(0x2000, 8), DataType::Unsigned64, Access::Rw, &[1, 2, 3, 4, 5, 6, 7, 8])
        .with(at(0x2001, 0), DataType::Unsigned16, Access::Ro, &[1, 2])
        .with(at(0x2002, 0), DataType::Unsigned16, Access::Wo, &[1, 2])
        .with(at(0x2003, 0), DataType::Domain, Access::Rw, b"")
        .with_capacity(at(0x2004, 0), DataType::VisibleString, 16, b"as it was")
}

/// Requests and the answers of a server; a request without an answer is followed by another one.
#[track_caller]
fn check_server(server: SdoServer, script: &[(&str, &str)]) -> Od {
    let (mut server, mut od) = (server, dictionary());
    for (request, response) in script {
        server.handle_frame(Instant::ZERO, &frame(request), &mut od);
        let expected = (!response.is_empty()).then(|| frame(response));
        assert_eq!(server.poll_transmit(Instant::ZERO, &mut od), expected, "the answer to {request}");
    }
    od
}

fn server() -> SdoServer {
    SdoServer::of_node(NODE)
}

#[test]
fn the_examples_of_the_manual_are_answered_byte_for_byte() {
    let od = check_server(
        server().with_sizes_indicated(SizesIndicated::NONE),
        &[("605#407C600000000000", "585#427C6000C4090000"), ("605#237D600280841E00", "585#607D600200000000")],
    );
    assert_eq!(od.value(at(0x607D, 2)), 2_000_000_i32.to_le_bytes());
}

#[test]
fn the_examples_of_the_manual_are_sent_byte_for_byte() {
    let mut client = SdoClient::of_node(NODE);
    let mut value = Scalar::room_for::<i32>();
    client.read(Instant::ZERO, at(0x607C, 0)).unwrap();
    assert_eq!(client.poll_transmit(Instant::ZERO, &mut value), Some(frame("605#407C600000000000")));
    let event = client.handle_frame(Instant::ZERO, &frame("585#427C6000C4090000"), &mut value);
    assert_eq!(event, Some(Event::Done { address: at(0x607C, 0), len: 4 }));
    assert_eq!(value.get(), Ok(2500_i32));

    let mut value = Scalar::of(2_000_000_i32);
    client.write(Instant::ZERO, at(0x607D, 2), value.len()).unwrap();
    assert_eq!(client.poll_transmit(Instant::ZERO, &mut value), Some(frame("605#237D600280841E00")));
    let event = client.handle_frame(Instant::ZERO, &frame("585#607D600200000000"), &mut value);
    assert_eq!(event, Some(Event::Done { address: at(0x607D, 2), len: 4 }));
}

#[test]
fn the_number_of_bytes_shows_in_the_command_of_an_expedited_transfer() {
    check_server(
        server(),
        &[
            ("605#4000200100000000", "585#4F00200101000000"),
            ("605#4000200200000000", "585#4B00200201020000"),
            ("605#4000200300000000", "585#4700200301020300"),
            ("605#407C600000000000", "585#437C6000C4090000"),
            ("605#2F00200107000000", "585#6000200100000000"),
            ("605#2B00200207080000", "585#6000200200000000"),
            ("605#2700200307080900", "585#6000200300000000"),
        ],
    );
}

#[test]
fn a_write_that_does_not_tell_the_number_of_bytes_takes_those_of_the_entry() {
    let od = check_server(server(), &[("605#2200200207080900", "585#6000200200000000")]);
    assert_eq!(od.value(at(0x2000, 2)), [7, 8]);
}

#[test]
fn padded_writes_are_taken_where_that_is_allowed() {
    check_server(server(), &[("605#2300200207080000", "585#8000200212000706")]);
    let od = check_server(server().with_padded_writes(true), &[("605#2300200207080000", "585#6000200200000000")]);
    assert_eq!(od.value(at(0x2000, 2)), [7, 8]);
}

#[test]
fn what_cannot_be_done_is_refused_with_the_code_of_the_standard() {
    check_server(
        server(),
        &[
            ("605#4000300000000000", "585#8000300000000206"), // no such object
            ("605#4000200900000000", "585#8000200911000906"), // no such sub-index
            ("605#2B00300001020000", "585#8000300000000206"),
            ("605#2B01200001020000", "585#8001200002000106"), // read-only
            ("605#4002200000000000", "585#8002200001000106"), // write-only
            ("605#2F00200201000000", "585#8000200213000706"), // too short
            ("605#2300200201000000", "585#8000200212000706"), // too long
            ("605#E000200200000000", "585#8000200201000405"), // no such command
            ("605#6000000000000000", "585#8000000001000405"), // a segment of nothing
        ],
    );
}

#[test]
fn a_segmented_read_is_what_the_standard_says() {
    let script = [
        ("605#4004200000000000", "585#4104200009000000"),
        ("605#6000000000000000", "585#0061732069742077"),
        ("605#7000000000000000", "585#1B61730000000000"),
    ];
    check_text(&script, "as it was");
}

#[test]
fn a_segmented_write_of_a_value_is_taken_whole_with_or_without_its_size() {
    for initiate in ["605#2100200808000000", "605#2000200800000000"] {
        let od = check_server(
            server(),
            &[
                (initiate, "585#6000200800000000"),
                ("605#0009080706050403", "585#2000000000000000"),
                ("605#1D02000000000000", "585#3000000000000000"),
            ],
        );
        assert_eq!(od.value(at(0x2000, 8)), [9, 8, 7, 6, 5, 4, 3, 2]);
    }
}

#[test]
fn a_segmented_write_of_another_length_is_refused() {
    check_server(server(), &[("605#2100200802000000", "585#8000200813000706")]);
    check_server(server(), &[("605#2100200809000000", "585#8000200812000706")]);
    check_server(
        server(),
        &[("605#2000200800000000", "585#6000200800000000"), ("605#0101020304050607", "585#8000200813000706")],
    );
    check_server(
        server(),
        &[
            ("605#2000200800000000", "585#6000200800000000"),
            ("605#0001020304050607", "585#2000000000000000"),
            ("605#1B08090000000000", "585#8000200812000706"),
        ],
    );
}

#[test]
fn a_toggle_bit_that_does_not_alternate_ends_the_transfer() {
    check_server(
        server(),
        &[
            ("605#4000200800000000", "585#4100200808000000"),
            ("605#7000000000000000", "585#8000200800000305"),
            ("605#4000200800000000", "585#4100200808000000"),
            ("605#6000000000000000", "585#0001020304050607"),
            ("605#6000000000000000", "585#8000200800000305"),
            ("605#2100200808000000", "585#6000200800000000"),
            ("605#1001020304050607", "585#8000200800000305"),
        ],
    );
}

#[test]
fn frames_of_another_length_are_no_sdo() {
    check_server(server(), &[("605#407C6000000000", ""), ("605#", ""), ("604#407C600000000000", "")]);
    let remote = Frame::remote(frame("605#").id(), 8).unwrap();
    assert_eq!(server().handle_frame(Instant::ZERO, &remote, &mut dictionary()), None);
}

#[test]
fn every_length_survives_a_write_and_a_read() {
    for hides_len in [false, true] {
        let mut bus = Bus::new(Od { hides_len, ..dictionary() });
        for len in 0..100 {
            let data = pattern(len);
            let done = Event::Done { address: at(0x2003, 0), len: len as u32 };
            assert_eq!(bus.write(at(0x2003, 0), &data), done);
            assert_eq!(bus.read(at(0x2003, 0)), (done, data));
            assert_eq!(bus.events.pop(), Some(sdo_server::Event::Read(at(0x2003, 0))));
            assert_eq!(bus.events.pop(), Some(sdo_server::Event::Written(at(0x2003, 0))));
            assert_eq!(bus.events, []);
        }
    }
}

#[test]
fn an_abort_of_the_server_is_reported_with_entry_and_code() {
    let mut bus = Bus::new(dictionary());
    let (address, code) = (at(0x2001, 0), AbortCode::READ_ONLY);
    assert_eq!(bus.write(address, &[1, 2]), Event::Failed(SdoError::Aborted { address, code }));
    assert_eq!(
        SdoError::Aborted { address, code }.to_string(),
        "2001:00: the device aborts: 0601 0002: attempt to write a read only object"
    );
}

#[test]
fn a_server_that_was_asked_for_nothing_yet_is_not_told_of_an_abort() {
    let mut client = SdoClient::of_node(NODE);
    client.read(Instant::ZERO, at(0x2003, 0)).unwrap();
    client.abort(AbortCode::GENERAL);
    assert_eq!(client.poll_transmit(Instant::ZERO, &mut [0_u8; 0]), None);
    // What is still to be said of the transfer before is said nevertheless.
    client.read(Instant::ZERO, at(0x2003, 0)).unwrap();
    client.poll_transmit(Instant::ZERO, &mut [0_u8; 0]).unwrap();
    client.abort(AbortCode::GENERAL);
    client.read(Instant::ZERO, at(0x2000, 1)).unwrap();
    client.abort(AbortCode::GENERAL);
    let sent: Vec<_> = core::iter::from_fn(|| client.poll_transmit(Instant::ZERO, &mut [0_u8; 0])).collect();
    assert_eq!(sent, [frame("605#8003200000000008")]);
}

#[test]
fn one_transfer_at_a_time() {
    let mut client = SdoClient::of_node(NODE);
    client.read(Instant::ZERO, at(0x2003, 0)).unwrap();
    let busy = client.write(Instant::ZERO, at(0x2000, 1), 1).unwrap_err();
    assert_eq!(busy.to_string(), "2003:00: an SDO transfer is still under way");
}

#[test]
fn values_are_padded_to_four_bytes_for_devices_that_take_no_fewer() {
    let mut client = SdoClient::of_node(NODE).with_always_four_bytes(true);
    let mut value = Scalar::of(0x0807_u16);
    client.write(Instant::ZERO, at(0x2000, 2), value.len()).unwrap();
    assert_eq!(client.poll_transmit(Instant::ZERO, &mut value), Some(frame("605#2300200207080000")));
    let event = client.handle_frame(Instant::ZERO, &frame("585#6000200200000000"), &mut value);
    assert_eq!(event, Some(Event::Done { address: at(0x2000, 2), len: 2 }));
}

#[test]
fn a_value_that_has_another_size_than_the_device_sends_is_an_error() {
    let mut client = SdoClient::of_node(NODE);
    let mut value = Scalar::room_for::<u16>();
    client.read(Instant::ZERO, at(0x607C, 0)).unwrap();
    client.poll_transmit(Instant::ZERO, &mut value).unwrap();
    let event = client.handle_frame(Instant::ZERO, &frame("585#437C6000C4090000"), &mut value);
    let error = SdoError::TooLong { address: at(0x607C, 0), capacity: 2 };
    assert_eq!(event, Some(Event::Failed(error)));
    assert_eq!(client.poll_transmit(Instant::ZERO, &mut value), None, "there is nothing left to abort");

    client.read(Instant::ZERO, at(0x2000, 1)).unwrap();
    client.poll_transmit(Instant::ZERO, &mut value).unwrap();
    client.handle_frame(Instant::ZERO, &frame("585#4F00200101000000"), &mut value).expect("it is done");
    assert!(value.get::<u16>().is_err());
}

/// A text of at most 16 bytes, whatever becomes of a transfer into it.
#[track_caller]
fn check_text(script: &[(&str, &str)], expected: &str) {
    let od = check_server(server(), script);
    assert_eq!(String::from_utf8_lossy(od.value(at(0x2004, 0))), expected);
}

#[test]
fn a_text_changes_when_all_of_it_has_come_and_not_before() {
    let begin = ("605#210420000C000000", "585#6004200000000000");
    let first = ("605#0030313233343536", "585#2000000000000000");
    let last = ("605#153738393A3B0000", "585#3000000000000000");
    check_text(&[begin, first, last], "0123456789:;");
    check_text(&[begin, first], "as it was");
    check_text(&[begin, first, ("605#8004200000000405", "")], "as it was");
    check_text(&[begin, first, ("605#0037383940414243", "585#8004200000000305")], "as it was");
    // More or less than announced; more than there is room for.
    check_text(&[begin, first, ("605#1037383940414243", "585#8004200012000706")], "as it was");
    check_text(&[begin, first, ("605#1737383900000000", "585#8004200013000706")], "as it was");
    let unannounced = ("605#2004200000000000", "585#6004200000000000");
    let more = [("605#1037383940414243", "585#3000000000000000"), ("605#0037383940414243", "585#8004200012000706")];
    check_text(&[unannounced, first, more[0], more[1]], "as it was");
    // Nothing is less than it was.
    check_text(&[unannounced, ("605#0F00000000000000", "585#2000000000000000")], "");
}

#[test]
fn a_text_by_block_changes_when_its_checksum_is_right_and_not_before() {
    let begin = ("605#C60420000C000000", "585#A40420007F000000");
    let segments = [("605#0130313233343536", ""), ("605#823738393A3B0000", "585#A2027F0000000000")];
    let mut crc = lexican_runtime::wire::crc::Crc::new();
    crc.update(b"0123456789:;");
    let [low, high] = crc.get().to_le_bytes();
    let end = format!("605#C9{low:02X}{high:02X}0000000000");
    check_text(&[begin, segments[0], segments[1], (&end, "585#A100000000000000")], "0123456789:;");
    check_text(&[begin, segments[0], segments[1]], "as it was");
    let wrong = format!("605#C9{high:02X}{low:02X}0000000000");
    check_text(&[begin, segments[0], segments[1], (&wrong, "585#8004200004000405")], "as it was");
}
