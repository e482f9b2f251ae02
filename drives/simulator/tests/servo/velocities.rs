//! Profile velocity and profile torque mode.

use lexican_runtime::object::DataType::Unsigned32;
use simulator::servo::{Inputs, ServoModel};

use crate::support::{Rig, SERVO};

const VELOCITY: i64 = 3;
const TORQUE: i64 = 4;
const REACHED: u16 = 1 << 10;
const LIMITED: u16 = 1 << 11;
const SLOW: u16 = 1 << 12;

#[test]
fn the_velocity_follows_its_target_by_ramps() {
    let mut rig = Rig::enabled(VELOCITY);
    assert_eq!(rig.mode_bits(), [true, true, false], "it stands, as it is to");
    rig.set(0x6084, 0, 5000).set(0x60FF, 0, 1000).pass(50);
    assert_eq!((rig.velocity(), rig.mode_bits()), (500, [false, false, false]));
    rig.pass(50);
    assert_eq!((rig.velocity(), rig.mode_bits()), (1000, [true, false, false]));
    // Through 0: 200 ms with 6084h, 50 ms with 6083h.
    rig.set(0x60FF, 0, -500).pass(200);
    assert_eq!((rig.velocity(), rig.status(SLOW)), (0, true));
    rig.pass(50);
    assert_eq!((rig.velocity(), rig.status(REACHED)), (-500, true));
}

#[test]
fn windows_have_their_times() {
    let mut rig = Rig::enabled(VELOCITY);
    rig.set(0x606D, 0, 100).set(0x606E, 0, 30).set(0x6070, 0, 20).set(0x60FF, 0, 1000).pass(119);
    assert!(!rig.status(REACHED), "900 units/s since 90 ms");
    rig.pass(1);
    assert!(rig.status(REACHED));
    rig.set(0x60FF, 0, 0).pass(119);
    assert!(!rig.status(SLOW), "5 units/s since 99.5 ms");
    rig.pass(1);
    assert!(rig.status(SLOW));
}

#[test]
fn halt_stops_and_the_target_counts_again_after_it() {
    let mut rig = Rig::enabled(VELOCITY);
    rig.set(0x60FF, 0, 1000).pass(200).control(0x10F).pass(100);
    assert_eq!((rig.velocity(), rig.status(REACHED)), (0, true));
    rig.control(0x0F).pass(100);
    assert_eq!(rig.velocity(), 1000);
}

#[test]
fn polarity_turns_velocities_round() {
    let mut rig = Rig::enabled(VELOCITY);
    rig.set(0x607E, 0, 0x40).set(0x60FF, 0, 1000).pass(200);
    assert_eq!(rig.velocity(), 1000);
    assert_eq!(rig.servo.shaft(rig.now).velocity, -1000.0);
}

#[test]
fn the_axis_stops_at_a_software_limit() {
    let mut rig = Rig::enabled(VELOCITY);
    rig.set(0x607D, 1, -100).set(0x607D, 2, 500).set(0x60FF, 0, 1000).pass(2000);
    assert_eq!((rig.position(), rig.velocity(), rig.status(LIMITED)), (500, 0, true));
    rig.set(0x60FF, 0, -1000).pass(50);
    assert!(rig.velocity() < 0 && !rig.status(LIMITED));
    rig.pass(2000);
    assert_eq!((rig.position(), rig.status(LIMITED)), (-100, true));
}

#[test]
fn a_limit_switch_stops_the_axis() {
    let mut rig = Rig::enabled(VELOCITY);
    rig.inputs(|inputs| inputs.machine.negative_limit = Some(-500.0)).set(0x60FF, 0, -1000).pass(2000);
    assert_eq!((rig.position(), rig.status(LIMITED)), (-505, true));
    rig.set(0x60FF, 0, 1000).pass(1000);
    assert!(rig.position() > 0);
}

#[test]
fn a_blocked_shaft_slips() {
    let mut rig = Rig::enabled(VELOCITY);
    rig.set(0x6065, 0, 0).set(0x60FF, 0, 1000).pass(200).inputs(|inputs| inputs.blocked = true).pass(10);
    assert_eq!((rig.velocity(), rig.mode_bits()), (0, [false, true, true]));
    assert_eq!(rig.get(0x6077, 0), 1000);
}

/// The load turns with 10 units/s for each 0.1 %.
#[test]
fn the_torque_rises_with_its_slope_and_turns_the_axis() {
    let mut rig = Rig::enabled(TORQUE);
    rig.set(0x6071, 0, 500).pass(250);
    assert_eq!((rig.get(0x6077, 0), rig.velocity(), rig.status(REACHED)), (250, 2500, false));
    rig.pass(250);
    assert_eq!((rig.get(0x6077, 0), rig.velocity(), rig.status(REACHED)), (500, 5000, true));
    rig.set(0x6072, 0, 300).set(0x6071, 0, 501).pass(500);
    assert_eq!((rig.get(0x6077, 0), rig.status(LIMITED)), (300, true));
    rig.control(0x10F).pass(300);
    assert_eq!((rig.get(0x6077, 0), rig.status(REACHED)), (0, true));
    rig.control(0x0F).set(0x6071, 0, -100).pass(400);
    assert_eq!((rig.get(0x6077, 0), rig.velocity()), (-100, -1000));
}

#[test]
fn another_mode_takes_the_axis_over() {
    let mut rig = Rig::enabled(VELOCITY);
    rig.set(0x60FF, 0, 1000).pass(200).set(0x6060, 0, 1);
    rig.pass(100);
    assert_eq!((rig.velocity(), rig.status(REACHED)), (0, true), "it brakes with 6084h");
    rig.travel(0, 0).pass(50);
    assert!(rig.velocity() < 0);
    rig.set(0x6060, 0, 3).pass(200);
    assert_eq!(rig.velocity(), 1000);
}

/// 60A9h in revolutions per minute, 60AAh in revolutions per minute and second, 4000 units a revolution.
#[test]
fn velocities_have_the_unit_that_the_data_sheet_names() {
    let units = [(0x608F, 1), (0x608F, 2), (0x60A9, 0), (0x60AA, 0)];
    let values = [4000, 1, 0x00B4_4700, 0x00C0_0300];
    let units: Vec<_> = units.into_iter().zip(values).map(|(at, value)| (at.0, at.1, Unsigned32, value)).collect();
    let mut rig = Rig::of(&ServoModel::CIA_402, &[SERVO, &units].concat());
    rig.set(0x6060, 0, VELOCITY).enable().set(0x6083, 0, 600).set(0x60FF, 0, 60).pass(100);
    assert_eq!((rig.velocity(), rig.servo.shaft(rig.now).velocity.round()), (60, 4000.0));
}

#[test]
fn inputs_are_set_by_name() {
    let mut inputs = Inputs::default();
    for (key, value, wrong) in [
        ("supply", "false", "no"),
        ("enable", "false", "0"),
        ("blocked", "true", "yes"),
        ("ignores_sync", "true", ""),
        ("fault", "0x4310", "0x14310"),
        ("warning", "17168", "none of them"),
        ("digital", "0x10000", "-1"),
        ("probe_1", "true", "high"),
        ("probe_2", "true", "low"),
        ("negative_limit", "-2000", "left"),
        ("positive_limit", "2000", "right"),
        ("home_low", "100", "low"),
        ("home_high", "200", "high"),
        ("index", "5", "five"),
        ("index_distance", "50", "fifty"),
    ] {
        let before = inputs;
        assert!(inputs.set(key, wrong).is_err() && inputs == before, "{key} = {wrong}");
        inputs.set(key, value).unwrap();
        assert_ne!(inputs, before, "{key}");
    }
    assert_eq!((inputs.fault, inputs.warning, inputs.digital), (Some(0x4310), Some(0x4310), 0x10000));
    assert_eq!((inputs.machine.home_switch, inputs.machine.index), (Some((100.0, 200.0)), Some((5.0, 50.0))));
    for key in ["fault", "warning", "negative_limit", "positive_limit", "home_low", "index"] {
        inputs.set(key, "none").unwrap();
    }
    assert_eq!((inputs.fault, inputs.machine.home_switch, inputs.machine.index), (None, None, None));
    assert!(inputs.set("brake", "true").unwrap_err().contains("there are supply"));
}
