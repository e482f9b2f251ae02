//! Interpolated position mode and the cyclic synchronous modes.

use lexican_runtime::profile::cia402::State;

use crate::support::Rig;

const INTERPOLATED: i64 = 7;
const POSITION: i64 = 8;
const VELOCITY: i64 = 9;
const TORQUE: i64 = 10;
const LIMITED: u16 = 1 << 11;
const FOLLOWS: u16 = 1 << 12;

/// A set-point with its SYNC, and the following cycle of 2 ms. With `by_rpdo`, it arrives as if by RPDO.
fn cycle(rig: &mut Rig, index: u16, sub: u8, value: i64, by_rpdo: bool) {
    rig.set(index, sub, value);
    if by_rpdo {
        rig.servo.set_point();
    }
    rig.sync().pass(2);
}

fn positions(rig: &mut Rig, targets: impl IntoIterator<Item = i64>) {
    for target in targets {
        cycle(rig, 0x607A, 0, target, true);
    }
}

#[test]
fn the_axis_is_at_each_set_point_one_cycle_after_its_sync() {
    let mut rig = Rig::enabled(POSITION);
    assert!(rig.status(FOLLOWS));
    for target in [2, 6, 12, 20, 20, 15] {
        let before = rig.position();
        rig.set(0x607A, 0, target);
        rig.servo.set_point();
        rig.pass(0);
        assert_eq!(rig.position(), before, "nothing moves before SYNC");
        rig.sync().pass(1);
        assert_eq!(rig.servo.shaft(rig.now).position, (before + target) as f64 / 2.0);
        rig.pass(1);
        assert_eq!(rig.position(), target);
    }
    assert_eq!(rig.velocity(), -2500);
}

#[test]
fn interpolation_is_enabled_by_bit_4() {
    let mut rig = Rig::enabled(INTERPOLATED);
    cycle(&mut rig, 0x60C1, 1, 5, true);
    assert_eq!((rig.position(), rig.status(FOLLOWS)), (0, false));
    rig.control(0x1F);
    assert!(rig.status(FOLLOWS));
    for target in [5, 10, 15] {
        cycle(&mut rig, 0x60C1, 1, target, true);
        assert_eq!(rig.position(), target);
    }
    // From 2500 units/s to a standstill with 6084h.
    rig.control(0x0F).pass(250);
    assert_eq!((rig.velocity(), rig.status(FOLLOWS), rig.state()), (0, false, State::OperationEnabled));
}

#[test]
fn a_missed_set_point_is_bridged_by_the_velocity() {
    for lost in [&[5][..], &[5, 6], &[5, 6, 7]] {
        let mut rig = Rig::enabled(POSITION);
        for step in 1..20 {
            rig.set(0x607A, 0, step * 4);
            if !lost.contains(&step) {
                rig.servo.set_point();
            }
            rig.sync().pass(2);
            assert_eq!((rig.position(), rig.velocity()), (step * 4, 2000), "{step} without {lost:?}");
        }
    }
}

#[test]
fn a_missed_sync_is_bridged_by_the_velocity() {
    let mut rig = Rig::enabled(POSITION);
    positions(&mut rig, [4, 8]);
    rig.pass(4);
    assert_eq!(rig.position(), 16);
    positions(&mut rig, [20, 24]);
    assert_eq!((rig.position(), rig.state()), (24, State::OperationEnabled));
}

#[test]
fn too_many_missed_set_points_are_a_fault() {
    let mut rig = Rig::enabled(POSITION);
    positions(&mut rig, [4, 8]);
    for _ in 0..3 {
        rig.sync().pass(2);
        assert_eq!(rig.state(), State::OperationEnabled);
    }
    rig.sync().pass(100);
    assert_eq!((rig.state(), rig.emergencies()), (State::Fault, vec![0x8700]));
}

#[test]
fn too_long_without_sync_is_a_fault() {
    let mut rig = Rig::enabled(POSITION);
    // Before the first SYNC, none is missed.
    rig.pass(1000);
    assert_eq!(rig.state(), State::OperationEnabled);
    positions(&mut rig, [4, 8]);
    // Three SYNCs are missed, and the fourth is half a cycle late.
    rig.pass(6);
    assert_eq!(rig.state(), State::OperationEnabled);
    rig.pass(1);
    assert_eq!(rig.state(), State::FaultReactionActive);
    rig.pass(100);
    assert_eq!((rig.state(), rig.velocity(), rig.emergencies()), (State::Fault, 0, vec![0x8700]));
}

#[test]
fn sync_that_is_ignored_is_missed() {
    let mut rig = Rig::enabled(POSITION);
    positions(&mut rig, [4, 8]);
    rig.inputs(|inputs| inputs.ignores_sync = true);
    positions(&mut rig, [12, 16, 20, 24, 28]);
    assert_eq!(rig.emergencies(), [0x8700]);
}

#[test]
fn set_points_that_come_otherwise_than_by_rpdo_are_not_missed() {
    let mut rig = Rig::enabled(POSITION);
    cycle(&mut rig, 0x607A, 0, 4, false);
    for _ in 0..20 {
        rig.sync().pass(2);
    }
    assert_eq!((rig.position(), rig.state()), (4, State::OperationEnabled));
}

#[test]
fn a_jump_is_a_following_error_and_moves_nothing() {
    let mut rig = Rig::enabled(POSITION);
    positions(&mut rig, [101]);
    assert_eq!((rig.state(), rig.position(), rig.emergencies()), (State::Fault, 0, vec![0x8611]));
}

#[test]
fn software_limits_hold() {
    let mut rig = Rig::enabled(POSITION);
    rig.set(0x607D, 1, -5).set(0x607D, 2, 10);
    positions(&mut rig, [4, 8, 12, 16]);
    assert_eq!((rig.position(), rig.status(LIMITED)), (10, true));
    positions(&mut rig, [8]);
    assert_eq!((rig.position(), rig.status(LIMITED)), (8, false));
}

#[test]
fn a_position_offset_is_added() {
    let mut rig = Rig::enabled(POSITION);
    rig.set(0x60B0, 0, 10);
    positions(&mut rig, [4, 8]);
    assert_eq!(rig.position(), 18);
}

#[test]
fn halt_stops_and_the_cycle_goes_on_after_it() {
    let mut rig = Rig::enabled(POSITION);
    positions(&mut rig, [4, 8]);
    rig.control(0x10F).pass(200);
    assert_eq!((rig.velocity(), rig.mode_bits(), rig.state()), (0, [true, false, false], State::OperationEnabled));
    let stands = rig.position();
    rig.control(0x0F);
    positions(&mut rig, [stands + 4]);
    assert_eq!(rig.position(), stands + 4);
}

#[test]
fn velocities_are_reached_by_the_next_sync() {
    let mut rig = Rig::enabled(VELOCITY);
    for target in [500, 1000, 1000, -200, 0] {
        cycle(&mut rig, 0x60FF, 0, target, true);
        assert_eq!(rig.velocity(), target);
    }
}

#[test]
fn torques_are_reached_by_the_next_sync() {
    let mut rig = Rig::enabled(TORQUE);
    for (target, torque) in [(50, 50), (-20, -20), (1200, 1000)] {
        cycle(&mut rig, 0x6071, 0, target, true);
        assert_eq!((rig.get(0x6077, 0), rig.velocity()), (torque, torque * 10));
    }
    assert!(rig.status(LIMITED));
}

#[test]
fn without_60c2h_the_period_is_that_of_1006h_or_of_sync_itself() {
    use crate::support::SERVO;
    use lexican_runtime::object::DataType::Unsigned32;
    let bare: Vec<_> = SERVO.iter().filter(|row| row.0 != 0x60C2).copied().collect();
    let communication = [bare.clone(), vec![(0x1006, 0, Unsigned32, 2000)]].concat();
    for rows in [bare, communication] {
        let mut rig = Rig::of(&simulator::servo::ServoModel::CIA_402, &rows);
        rig.set(0x6060, 0, POSITION).enable();
        positions(&mut rig, [0, 4, 8]);
        assert_eq!((rig.position(), rig.velocity()), (8, 2000));
    }
}

/// Offsets (60B0h, 60B1h, 60B2h) are added to the targets of the cyclic modes; the position offset is not added to
/// 60C1h.
#[test]
fn offsets_are_added_to_the_targets_of_their_modes() {
    use crate::support::SERVO;
    use lexican_runtime::object::DataType::{Integer16, Integer32};
    let rows = [SERVO, &[(0x60B1, 0, Integer32, 300), (0x60B2, 0, Integer16, -20)]].concat();
    for (mode, index, sub, target, shown, value) in [
        (POSITION, 0x607A, 0, 4, 0x6064, 14),
        (INTERPOLATED, 0x60C1, 1, 4, 0x6064, 4),
        (VELOCITY, 0x60FF, 0, 500, 0x606C, 800),
        (TORQUE, 0x6071, 0, 100, 0x6077, 80),
    ] {
        let mut rig = Rig::of(&simulator::servo::ServoModel::CIA_402, &rows);
        rig.set(0x60B0, 0, 10).set(0x6060, 0, mode).enable().control(0x1F);
        cycle(&mut rig, index, sub, target, true);
        assert_eq!(rig.get(shown, 0), value, "mode {mode}");
    }
}

/// Bits 10 to 13 in each cyclic mode: while it follows, is halted or stopped; and without interpolation.
#[test]
fn status_bits_show_what_a_cyclic_mode_does() {
    for (mode, index, sub, target) in
        [(INTERPOLATED, 0x60C1, 1, 4), (POSITION, 0x607A, 0, 4), (VELOCITY, 0x60FF, 0, 2000), (TORQUE, 0x6071, 0, 200)]
    {
        let interpolates = mode == INTERPOLATED;
        let mut rig = Rig::enabled(mode);
        assert_eq!(rig.mode_bits(), [interpolates, !interpolates, false], "mode {mode} at rest");
        rig.control(0x1F);
        assert_eq!(rig.mode_bits(), [interpolates, true, false], "mode {mode} without SYNC");
        cycle(&mut rig, index, sub, target, true);
        assert_eq!((rig.velocity(), rig.mode_bits()), (2000, [false, true, false]), "mode {mode} moves");
        rig.control(0x11F).pass(10);
        assert_eq!(rig.mode_bits(), [false, interpolates, false], "mode {mode} brakes");
        rig.pass(190);
        assert_eq!(rig.mode_bits(), [true, interpolates, false], "mode {mode} has stopped");
        rig.control(0x00);
        assert_eq!(rig.mode_bits(), [false; 3], "mode {mode} is off");
    }
}

/// 607Fh limits every cyclic mode but that of torque, and 6072h limits torque. Meanwhile, bit 11 is set.
#[test]
fn limits_hold_in_each_cyclic_mode() {
    use crate::support::SERVO;
    use lexican_runtime::object::DataType::Unsigned32;
    let rows = [SERVO, &[(0x607F, 0, Unsigned32, 1000)]].concat();
    for (mode, index, rows) in [
        (VELOCITY, 0x60FF, [(1000, 1000, false), (1500, 1000, true), (1000, 1000, false), (-1001, -1000, true)]),
        (TORQUE, 0x6071, [(100, 1000, false), (101, 1000, true), (100, 1000, false), (-101, -1000, true)]),
    ]
    .map(|(mode, index, table)| (mode, index, (rows.clone(), table)))
    {
        let mut rig = Rig::of(&simulator::servo::ServoModel::CIA_402, &rows.0);
        rig.set(0x6072, 0, 100).set(0x6060, 0, mode).enable();
        for (target, velocity, limited) in rows.1 {
            cycle(&mut rig, index, 0, target, true);
            assert_eq!((rig.velocity(), rig.status(LIMITED)), (velocity, limited), "{target} in mode {mode}");
        }
    }
    let mut rig = Rig::of(&simulator::servo::ServoModel::CIA_402, &rows);
    rig.set(0x6060, 0, POSITION).enable();
    positions(&mut rig, [50]);
    assert_eq!((rig.position(), rig.velocity()), (2, 1000));
}

/// 6065h is 100 units: a cycle may lead that far, with any set-point of its time.
#[test]
fn a_jump_of_the_window_is_none() {
    for (target, state) in [(100, State::OperationEnabled), (-100, State::OperationEnabled), (-101, State::Fault)] {
        let mut rig = Rig::enabled(POSITION);
        positions(&mut rig, [target]);
        assert_eq!(rig.state(), state, "{target}");
    }
}

/// Bits 6 and 7 of 607Eh, and a home position, as in the profile modes.
#[test]
fn polarity_and_zero_hold_in_the_cyclic_modes() {
    let mut rig = Rig::enabled(POSITION);
    rig.set(0x607E, 0, 0x80);
    rig.servo.set_position(rig.now, &mut rig.od, 50.0);
    positions(&mut rig, [54]);
    assert_eq!((rig.position(), rig.servo.shaft(rig.now).position), (54, -4.0));
    let mut rig = Rig::enabled(VELOCITY);
    rig.set(0x607E, 0, 0x40);
    cycle(&mut rig, 0x60FF, 0, 500, true);
    assert_eq!((rig.velocity(), rig.servo.shaft(rig.now).velocity), (500, -500.0));
}

/// The count of missed set-points starts anew after a set-point, a halt or another mode.
#[test]
fn missed_set_points_count_in_a_row_only() {
    let mut rig = Rig::enabled(POSITION);
    for _ in 0..3 {
        let here = rig.position();
        positions(&mut rig, [here + 4]);
        for _ in 0..3 {
            rig.sync().pass(2);
            assert_eq!(rig.state(), State::OperationEnabled);
        }
    }
    let here = rig.position();
    positions(&mut rig, [here, here, here]);
    rig.control(0x10F);
    for _ in 0..10 {
        rig.sync().pass(2);
    }
    rig.control(0x0F).pass(1000);
    assert_eq!(rig.state(), State::OperationEnabled, "a halted axis misses nothing");
    rig.set(0x6060, 0, 1).pass(1000).set(0x6060, 0, POSITION).pass(1000);
    assert_eq!(rig.state(), State::OperationEnabled, "nor does one in another mode");
}

/// Interpolation begins at the present position each time bit 4 rises.
#[test]
fn interpolation_is_taken_up_again() {
    let mut rig = Rig::enabled(INTERPOLATED);
    for start in [0, 40] {
        rig.control(0x1F);
        for target in [4, 8, 12] {
            cycle(&mut rig, 0x60C1, 1, start + target, true);
            assert_eq!((rig.position(), rig.status(FOLLOWS)), (start + target, true));
        }
        rig.control(0x0F).pass(199);
        assert_ne!(rig.velocity(), 0, "it brakes with 6084h");
        rig.pass(1);
        assert_eq!((rig.velocity(), rig.status(FOLLOWS)), (0, false));
        // 6084h at rest, and no SYNC: nothing happens.
        rig.pass(1000);
        assert_eq!(rig.state(), State::OperationEnabled);
        let stands = rig.position();
        rig.servo.set_position(rig.now, &mut rig.od, 40.0);
        assert!(stands > start);
    }
}
