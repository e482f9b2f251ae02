//! The frames that the server answers. Other CANopen stacks got some of this wrong: zencan 0.0.5 and canopen-rs 0.6.1,
//! where it was reproduced; and CANopenNode, according to public threads. The comments say which.

use crate::sdo_support::{Bus, NODE, Od, at, check_server, frame, pattern};
use lexican_runtime::object::{Access, Address, DataType};
use lexican_runtime::service::sdo_server::{self, SdoServer, Side, SizesIndicated};
use lexican_runtime::{AbortCode, Duration, Frame, Instant};

const DOMAIN: Address = at(0x2003, 0);
const TEXT: Address = at(0x2004, 0);

fn bus() -> Bus {
    bus_with(b"")
}

/// A bus whose server has these bytes in 2003h.
fn bus_with(domain: &[u8]) -> Bus {
    Bus::new(
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
            .with(DOMAIN, DataType::Domain, Access::Rw, domain)
            .with_capacity(TEXT, DataType::VisibleString, 16, b"as it was"),
    )
}

/// Checks the answers of the default server, and then the value of an entry.
#[track_caller]
fn check_value(script: &str, address: Address, value: &[u8]) {
    let mut bus = bus();
    check_server(&mut bus, script);
    assert_eq!(bus.od.value(address), value, "after{script}");
}

#[test]
fn the_examples_of_the_manual_are_answered_byte_for_byte() {
    let mut bus = bus();
    bus.server = bus.server.with_sizes_indicated(SizesIndicated::NONE);
    check_server(&mut bus, "407C6000 > 427C6000C4090000\n 237D600280841E00 > 607D6002");
    assert_eq!(bus.od.value(at(0x607D, 2)), 2_000_000_i32.to_le_bytes());
}

#[test]
fn the_number_of_bytes_shows_in_the_command_of_an_expedited_transfer() {
    check_server(
        &mut bus(),
        "
        40002001 > 4F00200101
        40002002 > 4B0020020102
        40002003 > 47002003010203
        407C6000 > 437C6000C409
        2F00200107 > 60002001
        2B0020020708 > 60002002
        27002003070809 > 60002003
        ",
    );
    // A write without an indicated size takes as many bytes as the entry has; zencan 7 refuses it.
    check_value("22002002070809 > 60002002", at(0x2000, 2), &[7, 8]);
}

#[test]
fn padded_writes_are_taken_where_that_is_allowed() {
    check_server(&mut bus(), "230020020708 > 8000200212000706");
    let mut bus = bus();
    bus.server = bus.server.with_padded_writes(true);
    check_server(&mut bus, "230020020708 > 60002002");
    assert_eq!(bus.od.value(at(0x2000, 2)), [7, 8]);
}

#[test]
fn what_cannot_be_done_is_refused_with_the_code_of_the_standard() {
    check_server(
        &mut bus(),
        "
        40003000 > 8000300000000206     // no such object; canopen-rs 4 does not distinguish the next
        40002009 > 8000200911000906     // no such sub-index
        2B0030000102 > 8000300000000206
        2B0120000102 > 8001200002000106 // read-only
        40022000 > 8002200001000106     // write-only
        2F00200201 > 8000200213000706   // too short
        2300200201 > 8000200212000706   // too long
        E0002002 > 8000200201000405     // no such command; zencan 7 is silent
        60 > 8000000001000405           // a segment of nothing
        ",
    );
}

#[test]
fn a_segmented_read_is_what_the_standard_says() {
    check_server(&mut bus(), "40042000 > 4104200009\n 60 > 0061732069742077\n 70 > 1B6173");
}

#[test]
fn a_segmented_write_is_taken_whole_with_or_without_its_size() {
    for initiate in ["2100200808", "20002008"] {
        let script = format!("{initiate} > 60002008\n 0009080706050403 > 20\n 1D02 > 30");
        check_value(&script, at(0x2000, 8), &[9, 8, 7, 6, 5, 4, 3, 2]);
    }
    // canopen-rs 4 requires the size.
    check_value("20042000 > 60042000\n 096E6577 > 20", TEXT, b"new");
}

#[test]
fn a_segmented_write_of_another_length_is_refused() {
    for script in [
        "2100200802 > 8000200813000706",
        "2100200809 > 8000200812000706",
        "20002008 > 60002008\n 0101020304050607 > 8000200813000706",
        "20002008 > 60002008\n 0001020304050607 > 20\n 1B0809 > 8000200812000706",
        // zencan 1 panics: nothing, into a value.
        "20002001 > 60002001\n 0F > 8000200113000706",
    ] {
        check_server(&mut bus(), script);
    }
}

#[test]
fn a_toggle_bit_that_does_not_alternate_ends_the_transfer() {
    check_server(
        &mut bus(),
        "
        40002008 > 4100200808
        70 > 8000200800000305
        40002008 > 4100200808
        60 > 0001020304050607
        60 > 8000200800000305
        2100200808 > 60002008
        1001020304050607 > 8000200800000305
        ",
    );
}

#[test]
fn frames_of_another_length_are_no_sdo() {
    let mut bus = bus();
    // canopen-rs 4 accepts them.
    let short = ["605#407C6000000000", "605#40002001", "605#2B002002E803", "605#", "604#407C600000000000"].map(frame);
    for frame in short.into_iter().chain([Frame::remote(frame("605#").id(), 8).unwrap()]) {
        assert_eq!(bus.server.handle_frame(Instant::ZERO, &frame, &mut bus.od), None);
        assert_eq!(bus.server.poll_transmit(Instant::ZERO, &mut bus.od), None, "{frame}");
    }
    assert_eq!(bus.od.value(at(0x2000, 2)), [1, 2]);
}

#[test]
fn a_text_changes_when_all_of_it_has_come_and_not_before() {
    let begun = "210420000C > 60042000\n 0030313233343536 > 20\n";
    let unannounced = "20042000 > 60042000\n";
    let check = |begin: &str, script: &str, value: &[u8]| check_value(&format!("{begin}{script}"), TEXT, value);
    check(begun, "153738393A3B > 30", b"0123456789:;");
    for script in [
        "",
        "8004200000000405 >",
        "0037383940414243 > 8004200000000305",
        // More or fewer bytes than announced.
        "1037383940414243 > 8004200012000706",
        "17373839 > 8004200013000706",
    ] {
        check(begun, script, b"as it was");
    }
    // More bytes than there is room for; and no bytes, which is shorter than before.
    let long = "0030313233343536 > 20\n 1037383940414243 > 30\n 0037383940414243 > 8004200012000706";
    check(unannounced, long, b"as it was");
    check(unannounced, "0F > 20", b"");
}

#[test]
fn a_text_by_block_changes_when_its_checksum_is_right_and_not_before() {
    let mut crc = lexican_runtime::wire::crc::Crc::new();
    crc.update(b"0123456789:;");
    let [low, high] = crc.get().to_le_bytes();
    let begun = "C60420000C > A40420007F\n 0130313233343536 823738393A3B > A2027F\n";
    check_value(&format!("{begun} C9{low:02X}{high:02X} > A1"), TEXT, b"0123456789:;");
    check_value(begun, TEXT, b"as it was");
    check_value(&format!("{begun} C9{high:02X}{low:02X} > 8004200004000405"), TEXT, b"as it was");
}

#[test]
fn the_client_may_change_the_block_size_with_every_block() {
    check_server(
        &mut bus_with(&pattern(40)),
        "
        A003200001 > C603200028
        A3 > 0101203F5E7D9CBB
        A20102 > 01DAF91837567594 02B3D2F1102F4E6D
        A2027F > 018CABCAE9082746 026584A3C2E1001F 833E5D7C9BBA
        A2037F > C9
        A1 >
        ",
    );
}

#[test]
fn what_was_not_confirmed_is_sent_again() {
    check_server(
        &mut bus_with(&pattern(20)),
        "
        A00320007F > C603200014
        A3 > 0101203F5E7D9CBB 02DAF91837567594 83B3D2F1102F4E
        A2017F > 01DAF91837567594 82B3D2F1102F4E
        A20001 > 01DAF91837567594
        A20101 > 81B3D2F1102F4E
        A20101 > C5
        A20101 > C5 // the client did not hear the end, and says again what it has
        A1 >
        ",
    );
}

// zencan 2 panics.
#[test]
fn an_empty_domain_is_read_by_block() {
    check_server(&mut bus(), "A00320007F > C6032000\n A3 > 81\n A2017F > DD\n A1 >");
}

// CANopenNode #39, found by the conformance test: the request after a block read was dropped. zencan 4 answers the end
// of the transfer, which makes the next transfer fail.
#[test]
fn a_request_right_after_the_end_of_a_block_read_is_answered() {
    let mut bus = bus_with(&pattern(10));
    let begun = "A00320007F > C60320000A\n A3 > 0101203F5E7D9CBB 82DAF918\n A2027F > D1";
    check_server(&mut bus, &format!("{begun}\n A1 >\n 40002001 > 4F00200101"));
    assert_eq!(bus.events[0], sdo_server::Event::Read(DOMAIN));
}

#[test]
fn block_sizes_and_sequence_numbers_out_of_range_are_refused() {
    let begun = "A003200001 > C603200028\n A3 > 0101203F5E7D9CBB\n";
    let check = |script: &str| check_server(&mut bus_with(&pattern(40)), script);
    for size in ["00", "80", "FF"] {
        check(&format!("A0032000{size} > 8003200002000405"));
        check(&format!("{begun} A201{size} > 8003200002000405"));
    }
    for sequence in ["02", "7F", "80", "FF"] {
        check(&format!("{begun} A2{sequence}01 > 8003200003000405"));
    }
}

#[test]
fn a_checksum_is_compared_only_when_both_sides_can_compute_it() {
    for (initiate, answer) in [("C603200004", "8003200004000405"), ("C203200004", "A1")] {
        let script = format!("{initiate} > A40320007F\n 8101020304 > A2017F\n CD1234 > {answer}");
        check_server(&mut bus(), &script);
    }
}

#[test]
fn a_block_write_of_another_length_than_announced_is_refused() {
    for (announced, code) in [("05", "13"), ("03", "12")] {
        let script = format!("C2032000{announced} > A40320007F\n 8101020304 > A2017F\n CD > 80032000{code}000706");
        check_server(&mut bus(), &script);
    }
}

#[test]
fn an_error_in_the_midst_of_a_block_is_sent_at_once_and_reported_at_the_next_deadline() {
    let mut bus = bus_with(&pattern(40));
    bus.od.breaks_at = Some(14);
    let script = "A00320007F > C603200028\n A3 > 0101203F5E7D9CBB 02DAF91837567594 8003200000000606";
    check_server(&mut bus, script);
    assert_eq!(bus.server.poll_timeout(), Some(Instant::ZERO));
    let code = AbortCode::HARDWARE_ERROR;
    let aborted = sdo_server::Event::Aborted { address: DOMAIN, code, by: Side::Server };
    assert_eq!(bus.server.handle_timeout(Instant::ZERO), Some(aborted));
    assert_eq!(bus.server.poll_timeout(), None);
}

#[test]
fn a_client_may_abort_in_the_midst_of_a_block() {
    let mut bus = bus();
    check_server(&mut bus, "C603200028 > A40320007F\n 0101020304050607 >\n 8003200000000008 >");
    let code = AbortCode::GENERAL;
    assert_eq!(bus.events, [sdo_server::Event::Aborted { address: DOMAIN, code, by: Side::Client }]);
    assert!(!bus.server.is_busy());
}

// zencan 7: always 25 ms.
#[test]
fn the_server_waits_as_long_as_it_is_set_to() {
    let mut bus = bus();
    bus.server = SdoServer::of_node(NODE).with_timeout(Duration::from_millis(70));
    check_server(&mut bus, "40042000 > 4104200009");
    assert_eq!(bus.server.poll_timeout(), Some(Instant::ZERO + Duration::from_millis(70)));
}
