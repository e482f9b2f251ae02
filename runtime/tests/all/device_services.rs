//! How the services of a device keep out of each other's way, and how a change of one affects another.

use crate::common::{self, NOTHING, Rig};
use lexican_runtime::device::{Behaviour, Event};
use lexican_runtime::object::{Address, WritableIn};
use lexican_runtime::service::rpdo;
use lexican_runtime::service::tpdo::Triggers;
use lexican_runtime::wire::emcy::{ErrorCode, ErrorRegister};
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{AbortCode, Duration};

#[test]
fn a_heartbeat_that_is_switched_on_ends_life_guarding() {
    let mut rig = Rig::with("100C:00 u16 rw - 100\n100D:00 u8 rw - 3").operational();
    rig.send("705#R1");
    rig.write(0x1017, 0, 2, 1000).unwrap();
    rig.take_events();
    assert_eq!(rig.pass_ms(500), ["0 705#05"]);
    assert_eq!(rig.take_events(), []);
    // Without the heartbeat, guarding begins again with the next request.
    rig.write(0x1017, 0, 2, 0).unwrap();
    rig.take_events();
    rig.pass_ms(1000);
    assert_eq!(rig.take_events(), []);
    rig.send("705#R1");
    rig.pass_ms(300);
    assert!(matches!(rig.take_events()[..], [Event::LifeGuarding(_), ..]));
}

#[test]
fn what_local_control_writes_takes_effect() {
    let mut rig = Rig::full().operational();
    let write =
        |rig: &mut Rig, index, sub, data: &[u8]| rig.device.write(rig.now, Address::new(index, sub), data, &mut rig.od);
    assert_eq!(write(&mut rig, 0x1017, 0, &100_u16.to_le_bytes()), Ok(()));
    assert_eq!(rig.pass_ms(150), ["0 705#05", "100000 705#05"]);
    assert_eq!(write(&mut rig, 0x1017, 0, &[0, 0]), Ok(()));
    assert_eq!(rig.pass_ms(500), NOTHING);
    // Another identifier for TPDO1, by the rules for clients: the PDO must be switched off first.
    assert_eq!(write(&mut rig, 0x1800, 1, &0x186_u32.to_le_bytes()), Err(AbortCode::INVALID_VALUE));
    assert_eq!(write(&mut rig, 0x1800, 1, &0x8000_0185_u32.to_le_bytes()), Ok(()));
    assert_eq!(write(&mut rig, 0x1800, 1, &0x186_u32.to_le_bytes()), Ok(()));
    assert_eq!(rig.sent(), ["186#3412"]);
    // A client cannot write this one, and a TPDO reports its change.
    assert_eq!(write(&mut rig, 0x6041, 0, &[7, 0]), Ok(()));
    assert_eq!(rig.sent(), ["186#0700"]);
    assert_eq!(write(&mut rig, 0x6042, 0, &[7, 0]), Err(AbortCode::NO_SUCH_OBJECT));
    assert_eq!(rig.take_events(), []);
}

#[test]
fn what_a_parameter_holds_can_be_written_back() {
    // None of these could be written as a new value: TIME is not produced, 0 is no identifier of an SDO, 253 is no type
    // of an RPDO.
    let entries = "1012:00 u32 rw - 0x40000100\n1201:01 u32 rw - 0\n1400:01 u32 rw - 0x205\n1400:02 u8 rw - 253";
    let mut rig = Rig::with(entries);
    for (index, sub, len, value) in
        [(0x1012, 0, 4, 0x4000_0100), (0x1201, 1, 4, 0), (0x1400, 1, 4, 0x205), (0x1400, 2, 1, 253)]
    {
        assert_eq!(rig.write(index, sub, len, value), Ok(()), "{index:04X}");
    }
    assert_eq!(rig.write(0x1012, 0, 4, 0x4000_0101), Err(0x0609_0030));
    assert_eq!(rig.write(0x1400, 2, 1, 252), Err(0x0609_0030));
}

#[test]
fn the_generic_bit_stays_as_long_as_there_is_any_error() {
    let mut rig = Rig::with("1016:01 u32 rw - 0x00060064");
    rig.send("706#05");
    assert_eq!(rig.pass_ms(200), ["100000 085#3081110000000000"]);
    rig.device.emergency(ErrorCode(0x3000), ErrorRegister::VOLTAGE, [0; 5], &mut rig.od);
    assert_eq!((rig.sent(), rig.od.get(0x1001, 0)), (vec!["085#0030150000000000".into()], 0x15));
    rig.device.clear(ErrorRegister(0xFF), &mut rig.od);
    assert_eq!((rig.sent(), rig.od.get(0x1001, 0)), (vec!["085#0000110000000000".into()], 0x11));
    assert_eq!(rig.send("706#05"), ["085#0000000000000000"]);
}

#[test]
fn a_heartbeat_that_is_back_does_not_end_errors_of_the_application() {
    for (errors, with_heartbeat_lost) in [(ErrorRegister::GENERIC, 0x11), (ErrorRegister::VOLTAGE, 0x15)] {
        let mut rig = Rig::with("1016:01 u32 rw - 0x00060064");
        rig.device.emergency(ErrorCode(0x1000), errors, [0; 5], &mut rig.od);
        let alone = rig.od.get(0x1001, 0);
        rig.send("706#05");
        rig.pass_ms(200);
        assert_eq!(rig.od.get(0x1001, 0), with_heartbeat_lost);
        assert_eq!(rig.send("706#05"), NOTHING);
        assert_eq!((rig.od.get(0x1001, 0), u64::from(rig.device.error_register().0)), (alone, alone));
        rig.device.clear(errors, &mut rig.od);
        assert_eq!((rig.sent(), rig.od.get(0x1001, 0)), (vec!["085#0000000000000000".into()], 0));
    }
}

#[test]
fn a_change_that_waits_is_sent_also_after_the_tpdo_s_parameters_were_written() {
    let writes = [(2, 1, 255, "99500 185#0700"), (2, 1, 254, "99500 185#0700"), (5, 2, 500, "99500 185#0700")];
    for (sub, size, value, expected) in writes {
        // Inhibited for 100 ms after the TPDO that was sent on entering OPERATIONAL.
        let mut rig = Rig::with("1800:03 u16 rw - 1000").operational();
        rig.pass(Duration::from_micros(500));
        rig.od.set(0x6041, 0, 7);
        rig.device.changed(Address::new(0x6041, 0));
        rig.write(0x1800, sub, size, value).unwrap();
        assert_eq!(rig.pass_ms(200), [expected], "1800:{sub:02X} = {value}");
    }
    // An event for type 255 remains one for type 0.
    let mut rig = Rig::with("1800:03 u16 rw - 1000").operational();
    rig.device.request_tpdo(1);
    rig.write(0x1800, 2, 1, 0).unwrap();
    assert_eq!(rig.pass_ms(200), NOTHING);
    assert_eq!([rig.send("080#"), rig.send("080#")], [vec!["185#3412".to_string()], vec![]]);
}

#[test]
fn a_tpdo_that_is_not_sent_at_the_start_is_compared_with_what_there_was_then() {
    let triggers_255 = Triggers { start: false, ..Triggers::ALL };
    let behaviour = Behaviour { triggers_255, ..Behaviour::CIA_301 };
    let mut rig = Rig::deviating(behaviour).operational();
    let mut compare = |value| {
        rig.od.set(0x6041, 0, value);
        rig.device.compare(&mut rig.od);
        rig.sent().concat()
    };
    assert_eq!([0x1234, 1, 1, 2].map(&mut compare), ["", "185#0100", "", "185#0200"]);
}

#[test]
fn a_sync_that_fell_into_stopped_is_not_sent_later() {
    let mut rig = Rig::with("1005:00 u32 rw - 0x40000080\n1006:00 u32 rw - 10000").operational();
    rig.pass_ms(5);
    rig.send("000#0205");
    // `handle_timeout` is not called in this time.
    rig.now += Duration::from_millis(12);
    assert_eq!(rig.send("000#0105"), ["185#3412"]);
    assert_eq!(rig.pass_ms(20), ["10000 080#", "20000 080#"]);
}

#[test]
fn a_synchronous_rpdo_that_the_dictionary_refuses_is_not_reported_as_applied() {
    let mut rig = Rig::with("1400:02 u8 rw - 1\n1402:02 u8 rw - 1").operational();
    // An object that does not exist acts like one that refuses its value.
    let whole = rig.od.clone();
    rig.od = whole.clone().without(0x607A);
    rig.send("205#1F00");
    rig.send("405#1F0088130000");
    rig.send("080#");
    let refused = rpdo::Event::Refused { address: Address::new(0x607A, 0), reason: AbortCode::NO_SUCH_OBJECT };
    assert_eq!(rig.device.applied().collect::<Vec<_>>(), [(1, rpdo::Event::Received), (3, refused)]);
    rig.od = whole;
    rig.send("405#1F0008000000");
    rig.send("080#");
    assert_eq!(rig.device.applied().collect::<Vec<_>>(), [(3, rpdo::Event::Received)]);
    rig.send("080#");
    assert_eq!(rig.device.applied().count(), 0);
}

#[test]
fn parameters_out_of_their_range_are_refused() {
    let invalid = Err(AbortCode::INVALID_VALUE.0);
    let mut rig = Rig::full();
    rig.write(0x1800, 1, 4, 0x8000_0185).unwrap();
    assert_eq!([240, 241, 255].map(|start| rig.write(0x1800, 6, 1, start)), [Ok(()), invalid, invalid]);
    // TIME: the device consumes it as 100h.
    assert_eq!(rig.write(0x1012, 0, 4, 0x8000_00FF), invalid, "the identifier stays while TIME exists");
    assert_eq!(rig.write(0x1012, 0, 4, 0x4000_0100), invalid, "it is not produced");
    assert_eq!(rig.write(0x1012, 0, 4, 0xC000_0100), invalid, "it is not produced");
    for cob_id in [0x8000_0100, 0x0000_0100, 0x8000_00FF] {
        assert_eq!(rig.write(0x1012, 0, 4, cob_id), Ok(()), "{cob_id:08X}");
    }
}

#[test]
fn a_tpdo_may_not_have_the_identifier_of_another_service() {
    let mut rig = Rig::with("1201:01 u32 rw - 0x700\n1201:02 u32 rw - 0x6F0\n1014:00 u32 rw - 0x90");
    rig.write(0x1201, 2, 4, 0x8000_0000).unwrap();
    rig.write(0x1201, 2, 4, 0x0000_06D0).unwrap();
    rig.write(0x1800, 1, 4, 0x8000_0185).unwrap();
    let cases = [(0x80, "SYNC"), (0x90, "EMCY"), (0x100, "TIME"), (0x6D0, "an SDO"), (0x385, "another TPDO")];
    for (id, whose) in cases {
        assert_eq!(rig.write(0x1800, 1, 4, id), Err(AbortCode::PARAMETER_INCOMPATIBLE.0), "{whose}");
    }
    // A service that is switched off occupies no identifier.
    rig.write(0x1014, 0, 4, 0x8000_0090).unwrap();
    assert_eq!(rig.write(0x1800, 1, 4, 0x90), Ok(()));
}

#[test]
fn error_control_does_not_wait_for_sdo() {
    let mut rig = Rig::full();
    for frame in ["605#4000100000000000", "705#R1"] {
        rig.device.handle_frame(rig.now, &common::frame(frame), &mut rig.od);
    }
    assert_eq!(rig.sent(), ["705#7F", "585#4300100092010000"]);
}

#[test]
fn the_error_register_shows_the_end_of_an_error_in_each_case() {
    // The deadline of an RPDO passes; outside of OPERATIONAL there is no deadline.
    let lost = || {
        let mut rig = Rig::with("1400:05 u16 rw - 20").operational();
        rig.send("205#1F00");
        assert_eq!(rig.pass_ms(50), ["20000 085#5082110000000000"]);
        assert_eq!(rig.od.get(0x1001, 0), 0x11);
        rig
    };
    let over = ["085#0000000000000000"];
    let mut rig = lost();
    rig.device.enter(rig.now, NmtState::PreOperational);
    assert_eq!((rig.sent(), rig.od.get(0x1001, 0)), (over.map(String::from).to_vec(), 0));
    let mut rig = lost();
    rig.device.enter(rig.now, NmtState::PreOperational);
    assert_eq!(rig.send("605#4001100000000000"), [over[0], "585#4F01100000000000"], "also when asked at once");
    // By 1029h, a failure of the bus has the same effect.
    let mut rig = lost();
    rig.device.communication_failed(rig.now);
    assert_eq!((rig.sent(), rig.state()), (over.map(String::from).to_vec(), NmtState::PreOperational));
}

#[test]
fn no_service_gets_the_identifier_of_another_one() {
    let mut rig = Rig::with("1201:01 u32 rw - 0x6D0\n1201:02 u32 rw - 0x6D1\n1202:01 u32 rw - 0x80000000");
    // EMCY, TIME and the RPDO are switched off first; afterwards they have other identifiers than before.
    rig.write(0x1014, 0, 4, 0x8000_0085).unwrap();
    rig.write(0x1012, 0, 4, 0x0000_0100).unwrap();
    rig.write(0x1400, 1, 4, 0x8000_0205).unwrap();
    let taken = [(0x185, "TPDO 1"), (0x385, "TPDO 3"), (0x405, "RPDO 3"), (0x6D0, "a request"), (0x6D1, "an answer")];
    let services = [
        (0x1005, 0, 0, "SYNC"),
        (0x1012, 0, 0x8000_0000, "TIME"),
        (0x1014, 0, 0, "EMCY"),
        (0x1202, 1, 0, "an SDO"),
        (0x1400, 1, 0, "an RPDO"),
    ];
    for (index, sub, exists, service) in services {
        for (id, whose) in taken {
            let refused = Err(AbortCode::PARAMETER_INCOMPATIBLE.0);
            assert_eq!(rig.write(index, sub, 4, id | exists), refused, "{service} with the identifier of {whose}");
        }
    }
    assert_eq!(rig.write(0x1202, 1, 4, 0x80), Err(AbortCode::PARAMETER_INCOMPATIBLE.0), "that of SYNC");
    assert_eq!(rig.write(0x1005, 0, 4, 0x80), Ok(()), "its own");
    rig.write(0x1800, 1, 4, 0x8000_0185).unwrap();
    assert_eq!(rig.write(0x1014, 0, 4, 0x185), Ok(()), "what is switched off takes no identifier");
    assert_eq!(rig.write(0x1800, 1, 4, 0x185), Err(AbortCode::PARAMETER_INCOMPATIBLE.0), "and comes too late");
}

#[test]
fn entries_are_written_in_the_states_that_the_data_sheet_allows() {
    const RULES: &[WritableIn] = &[WritableIn::new(0x6040, 0, false, true), WritableIn::new(0x607A, 0, true, false)];
    let behaviour = Behaviour { writable_in: RULES, ..Behaviour::CIA_301 };
    let mut rig = Rig::deviating(behaviour);
    let refused = Err(AbortCode::DEVICE_STATE.0);
    assert_eq!([rig.write(0x6040, 0, 2, 1), rig.write(0x607A, 0, 4, 1)], [refused, Ok(())]);
    assert_eq!(rig.write(0x2000, 2, 1, 1), Ok(()), "which no rule concerns");
    let mut rig = rig.operational();
    assert_eq!([rig.write(0x6040, 0, 2, 1), rig.write(0x607A, 0, 4, 2)], [Ok(()), refused]);
    assert_eq!((rig.od.get(0x6040, 0), rig.od.get(0x607A, 0)), (1, 1));
    // An object that cannot be written can still be read, and the rules do not apply to PDOs.
    assert_eq!(rig.read(0x607A, 0), Ok(1));
    rig.send("405#020003000000");
    assert_eq!(rig.od.get(0x607A, 0), 3);
}
