//! Profile velocity and profile torque mode.

use crate::support::Rig;

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
