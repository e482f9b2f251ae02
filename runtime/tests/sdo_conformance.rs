//! The SDO cases of the CiA conformance test (CCT 3.0.3.10, SDO 01 to SDO 30) that concern a server alone, frame by
//! frame, under their numbers. Left out here, since they need a device around the server: 02 and 12 (all of a
//! dictionary), 10 and 11 (limits), 28 to 30 (1201h and following, 1280h and following, stored parameters).

mod sdo_support;

use lexican_runtime::Instant;
use lexican_runtime::object::{Access, Address, DataType};
use lexican_runtime::service::sdo_server::SdoServer;
use sdo_support::{NODE, Od, at, frame};

const NAME: Address = at(0x1008, 0);

fn dictionary() -> Od {
    Od::default()
        .with(at(0x1000, 0), DataType::Unsigned32, Access::Ro, &[0x92, 0x01, 0x02, 0x00])
        .with(NAME, DataType::VisibleString, Access::Const, b"conformance test object, name")
        .with(at(0x100C, 0), DataType::Unsigned16, Access::Rw, &[0, 0])
        .with(at(0x1017, 0), DataType::Unsigned16, Access::Rw, &[0, 0])
        .with(at(0x2000, 0), DataType::Unsigned32, Access::Wo, &[0; 4])
        .with(at(0x2001, 0), DataType::Unsigned8, Access::Rw, &[0])
}

/// Requests, each with all frames that answer it.
#[track_caller]
fn check(script: &[(&str, &[&str])]) -> Od {
    let (mut server, mut od) = (SdoServer::of_node(NODE), dictionary());
    for (request, answers) in script {
        server.handle_frame(Instant::ZERO, &frame(request), &mut od);
        let sent: Vec<_> = core::iter::from_fn(|| server.poll_transmit(Instant::ZERO, &mut od)).collect();
        assert_eq!(sent, answers.iter().map(|answer| frame(answer)).collect::<Vec<_>>(), "the answer to {request}");
    }
    assert!(!server.is_busy(), "every case ends");
    od
}

#[test]
fn sdo_01_reads_1000h_expedited() {
    check(&[("605#4000100000000000", &["585#4300100092010200"])]);
}

#[test]
fn sdo_03_cannot_write_1000h() {
    check(&[("605#2300100001020304", &["585#8000100002000106"])]);
}

#[test]
fn sdo_04_cannot_read_a_write_only_object() {
    check(&[("605#4000200000000000", &["585#8000200001000106"])]);
}

#[test]
fn sdo_05_cannot_read_a_sub_index_that_does_not_exist() {
    check(&[("605#4000100100000000", &["585#8000100111000906"])]);
}

#[test]
fn sdo_06_cannot_read_an_object_that_does_not_exist() {
    check(&[("605#4004100000000000", &["585#8004100000000206"])]);
}

#[test]
fn sdo_07_refuses_a_wrong_command_specifier() {
    check(&[("605#E000100000000000", &["585#8000100001000405"])]);
}

#[test]
fn sdo_08_refuses_four_bytes_for_two_or_one() {
    check(&[("605#2317100001000000", &["585#8017100012000706"]), ("605#2301200001000000", &["585#8001200012000706"])]);
}

#[test]
fn sdo_09_refuses_one_byte_for_two_or_four() {
    check(&[("605#2F17100001000000", &["585#8017100013000706"]), ("605#2F00200001000000", &["585#8000200013000706"])]);
}

/// The server may choose; this one answers expedited whatever fits into one frame.
#[test]
fn sdo_13_reads_1000h() {
    check(&[("605#4000100000000000", &["585#4300100092010200"])]);
}

#[test]
fn sdo_14_and_15_write_two_bytes_segmented() {
    for (index, address) in [("0C10", at(0x100C, 0)), ("1710", at(0x1017, 0))] {
        let od = check(&[
            (&format!("605#21{index}0002000000"), &[&format!("585#60{index}0000000000")]),
            ("605#0BE8030000000000", &["585#2000000000000000"]),
        ]);
        assert_eq!(od.value(address), [0xE8, 0x03]);
    }
}

#[test]
fn sdo_16_and_18_read_an_object_segmented() {
    check(&[
        ("605#4008100000000000", &["585#410810001D000000"]),
        ("605#6000000000000000", &["585#00636F6E666F726D"]),
        ("605#7000000000000000", &["585#10616E6365207465"]),
        ("605#6000000000000000", &["585#007374206F626A65"]),
        ("605#7000000000000000", &["585#1063742C206E616D"]),
        ("605#6000000000000000", &["585#0D65000000000000"]),
    ]);
}

#[test]
fn sdo_17_refuses_a_wrong_toggle_bit() {
    check(&[("605#4008100000000000", &["585#410810001D000000"]), ("605#7000000000000000", &["585#8008100000000305"])]);
    check(&[
        ("605#4008100000000000", &["585#410810001D000000"]),
        ("605#6000000000000000", &["585#00636F6E666F726D"]),
        ("605#6000000000000000", &["585#8008100000000305"]),
    ]);
}

#[test]
fn sdo_19_reads_1000h_by_block_without_crc() {
    check(&[
        ("605#A00010007F000000", &["585#C600100004000000"]),
        ("605#A300000000000000", &["585#8192010200000000"]),
        ("605#A2017F0000000000", &["585#CD00000000000000"]),
        ("605#A100000000000000", &[]),
    ]);
}

#[test]
fn sdo_20_and_21_write_two_bytes_by_block_without_crc() {
    for (index, address) in [("0C10", at(0x100C, 0)), ("1710", at(0x1017, 0))] {
        let od = check(&[
            (&format!("605#C2{index}0002000000"), &[&format!("585#A4{index}007F000000")]),
            ("605#81E8030000000000", &["585#A2017F0000000000"]),
            ("605#D500000000000000", &["585#A100000000000000"]),
        ]);
        assert_eq!(od.value(address), [0xE8, 0x03]);
    }
}

#[test]
fn sdo_22_and_23_read_an_object_by_block_without_and_with_crc() {
    for (initiate, end) in
        [("605#A00810007F000000", "585#D900000000000000"), ("605#A40810007F000000", "585#D913C30000000000")]
    {
        check(&[
            (initiate, &["585#C60810001D000000"]),
            (
                "605#A300000000000000",
                &[
                    "585#01636F6E666F726D",
                    "585#02616E6365207465",
                    "585#037374206F626A65",
                    "585#0463742C206E616D",
                    "585#8565000000000000",
                ],
            ),
            ("605#A2057F0000000000", &[end]),
            ("605#A100000000000000", &[]),
        ]);
    }
}

#[test]
fn sdo_24_and_25_write_two_bytes_by_block_with_crc() {
    for index in ["0C10", "1710"] {
        check(&[
            (&format!("605#C6{index}0002000000"), &[&format!("585#A4{index}007F000000")]),
            ("605#81E8030000000000", &["585#A2017F0000000000"]),
            ("605#D5FFFF0000000000", &[&format!("585#80{index}0004000405")]),
        ]);
        check(&[
            (&format!("605#C6{index}0002000000"), &[&format!("585#A4{index}007F000000")]),
            ("605#81E8030000000000", &["585#A2017F0000000000"]),
            ("605#D578A90000000000", &["585#A100000000000000"]),
        ]);
    }
}

#[test]
fn sdo_26_refuses_a_block_size_of_128() {
    check(&[("605#A008100080000000", &["585#8008100002000405"])]);
}

#[test]
fn sdo_27_refuses_a_sequence_number_of_128() {
    check(&[
        ("605#A008100002000000", &["585#C60810001D000000"]),
        ("605#A300000000000000", &["585#01636F6E666F726D", "585#02616E6365207465"]),
        ("605#A280020000000000", &["585#8008100003000405"]),
    ]);
}
