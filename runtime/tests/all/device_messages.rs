//! SYNC, TIME, EMCY and additional SDO servers of a device.

use crate::common::testing::TestOd;
use crate::common::{self, FULL, NODE, NOTHING, Rig};
use lexican_runtime::device::{Behaviour, Device, Event};
use lexican_runtime::object::TimeOfDay;
use lexican_runtime::service::sdo_server::SizesIndicated;
use lexican_runtime::wire::emcy::{CodeOrder, ErrorCode, ErrorRegister};
use lexican_runtime::{AbortCode, Duration, Instant};

const VOLTAGE: ErrorCode = ErrorCode(0x3120);

#[test]
fn sync_is_produced_counted_and_concerns_the_device_itself() {
    let mut rig = Rig::full();
    rig.write(0x1019, 0, 1, 3).unwrap();
    rig.write(0x1800, 2, 1, 1).unwrap();
    rig.write(0x1006, 0, 4, 10_000).unwrap();
    rig.write(0x1005, 0, 4, 0x4000_0080).unwrap();
    let mut rig = rig.operational();
    assert_eq!(
        rig.pass_ms(40),
        [
            "10000 080#01",
            "10000 185#3412",
            "20000 080#02",
            "20000 185#3412",
            "30000 080#03",
            "30000 185#3412",
            "40000 080#01",
            "40000 185#3412",
        ]
    );
    assert_eq!(rig.take_events()[0], Event::Sync { counter: Some(1) });
    rig.write(0x1006, 0, 4, 0).unwrap();
    assert_eq!(rig.pass_ms(100), NOTHING);
}

#[test]
fn sync_parameters_are_checked() {
    let mut rig = Rig::full();
    for bad in [1, 241, 255] {
        assert_eq!(rig.write(0x1019, 0, 1, bad), Err(AbortCode::INVALID_VALUE.0), "{bad}");
    }
    rig.write(0x1006, 0, 4, 10_000).unwrap();
    assert_eq!(rig.write(0x1019, 0, 1, 10), Err(AbortCode::DEVICE_STATE.0));
    rig.write(0x1005, 0, 4, 0x4000_0080).unwrap();
    assert_eq!(rig.write(0x1005, 0, 4, 0x4000_0081), Err(AbortCode::INVALID_VALUE.0));
    rig.write(0x1005, 0, 4, 0x0000_0081).unwrap();
    assert_eq!(rig.write(0x1005, 0, 4, 0x0000_0601), Err(AbortCode::INVALID_VALUE.0));
    let mut consumer = Rig::new(TestOd::new(FULL).without(0x1006), Behaviour::CIA_301);
    assert_eq!(consumer.write(0x1005, 0, 4, 0x4000_0080), Err(AbortCode::INVALID_VALUE.0));
}

#[test]
fn a_sync_of_the_wrong_length_is_an_emergency_and_still_counts() {
    let mut rig = Rig::full();
    assert_eq!(rig.send("080#05"), ["085#4082110000000000"]);
    assert_eq!(rig.take_events(), [Event::Sync { counter: None }]);
    assert_eq!(rig.send("080#"), ["085#0000000000000000"]);
}

#[test]
fn synchronous_pdos_are_dropped_when_the_window_has_closed() {
    let mut rig = Rig::full();
    rig.write(0x1800, 2, 1, 1).unwrap();
    rig.write(0x1007, 0, 4, 500).unwrap();
    let mut rig = rig.operational();
    assert_eq!(rig.send("080#"), ["185#3412"]);
    // The bus is busy until the synchronous window has closed.
    rig.device.handle_frame(rig.now, &common::frame("080#"), &mut rig.od);
    rig.now += Duration::from_micros(500);
    rig.device.handle_timeout(rig.now, &mut rig.od);
    assert_eq!(rig.sent(), NOTHING);
}

#[test]
fn an_event_whose_window_has_closed_is_sent_with_the_next_sync() {
    let mut rig = Rig::full();
    rig.write(0x1800, 2, 1, 0).unwrap();
    rig.write(0x1007, 0, 4, 500).unwrap();
    let mut rig = rig.operational();
    // The bus is busy until the synchronous window has closed.
    rig.device.handle_frame(rig.now, &common::frame("080#"), &mut rig.od);
    rig.now += Duration::from_micros(500);
    rig.device.handle_timeout(rig.now, &mut rig.od);
    assert_eq!(rig.sent(), NOTHING);
    assert_eq!([rig.send("080#"), rig.send("080#")].concat(), ["185#3412"]);
}

#[test]
fn time_is_received() {
    let mut rig = Rig::full();
    rig.send("100#D20296490A00");
    assert_eq!(rig.take_events(), [Event::Time(TimeOfDay { days: 10, ms: 0x0996_02D2 })]);
    rig.send("100#D202");
    assert_eq!(rig.take_events(), []);
}

#[test]
fn time_is_sent_by_a_device_that_produces_it() {
    let noon = TimeOfDay { days: 10, ms: 0x0996_02D2 };
    let behaviour = Behaviour { produces_time: true, ..Behaviour::CIA_301 };
    let mut rig = Rig::deviating(behaviour);
    rig.device.send_time(noon);
    assert_eq!(rig.sent(), NOTHING, "1012h does not say so");
    rig.write(0x1012, 0, 4, 0xC000_0100).unwrap();
    assert_eq!(rig.write(0x1012, 0, 4, 0x4000_00FF), Err(AbortCode::INVALID_VALUE.0), "while it exists");
    // The latest time is sent, before PDOs and after more urgent frames.
    rig.device.send_time(TimeOfDay { days: 9, ms: 0 });
    rig.device.send_time(noon);
    rig.device.emergency(VOLTAGE, ErrorRegister::VOLTAGE, [0; 5], &mut rig.od);
    assert_eq!(rig.sent(), ["085#2031050000000000", "100#D20296090A00"]);
    assert_eq!(rig.sent(), NOTHING, "once");
    // In STOPPED it is not sent, and not later either.
    rig.send("000#0205");
    rig.device.send_time(noon);
    assert_eq!((rig.sent(), rig.send("000#8005")), (vec![], vec![]));
    rig.write(0x1012, 0, 4, 0x8000_0100).unwrap();
    rig.device.send_time(noon);
    assert_eq!(rig.sent(), NOTHING, "it only consumes");
}

#[test]
fn an_emergency_is_sent_registered_and_recorded() {
    let mut rig = Rig::full();
    assert_eq!(rig.read(0x1003, 1), Err(AbortCode::NO_DATA.0));
    rig.device.emergency(VOLTAGE, ErrorRegister::VOLTAGE, [1, 2, 3, 4, 5], &mut rig.od);
    assert_eq!(rig.sent(), ["085#2031050102030405"]);
    assert_eq!(rig.read(0x1001, 0), Ok(0x05));
    rig.device.emergency(ErrorCode(0x4310), ErrorRegister::TEMPERATURE, [0; 5], &mut rig.od);
    assert_eq!(rig.sent(), ["085#10430D0000000000"]);
    assert_eq!(rig.read(0x1003, 0), Ok(2));
    assert_eq!(rig.read(0x1003, 1), Ok(0x0000_4310));
    assert_eq!(rig.read(0x1003, 2), Ok(0x0201_3120));
    assert_eq!(rig.read(0x1003, 3), Err(AbortCode::NO_DATA.0));

    rig.device.clear(ErrorRegister::TEMPERATURE, &mut rig.od);
    assert_eq!(rig.sent(), ["085#0000050000000000"]);
    rig.device.clear(ErrorRegister::TEMPERATURE, &mut rig.od);
    assert_eq!(rig.sent(), NOTHING);
    rig.device.clear(ErrorRegister(0xFF), &mut rig.od);
    assert_eq!(rig.sent(), ["085#0000000000000000"]);
    assert_eq!(rig.read(0x1001, 0), Ok(0));
}

#[test]
fn the_history_keeps_the_newest_and_is_erased_by_0_only() {
    let mut rig = Rig::full();
    for code in 1..=5 {
        rig.device.emergency(ErrorCode(code), ErrorRegister::NONE, [0; 5], &mut rig.od);
    }
    assert_eq!([0, 1, 2, 3].map(|sub| rig.read(0x1003, sub)), [Ok(3), Ok(5), Ok(4), Ok(3)]);
    assert_eq!(rig.write(0x1003, 0, 1, 1), Err(AbortCode::INVALID_VALUE.0));
    // Not even the present number can be written.
    assert_eq!(rig.write(0x1003, 0, 1, 3), Err(AbortCode::INVALID_VALUE.0));
    assert_eq!(rig.read(0x1003, 1), Ok(5));
    rig.write(0x1003, 0, 1, 0).unwrap();
    assert_eq!([0, 1].map(|sub| rig.read(0x1003, sub)), [Ok(0), Err(AbortCode::NO_DATA.0)]);
}

#[test]
fn the_inhibit_time_keeps_emergencies_apart_and_loses_none() {
    let mut rig = Rig::full();
    rig.write(0x1015, 0, 2, 100).unwrap();
    for code in [0x1000, 0x2000, 0x3000] {
        rig.device.emergency(ErrorCode(code), ErrorRegister::NONE, [0; 5], &mut rig.od);
    }
    assert_eq!(rig.sent(), ["085#0010010000000000"]);
    assert_eq!(rig.pass_ms(50), ["10000 085#0020010000000000", "20000 085#0030010000000000"]);
    assert_eq!(rig.device.poll_timeout(), None);
}

#[test]
fn emergencies_wait_while_the_device_is_stopped() {
    let mut rig = Rig::full();
    rig.send("000#0205");
    rig.device.emergency(VOLTAGE, ErrorRegister::VOLTAGE, [0; 5], &mut rig.od);
    assert_eq!(rig.sent(), NOTHING);
    assert_eq!(rig.send("000#8005"), ["085#2031050000000000"]);
}

#[test]
fn the_identifier_of_emergencies_changes_only_while_they_are_switched_off() {
    let mut rig = Rig::full();
    assert_eq!(rig.write(0x1014, 0, 4, 0x86), Err(AbortCode::INVALID_VALUE.0));
    rig.write(0x1014, 0, 4, 0x8000_0085).unwrap();
    rig.device.emergency(VOLTAGE, ErrorRegister::VOLTAGE, [0; 5], &mut rig.od);
    assert_eq!(rig.sent(), NOTHING);
    rig.write(0x1014, 0, 4, 0x86).unwrap();
    rig.device.clear(ErrorRegister(0xFF), &mut rig.od);
    assert_eq!(rig.sent(), ["086#0000000000000000"]);
}

#[test]
fn devices_deviate_in_byte_order_history_and_what_they_report() {
    let behaviour = Behaviour {
        emcy_code_order: CodeOrder::HighByteFirst,
        empty_history_is_zero: true,
        unreported: &[ErrorCode::PDO_LENGTH],
        sdo_sizes_indicated: SizesIndicated { expedited: [true, true, true, false], longer: true },
        ..Behaviour::CIA_301
    };
    let mut rig = Rig::deviating(behaviour);
    rig.device.emergency(VOLTAGE, ErrorRegister::VOLTAGE, [0; 5], &mut rig.od);
    assert_eq!(rig.sent(), ["085#3120050000000000"]);
    assert_eq!(rig.read(0x1003, 2), Ok(0));
    assert_eq!(rig.send("605#4000100000000000"), ["585#4200100092010000"]);
    assert_eq!(rig.send("605#4001100000000000"), ["585#4F01100005000000"]);
    let mut rig = rig.operational();
    assert_eq!(rig.send("205#01"), NOTHING);
}

#[test]
fn an_error_of_communication_ends_without_ending_the_application_s() {
    let mut rig = Rig::full();
    rig.device.emergency(ErrorCode::CAN_ERROR_PASSIVE, ErrorRegister::COMMUNICATION, [0; 5], &mut rig.od);
    rig.send("080#05");
    rig.send("080#");
    assert_eq!(rig.read(0x1001, 0), Ok(0x11));
    rig.device.clear(ErrorRegister::COMMUNICATION, &mut rig.od);
    assert_eq!(rig.read(0x1001, 0), Ok(0));
}

#[test]
fn an_error_that_the_device_still_has_is_not_reported_as_over() {
    let mut rig = Rig::full();
    rig.write(0x1016, 1, 4, 0x0010_0064).unwrap();
    rig.send("710#05");
    assert_eq!(rig.pass_ms(110), ["100000 085#3081110000000000"]);
    rig.device.emergency(ErrorCode(0x8100), ErrorRegister::COMMUNICATION, [0; 5], &mut rig.od);
    assert_eq!(rig.sent(), ["085#0081110000000000"]);
    rig.device.clear(ErrorRegister::COMMUNICATION, &mut rig.od);
    assert_eq!(rig.sent(), NOTHING, "the heartbeat is still lost");
    assert_eq!(rig.read(0x1001, 0), Ok(0x11));
    assert_eq!(rig.send("710#05"), ["085#0000000000000000"]);
    assert_eq!(rig.read(0x1001, 0), Ok(0));
}

/// An application that has a fault for a lost manager (6007h) raises the code that the device has already reported.
#[test]
fn a_lost_heartbeat_is_reported_once_though_the_application_has_a_fault_for_it() {
    let mut rig = Rig::full();
    rig.write(0x1016, 1, 4, 0x0010_0064).unwrap();
    rig.send("710#05");
    assert_eq!(rig.pass_ms(110), ["100000 085#3081110000000000"]);
    let raise = |rig: &mut Rig| {
        rig.device.emergency(ErrorCode::LIFE_GUARD, ErrorRegister::COMMUNICATION, [0; 5], &mut rig.od);
        rig.sent()
    };
    assert_eq!(raise(&mut rig), NOTHING);
    assert_eq!([0, 1].map(|sub| rig.read(0x1003, sub)), [Ok(1), Ok(0x8130)]);
    // The application's fault remains when the heartbeat is back.
    assert_eq!(rig.send("710#05"), NOTHING);
    assert_eq!(rig.read(0x1001, 0), Ok(0x11));
    rig.device.clear(ErrorRegister(0xFF), &mut rig.od);
    assert_eq!((rig.sent(), rig.read(0x1001, 0)), (vec!["085#0000000000000000".into()], Ok(0)));
    // Without an error of the device, the application's is reported.
    assert_eq!(raise(&mut rig), ["085#3081110000000000"]);
}

#[test]
fn an_additional_server_serves_once_it_is_switched_on() {
    let mut rig = Rig::full();
    assert_eq!(rig.send("6D0#4000100000000000"), NOTHING);
    rig.write(0x1201, 1, 4, 0x6D0).unwrap();
    rig.write(0x1201, 2, 4, 0x5D0).map_err(AbortCode).unwrap_err();
    rig.write(0x1201, 2, 4, 0x6D1).unwrap();
    assert_eq!(rig.send("6D0#4000100000000000"), ["6D1#4300100092010000"]);
    assert_eq!(rig.write(0x1201, 1, 4, 0x6D2), Err(AbortCode::INVALID_VALUE.0));
    rig.write(0x1201, 1, 4, 0x8000_06D0).unwrap();
    assert_eq!(rig.send("6D0#4000100000000000"), NOTHING);
}

#[test]
fn stopping_forgets_a_transfer_and_begins_to_count_sync_anew() {
    let mut rig = Rig::full();
    rig.write(0x1019, 0, 1, 10).unwrap();
    rig.write(0x1006, 0, 4, 10_000).unwrap();
    rig.write(0x1005, 0, 4, 0x4000_0080).unwrap();
    assert_eq!(rig.pass_ms(20), ["10000 080#01", "20000 080#02"]);
    assert_eq!(rig.send("605#4008100000000000"), ["585#410810000B000000"]);
    rig.send("000#0205");
    assert_eq!(rig.pass_ms(35), NOTHING);
    assert_eq!(rig.send("000#8005"), NOTHING, "what was due meanwhile is not sent later");
    let answer = rig.send("605#6000000000000000").concat();
    assert!(answer.starts_with("585#80"), "{answer}");
    assert_eq!(rig.pass_ms(10), ["10000 080#01"]);
}

#[test]
fn a_server_that_is_changed_through_itself_answers_under_its_old_identifiers() {
    let mut rig = Rig::with("1201:01 u32 rw - 0x6D0\n1201:02 u32 rw - 0x6D1");
    // Switched off, and on again under another identifier, both through the default server.
    assert_eq!(rig.send("6D0#23011201D1060080"), ["6D1#6001120100000000"]);
    assert_eq!(rig.send("6D0#4000100000000000"), NOTHING);
    rig.write(0x1201, 1, 4, 0x6D5).unwrap();
    assert_eq!(rig.send("6D5#4000100000000000"), ["6D1#4300100092010000"]);
    // The change takes effect even if the device was stopped before the answer was sent.
    rig.device.handle_frame(rig.now, &common::frame("6D5#23011201D5060080"), &mut rig.od);
    rig.send("000#0205");
    rig.send("000#8005");
    assert_eq!(rig.send("6D5#4000100000000000"), NOTHING);
}

#[test]
fn a_server_goes_on_with_its_transfer_when_another_one_before_it_is_switched_off() {
    let mut od = TestOd::new(FULL).with(
        "1201:01 u32 rw - 0x6D0
         1201:02 u32 rw - 0x6D1
         1202:01 u32 rw - 0x6D2
         1202:02 u32 rw - 0x6D3",
    );
    let mut device: Device<0, 0, 3, 0> = Device::new(NODE, Behaviour::CIA_301);
    device.restart(Instant::ZERO, &mut od);
    assert!(device.poll_transmit(Instant::ZERO, &mut od).is_some(), "it boots");
    let mut send = |text| {
        device.handle_frame(Instant::ZERO, &common::frame(text), &mut od);
        core::iter::from_fn(|| device.poll_transmit(Instant::ZERO, &mut od)).map(|frame| frame.to_string()).last()
    };
    assert_eq!(send("6D2#4008100000000000").as_deref(), Some("6D3#410810000B000000"));
    assert_eq!(send("605#23011201D0060080").as_deref(), Some("585#6001120100000000"));
    assert_eq!(send("6D2#6000000000000000").as_deref(), Some("6D3#00746573742D6465"));
}
