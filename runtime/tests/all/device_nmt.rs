//! NMT, boot-up and error control of a device.

use crate::common::testing::TestOd;
use crate::common::{Bench, FULL, NODE, NOTHING};
use lexican_runtime::device::{Behaviour, Device, ErrorControlRule, Event};
use lexican_runtime::service::nmt::Reset;
use lexican_runtime::service::{guarding, heartbeat_consumer};
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{AbortCode, Instant, NodeId};

#[test]
fn boot_up_comes_first_after_power_on_and_after_every_reset() {
    for (reset, event) in [("000#8105", Reset::Node), ("000#8200", Reset::Communication)] {
        let mut bench = Bench::full().operational();
        assert_eq!(bench.send(reset), NOTHING);
        assert_eq!((bench.take_events(), bench.state()), (vec![Event::Reset(event)], NmtState::Initialising));
        // Until the application has reset its values, the device is silent and deaf.
        assert_eq!(bench.send("605#4000100000000000"), NOTHING);
        assert_eq!(bench.device.poll_timeout(), None);
        bench.restart();
        assert_eq!(bench.sent(), ["705#00"]);
        assert_eq!(bench.state(), NmtState::PreOperational);
    }
}

#[test]
fn each_state_allows_what_the_standard_says() {
    let upload = "605#4000100000000000";
    let answered = "585#4300100092010000";
    let mut bench = Bench::full();
    assert_eq!(bench.send(upload), [answered]);
    assert_eq!(bench.send("385#R"), NOTHING);
    bench.send("205#0F00");
    assert_eq!(bench.od.get(0x6040, 0), 0);

    assert_eq!(bench.send("000#0105"), ["185#3412"]);
    assert_eq!(bench.send(upload), [answered]);
    assert_eq!(bench.send("385#R"), ["385#3412FEFFFFFF"]);
    bench.send("205#0F00");
    assert_eq!(bench.od.get(0x6040, 0), 0x0F);

    bench.send("000#0205");
    assert_eq!(bench.state(), NmtState::Stopped);
    assert_eq!(bench.send(upload), NOTHING);
    assert_eq!(bench.send("385#R"), NOTHING);
    assert_eq!(bench.send("080#"), NOTHING);
    assert_eq!(bench.send("705#R1"), ["705#04"]);
}

#[test]
fn a_heartbeat_begins_at_once_when_it_is_set_and_ends_when_it_is_zero() {
    let mut bench = Bench::full();
    assert_eq!(bench.pass_ms(1000), NOTHING);
    bench.write(0x1017, 0, 2, 100).unwrap();
    assert_eq!(bench.pass_ms(210), ["0 705#7F", "100000 705#7F", "200000 705#7F"]);
    bench.write(0x1017, 0, 2, 0).unwrap();
    assert_eq!(bench.pass_ms(1000), NOTHING);
}

#[test]
fn after_boot_up_the_first_heartbeat_comes_one_period_later() {
    let mut bench = Bench::full();
    bench.od.set(0x1017, 0, 100);
    bench.restart();
    assert_eq!(bench.sent(), ["705#00"]);
    assert_eq!(bench.pass_ms(100), ["100000 705#7F"]);
}

#[test]
fn the_heartbeat_has_precedence_over_guarding() {
    let mut bench = Bench::full();
    assert_eq!(bench.send("705#R1"), ["705#7F"]);
    assert_eq!(bench.send("705#R1"), ["705#FF"]);
    bench.write(0x100C, 0, 2, 100).unwrap();
    bench.write(0x100D, 0, 1, 3).unwrap();
    bench.write(0x1017, 0, 2, 1000).unwrap();
    bench.sent();
    assert_eq!(bench.send("705#R1"), NOTHING);
}

#[test]
fn where_they_exclude_each_other_the_second_is_refused() {
    let behaviour = Behaviour { error_control: ErrorControlRule::Exclusive, ..Behaviour::CIA_301 };
    let mut bench = Bench::deviating(behaviour);
    bench.write(0x1017, 0, 2, 1000).unwrap();
    bench.write(0x100C, 0, 2, 100).unwrap();
    assert_eq!(bench.write(0x100D, 0, 1, 3), Err(AbortCode::PARAMETER_INCOMPATIBLE.0));
    bench.write(0x1017, 0, 2, 0).unwrap();
    bench.write(0x100D, 0, 1, 3).unwrap();
    assert_eq!(bench.write(0x1017, 0, 2, 1000), Err(AbortCode::PARAMETER_INCOMPATIBLE.0));
}

#[test]
fn life_guarding_that_is_lost_is_an_emergency_and_leads_to_pre_operational() {
    let mut bench = Bench::full();
    bench.write(0x100C, 0, 2, 100).unwrap();
    bench.write(0x100D, 0, 1, 3).unwrap();
    let mut bench = bench.operational();
    assert_eq!(bench.pass_ms(1000), NOTHING);
    assert_eq!(bench.send("705#R1"), ["705#05"]);
    assert_eq!(bench.pass_ms(300), ["300000 085#3081110000000000"]);
    let lost = Event::LifeGuarding(guarding::Event::Lost);
    assert_eq!(bench.take_events(), [lost, Event::StateChanged(NmtState::PreOperational)]);
    assert_eq!(bench.send("705#R1"), ["085#0000000000000000", "705#FF"]);
    assert_eq!(bench.take_events(), [Event::LifeGuarding(guarding::Event::Restored)]);
}

#[test]
fn error_behaviour_is_what_1029h_says() {
    for (behaviour, state) in [(0, NmtState::PreOperational), (1, NmtState::Operational), (2, NmtState::Stopped)] {
        let mut bench = Bench::full();
        bench.write(0x1029, 1, 1, behaviour).unwrap();
        let mut bench = bench.operational();
        bench.device.communication_failed(bench.now);
        bench.sent();
        assert_eq!(bench.state(), state);
    }
    assert_eq!(Bench::full().write(0x1029, 1, 1, 3), Err(AbortCode::INVALID_VALUE.0));
}

#[test]
fn a_consumed_heartbeat_that_is_lost_is_an_emergency_until_it_is_back() {
    let mut bench = Bench::full();
    bench.write(0x1016, 1, 4, 0x0010_0064).unwrap();
    let mut bench = bench.operational();
    assert_eq!(bench.pass_ms(1000), NOTHING);
    let node = NodeId::literal(0x10);
    let heartbeat = |event| Event::Heartbeat { node, event };
    bench.send("710#05");
    assert_eq!(bench.take_events(), [heartbeat(heartbeat_consumer::Event::Started(NmtState::Operational))]);
    assert_eq!(bench.pass_ms(100), ["100000 085#3081110000000000"]);
    assert_eq!(
        bench.take_events(),
        [heartbeat(heartbeat_consumer::Event::Lost), Event::StateChanged(NmtState::PreOperational)]
    );
    assert_eq!(bench.send("710#05"), ["085#0000000000000000"]);
}

#[test]
fn a_node_is_consumed_once_only() {
    let mut bench = Bench::full();
    bench.write(0x1016, 1, 4, 0x0010_0064).unwrap();
    bench.write(0x1016, 1, 4, 0x0010_0064).unwrap();
    assert_eq!(bench.write(0x1016, 2, 4, 0x0010_00C8), Err(AbortCode::PARAMETER_INCOMPATIBLE.0));
    // An entry with time 0 or without a node consumes nothing.
    bench.write(0x1016, 2, 4, 0x0010_0000).unwrap();
    bench.write(0x1016, 3, 4, 0x0080_00C8).unwrap();
}

#[test]
fn what_the_device_has_no_room_for_is_refused() {
    let mut bench = Bench::with(
        "1016:04 u32 rw - 0
         1403:01 u32 rw - 0x80000505
         1404:01 u32 rw - 0x80000506
         1603:00 u8 rw - 0
         1604:00 u8 rw - 0",
    );
    let refused = Err(AbortCode::DEVICE_INCOMPATIBLE.0);
    assert_eq!(bench.write(0x1016, 4, 4, 0x0010_0064), refused);
    bench.write(0x1016, 4, 4, 0).unwrap();
    bench.write(0x1403, 1, 4, 0x505).unwrap();
    assert_eq!(bench.write(0x1404, 1, 4, 0x506), refused);
}

#[test]
fn error_behaviour_0_leads_out_of_operational_only() {
    let mut bench = Bench::full();
    bench.send("000#0205");
    bench.take_events();
    bench.device.communication_failed(bench.now);
    bench.sent();
    assert_eq!((bench.state(), bench.take_events()), (NmtState::Stopped, vec![]));
}

#[test]
fn a_device_starts_itself_when_1f80h_says_so() {
    let cases = [(0x00, true), (0x08, true), (0x04, false), (0x0C, false), (0x01, false)];
    for (startup, starts) in cases {
        let od = TestOd::new(FULL).with(&format!("1F80:00 u32 rw - {startup}"));
        let mut bench = Bench { device: Device::new(NODE, Behaviour::CIA_301), od, now: Instant::ZERO, events: vec![] };
        bench.restart();
        let started: [&str; 2] = ["705#00", "185#3412"];
        assert_eq!(bench.sent(), started[..1 + usize::from(starts)], "{startup:02X}");
        let events = [Event::StateChanged(NmtState::Operational)];
        assert_eq!(bench.take_events(), events[..usize::from(starts)]);
    }
}
