//! NMT, boot-up and error control of a device.

use crate::common::testing::TestOd;
use crate::common::{FULL, NODE, NOTHING, Rig};
use lexican_runtime::device::{Behaviour, Device, ErrorControlRule, Event};
use lexican_runtime::service::nmt::Reset;
use lexican_runtime::service::{guarding, heartbeat_consumer};
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{AbortCode, Instant, NodeId};

#[test]
fn boot_up_comes_first_after_power_on_and_after_every_reset() {
    for (reset, event) in [("000#8105", Reset::Node), ("000#8200", Reset::Communication)] {
        let mut rig = Rig::full().operational();
        assert_eq!(rig.send(reset), NOTHING);
        assert_eq!((rig.take_events(), rig.state()), (vec![Event::Reset(event)], NmtState::Initialising));
        // Until the application has reset its values, the device neither sends nor receives.
        assert_eq!(rig.send("605#4000100000000000"), NOTHING);
        assert_eq!(rig.device.poll_timeout(), None);
        rig.restart();
        assert_eq!(rig.sent(), ["705#00"]);
        assert_eq!(rig.state(), NmtState::PreOperational);
    }
}

#[test]
fn each_state_allows_what_the_standard_says() {
    let upload = "605#4000100000000000";
    let answered = "585#4300100092010000";
    let mut rig = Rig::full();
    assert_eq!(rig.send(upload), [answered]);
    assert_eq!(rig.send("385#R"), NOTHING);
    rig.send("205#0F00");
    assert_eq!(rig.od.get(0x6040, 0), 0);

    assert_eq!(rig.send("000#0105"), ["185#3412"]);
    assert_eq!(rig.send(upload), [answered]);
    assert_eq!(rig.send("385#R"), ["385#3412FEFFFFFF"]);
    rig.send("205#0F00");
    assert_eq!(rig.od.get(0x6040, 0), 0x0F);

    rig.send("000#0205");
    assert_eq!(rig.state(), NmtState::Stopped);
    assert_eq!(rig.send(upload), NOTHING);
    assert_eq!(rig.send("385#R"), NOTHING);
    assert_eq!(rig.send("080#"), NOTHING);
    assert_eq!(rig.send("705#R1"), ["705#04"]);
}

#[test]
fn a_heartbeat_begins_at_once_when_it_is_set_and_ends_when_it_is_zero() {
    let mut rig = Rig::full();
    assert_eq!(rig.pass_ms(1000), NOTHING);
    rig.write(0x1017, 0, 2, 100).unwrap();
    assert_eq!(rig.pass_ms(210), ["0 705#7F", "100000 705#7F", "200000 705#7F"]);
    rig.write(0x1017, 0, 2, 0).unwrap();
    assert_eq!(rig.pass_ms(1000), NOTHING);
}

#[test]
fn after_boot_up_the_first_heartbeat_comes_one_period_later() {
    let mut rig = Rig::full();
    rig.od.set(0x1017, 0, 100);
    rig.restart();
    assert_eq!(rig.sent(), ["705#00"]);
    assert_eq!(rig.pass_ms(100), ["100000 705#7F"]);
}

#[test]
fn the_heartbeat_has_precedence_over_guarding() {
    let mut rig = Rig::full();
    assert_eq!(rig.send("705#R1"), ["705#7F"]);
    assert_eq!(rig.send("705#R1"), ["705#FF"]);
    rig.write(0x100C, 0, 2, 100).unwrap();
    rig.write(0x100D, 0, 1, 3).unwrap();
    rig.write(0x1017, 0, 2, 1000).unwrap();
    rig.sent();
    assert_eq!(rig.send("705#R1"), NOTHING);
}

#[test]
fn where_they_exclude_each_other_the_second_is_refused() {
    let behaviour = Behaviour { error_control: ErrorControlRule::Exclusive, ..Behaviour::CIA_301 };
    let mut rig = Rig::deviating(behaviour);
    rig.write(0x1017, 0, 2, 1000).unwrap();
    rig.write(0x100C, 0, 2, 100).unwrap();
    assert_eq!(rig.write(0x100D, 0, 1, 3), Err(AbortCode::PARAMETER_INCOMPATIBLE.0));
    rig.write(0x1017, 0, 2, 0).unwrap();
    rig.write(0x100D, 0, 1, 3).unwrap();
    assert_eq!(rig.write(0x1017, 0, 2, 1000), Err(AbortCode::PARAMETER_INCOMPATIBLE.0));
}

#[test]
fn life_guarding_that_is_lost_is_an_emergency_and_leads_to_pre_operational() {
    let mut rig = Rig::full();
    rig.write(0x100C, 0, 2, 100).unwrap();
    rig.write(0x100D, 0, 1, 3).unwrap();
    let mut rig = rig.operational();
    assert_eq!(rig.pass_ms(1000), NOTHING);
    assert_eq!(rig.send("705#R1"), ["705#05"]);
    assert_eq!(rig.pass_ms(300), ["300000 085#3081110000000000"]);
    let lost = Event::LifeGuarding(guarding::Event::Lost);
    assert_eq!(rig.take_events(), [lost, Event::StateChanged(NmtState::PreOperational)]);
    assert_eq!(rig.send("705#R1"), ["085#0000000000000000", "705#FF"]);
    assert_eq!(rig.take_events(), [Event::LifeGuarding(guarding::Event::Restored)]);
}

#[test]
fn error_behaviour_is_what_1029h_says() {
    for (behaviour, state) in [(0, NmtState::PreOperational), (1, NmtState::Operational), (2, NmtState::Stopped)] {
        let mut rig = Rig::full();
        rig.write(0x1029, 1, 1, behaviour).unwrap();
        let mut rig = rig.operational();
        rig.device.communication_failed(rig.now);
        rig.sent();
        assert_eq!(rig.state(), state);
    }
    assert_eq!(Rig::full().write(0x1029, 1, 1, 3), Err(AbortCode::INVALID_VALUE.0));
}

#[test]
fn a_consumed_heartbeat_that_is_lost_is_an_emergency_until_it_is_back() {
    let mut rig = Rig::full();
    rig.write(0x1016, 1, 4, 0x0010_0064).unwrap();
    let mut rig = rig.operational();
    assert_eq!(rig.pass_ms(1000), NOTHING);
    let node = NodeId::literal(0x10);
    let heartbeat = |event| Event::Heartbeat { node, event };
    rig.send("710#05");
    assert_eq!(rig.take_events(), [heartbeat(heartbeat_consumer::Event::Started(NmtState::Operational))]);
    assert_eq!(rig.pass_ms(100), ["100000 085#3081110000000000"]);
    assert_eq!(
        rig.take_events(),
        [heartbeat(heartbeat_consumer::Event::Lost), Event::StateChanged(NmtState::PreOperational)]
    );
    assert_eq!(rig.send("710#05"), ["085#0000000000000000"]);
}

#[test]
fn a_node_is_consumed_once_only() {
    let mut rig = Rig::full();
    rig.write(0x1016, 1, 4, 0x0010_0064).unwrap();
    rig.write(0x1016, 1, 4, 0x0010_0064).unwrap();
    assert_eq!(rig.write(0x1016, 2, 4, 0x0010_00C8), Err(AbortCode::PARAMETER_INCOMPATIBLE.0));
    // An entry with time 0 or without a node monitors nothing.
    rig.write(0x1016, 2, 4, 0x0010_0000).unwrap();
    rig.write(0x1016, 3, 4, 0x0080_00C8).unwrap();
}

#[test]
fn what_the_device_has_no_room_for_is_refused() {
    let mut rig = Rig::with(
        "1016:04 u32 rw - 0
         1403:01 u32 rw - 0x80000505
         1404:01 u32 rw - 0x80000506
         1603:00 u8 rw - 0
         1604:00 u8 rw - 0",
    );
    let refused = Err(AbortCode::DEVICE_INCOMPATIBLE.0);
    assert_eq!(rig.write(0x1016, 4, 4, 0x0010_0064), refused);
    rig.write(0x1016, 4, 4, 0).unwrap();
    rig.write(0x1403, 1, 4, 0x505).unwrap();
    assert_eq!(rig.write(0x1404, 1, 4, 0x506), refused);
}

#[test]
fn error_behaviour_0_leads_out_of_operational_only() {
    let mut rig = Rig::full();
    rig.send("000#0205");
    rig.take_events();
    rig.device.communication_failed(rig.now);
    rig.sent();
    assert_eq!((rig.state(), rig.take_events()), (NmtState::Stopped, vec![]));
}

#[test]
fn a_device_starts_itself_when_1f80h_says_so() {
    let cases = [(0x00, true), (0x08, true), (0x04, false), (0x0C, false), (0x01, false)];
    for (startup, starts) in cases {
        let od = TestOd::new(FULL).with(&format!("1F80:00 u32 rw - {startup}"));
        let mut rig = Rig { device: Device::new(NODE, Behaviour::CIA_301), od, now: Instant::ZERO, events: vec![] };
        rig.restart();
        let started: [&str; 2] = ["705#00", "185#3412"];
        assert_eq!(rig.sent(), started[..1 + usize::from(starts)], "{startup:02X}");
        let events = [Event::StateChanged(NmtState::Operational)];
        assert_eq!(rig.take_events(), events[..usize::from(starts)]);
    }
}
