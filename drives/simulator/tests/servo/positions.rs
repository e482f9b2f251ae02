//! Profile position mode: set-points, ramps, limits, following error.

use lexican_runtime::object::DataType;
use lexican_runtime::profile::cia402::State;

use crate::support::{Rig, Row, SERVO};
use simulator::servo::ServoModel;

const POSITION: i64 = 1;
const IMMEDIATELY: u16 = 1 << 5;
const RELATIVE: u16 = 1 << 6;
const ON_SET_POINT: u16 = 1 << 9;
const HALT: u16 = 1 << 8;
const REACHED: u16 = 1 << 10;
const LIMITED: u16 = 1 << 11;
const ACKNOWLEDGED: u16 = 1 << 12;
const FOLLOWING_ERROR: u16 = 1 << 13;

#[test]
fn a_travel_has_its_ramps() {
    let mut rig = Rig::enabled(POSITION);
    assert!(rig.status(REACHED), "nothing is ordered");
    rig.set(0x607A, 0, 1000).control(0x1F);
    assert!(rig.status(ACKNOWLEDGED) && !rig.status(REACHED));
    // 100 ms to 1000 units/s, 50 units each way.
    for (ms, position, velocity) in [(50, 12, 500), (50, 50, 1000), (900, 950, 1000), (50, 987, 500), (50, 1000, 0)] {
        rig.pass(ms);
        assert!((rig.position() - position).abs() <= 1, "{} instead of {position}", rig.position());
        assert_eq!(rig.velocity(), velocity);
    }
    assert!(rig.status(REACHED | ACKNOWLEDGED), "bit 4 is still set");
    rig.control(0x0F);
    assert!(rig.status(REACHED) && !rig.status(ACKNOWLEDGED));
}

#[test]
fn set_points_are_absolute_or_relative() {
    let mut rig = Rig::enabled(POSITION);
    rig.travel(300, 0).pass(2000).travel(-100, RELATIVE).pass(2000);
    assert_eq!(rig.position(), 200);
    rig.travel(-100, 0).pass(2000);
    assert_eq!(rig.position(), -100);
    // Relative to the last target, though the axis has not reached it.
    rig.travel(1000, 0).pass(200).travel(100, RELATIVE | IMMEDIATELY).pass(3000);
    assert_eq!(rig.position(), 1100);
    // 60F2h = 1: relative to the position at that time.
    rig.set(0x60F2, 0, 1).travel(1000, RELATIVE).pass(100).travel(100, RELATIVE | IMMEDIATELY).pass(3000);
    assert_eq!(rig.position(), 1250);
}

#[test]
fn a_set_point_waits_for_the_one_under_way() {
    let mut rig = Rig::enabled(POSITION);
    rig.travel(1000, 0).pass(500).travel(0, 0);
    assert!(rig.status(ACKNOWLEDGED), "the buffer is full");
    rig.travel(5000, 0);
    rig.pass(600);
    assert_eq!((rig.position(), rig.velocity()), (1000, 0));
    assert!(!rig.status(REACHED) && !rig.status(ACKNOWLEDGED), "the next one begins");
    rig.pass(1100);
    assert_eq!(rig.position(), 0, "the third one was not taken");
    assert!(rig.status(REACHED));
}

#[test]
fn a_set_point_is_changed_immediately() {
    let mut rig = Rig::enabled(POSITION);
    rig.travel(1000, 0).pass(500).travel(0, IMMEDIATELY);
    assert!(!rig.status(ACKNOWLEDGED));
    rig.pass(100);
    // The axis brakes first: 50 more units.
    assert_eq!((rig.position(), rig.velocity()), (500, 0));
    rig.pass(1000);
    assert!(rig.status(REACHED) && rig.position() == 0);
}

#[test]
fn a_change_on_set_point_passes_it_without_a_stop() {
    let mut rig = Rig::enabled(POSITION);
    rig.travel(1000, 0).pass(500).travel(2000, ON_SET_POINT).pass(550);
    assert_eq!((rig.position(), rig.velocity()), (1000, 1000));
    rig.pass(10);
    assert!(!rig.status(ACKNOWLEDGED) && !rig.status(REACHED));
    rig.pass(1040);
    assert_eq!((rig.position(), rig.status(REACHED)), (2000, true));
}

#[test]
fn halt_interrupts_and_the_travel_goes_on() {
    let mut rig = Rig::enabled(POSITION);
    rig.travel(1000, 0).pass(500).control(0x0F | HALT);
    assert!(!rig.status(REACHED));
    rig.pass(100);
    assert!(rig.status(REACHED), "with halt, the bit says that it stands");
    assert_eq!(rig.position(), 500);
    rig.pass(1000).control(0x0F);
    assert!(!rig.status(REACHED));
    rig.pass(700);
    assert_eq!((rig.position(), rig.status(REACHED)), (1000, true));
}

#[test]
fn a_set_point_during_halt_waits_for_its_end() {
    let mut rig = Rig::enabled(POSITION);
    rig.control(0x0F | HALT).travel(1000, HALT).pass(1000);
    assert_eq!(rig.position(), 0);
    rig.control(0x0F).pass(2000);
    assert_eq!(rig.position(), 1000);
}

#[test]
fn the_target_counts_as_reached_after_its_time() {
    let mut rig = Rig::enabled(POSITION);
    rig.set(0x6068, 0, 50).travel(1000, 0).pass(1149);
    assert!(!rig.status(REACHED));
    rig.pass(1);
    assert!(rig.status(REACHED));
}

#[test]
fn software_limits_end_a_travel() {
    let mut rig = Rig::enabled(POSITION);
    rig.set(0x607D, 1, -100).set(0x607D, 2, 200);
    for (target, end, limited) in [(500, 200, true), (100, 100, false), (-500, -100, true), (0, 0, false)] {
        rig.travel(target, 0).pass(2000);
        assert_eq!((rig.position(), rig.status(LIMITED)), (end, limited));
    }
}

#[test]
fn polarity_turns_positions_round() {
    let mut rig = Rig::enabled(POSITION);
    rig.set(0x607E, 0, 0x80).travel(1000, 0).pass(3000);
    assert_eq!(rig.position(), 1000);
    assert_eq!(rig.servo.shaft(rig.now).position, -1000.0);
}

#[test]
fn a_range_begins_again_at_its_end() {
    let rows = [
        SERVO,
        &[
            (0x607B, 1, lexican_runtime::object::DataType::Integer32, 0),
            (0x607B, 2, lexican_runtime::object::DataType::Integer32, 359),
        ],
    ]
    .concat();
    let mut rig = Rig::of(&ServoModel::CIA_402, &rows);
    rig.enable();
    rig.travel(300, 0).pass(2000).travel(100, RELATIVE).pass(2000);
    assert_eq!((rig.position(), rig.servo.shaft(rig.now).position), (40, 400.0));
    rig.travel(350, 0).pass(2000);
    assert_eq!((rig.position(), rig.servo.shaft(rig.now).position), (350, 710.0));
}

#[test]
fn a_blocked_shaft_is_a_following_error() {
    let mut rig = Rig::enabled(POSITION);
    rig.travel(1000, 0).pass(500).inputs(|inputs| inputs.blocked = true);
    let held = rig.position();
    rig.pass(99);
    assert_eq!((rig.position(), rig.get(0x60F4, 0), rig.status(FOLLOWING_ERROR)), (held, 99, false));
    // 6065h is 100 units, 6066h 10 ms.
    rig.pass(11);
    assert!(rig.state() == State::OperationEnabled);
    rig.pass(2);
    assert_eq!((rig.state(), rig.position(), rig.emergencies()), (State::Fault, held, vec![0x8611]));
}

#[test]
fn a_blocked_shaft_without_a_following_error_window_is_a_fault_of_its_own() {
    let mut rig = Rig::enabled(POSITION);
    rig.set(0x6065, 0, 0xFFFF_FFFF).travel(1000, 0).inputs(|inputs| inputs.blocked = true).pass(499);
    assert_eq!((rig.state(), rig.position()), (State::OperationEnabled, 0));
    rig.pass(2);
    assert_eq!((rig.state(), rig.emergencies()), (State::Fault, vec![0x7121]));
}

#[test]
fn a_shaft_that_is_free_again_travels_on() {
    let mut rig = Rig::enabled(POSITION);
    rig.travel(1000, 0).pass(500).inputs(|inputs| inputs.blocked = true).pass(50);
    rig.inputs(|inputs| inputs.blocked = false).pass(1);
    assert!(rig.position() <= 451);
    rig.pass(1000);
    assert_eq!((rig.position(), rig.status(REACHED)), (1000, true));
}

#[test]
fn a_limit_switch_stops_a_travel_and_lets_it_leave() {
    let mut rig = Rig::enabled(POSITION);
    rig.inputs(|inputs| inputs.machine.positive_limit = Some(500.0));
    rig.travel(1000, 0).pass(2000);
    // 5 units with 6085h.
    assert_eq!((rig.position(), rig.get(0x60FD, 0)), (505, 0b010));
    assert!(rig.status(LIMITED) && !rig.status(REACHED));
    rig.travel(1000, 0).pass(1000);
    assert_eq!(rig.position(), 505);
    rig.travel(0, 0).pass(2000);
    assert_eq!((rig.position(), rig.get(0x60FD, 0), rig.status(REACHED)), (0, 0, true));
}

#[test]
fn a_profile_velocity_of_0_does_not_move() {
    let mut rig = Rig::enabled(POSITION);
    rig.set(0x6081, 0, 0).travel(1000, 0).pass(5000);
    assert!(rig.position() == 0 && !rig.status(REACHED));
    rig.set(0x6081, 0, 1000).travel(1000, IMMEDIATELY).pass(2000);
    assert!(rig.position() == 1000 && rig.status(REACHED));
}

#[test]
fn what_the_data_sheet_lacks_behaves_as_the_standard_says() {
    const FEW: [u16; 6] = [0x6040, 0x6041, 0x6060, 0x6061, 0x6064, 0x607A];
    let rows: Vec<_> = SERVO.iter().filter(|row| FEW.contains(&row.0)).copied().collect();
    let mut rig = Rig::of(&ServoModel::CIA_402, &rows);
    rig.enable().travel(1000, 0).pass(2000);
    assert_eq!((rig.position(), rig.status(REACHED)), (1000, true));
}

#[test]
fn the_answer_does_not_depend_on_when_it_is_asked() {
    let run = |steps: &[u64]| {
        let mut rig = Rig::enabled(POSITION);
        rig.set(0x6068, 0, 20).travel(1000, 0).travel(2000, ON_SET_POINT);
        for ms in steps {
            rig.pass(*ms);
        }
        (rig.position(), rig.velocity(), rig.get(0x6041, 0))
    };
    for ms in [700, 1100, 1300, 2090, 2110, 2200] {
        let all = run(&[ms]);
        assert_eq!(run(&vec![1; ms as usize]), all);
        assert_eq!(run(&[ms / 3, ms / 3, ms - ms / 3 * 2]), all);
    }
}

/// The status word at each step of waiting set-points: bits 10 and 12, and the position.
#[test]
fn a_set_point_that_waits_goes_on_with_its_own_ramps() {
    let mut rig = Rig::enabled(POSITION);
    rig.travel(1000, 0).pass(500).set(0x6081, 0, 500).set(0x6083, 0, 5000).set(0x6084, 0, 5000).travel(0, 0);
    // It has the ramps of the time when it was ordered.
    rig.set(0x6081, 0, 100);
    for (ms, position, velocity, bits) in [
        (600, 1000, 0, [false, false, false]),
        (100, 975, -500, [false, false, false]),
        (1950, 6, -250, [false, false, false]),
        (50, 0, 0, [true, false, false]),
    ] {
        rig.pass(ms);
        assert!((rig.position() - position).abs() <= 1, "{} instead of {position}", rig.position());
        assert_eq!((rig.velocity(), rig.mode_bits()), (velocity, bits));
    }
}

/// Bits 0 and 1 of 60F2h: the base for each, while the shaft is held 100 units behind its demand.
#[test]
fn a_relative_set_point_has_the_base_that_60f2h_names() {
    for (option, end) in [(0, 1010), (1, 510), (2, 410), (3, 410)] {
        let mut rig = Rig::enabled(POSITION);
        rig.set(0x6065, 0, 0).set(0x60F2, 0, option).set(0x6085, 0, 1_000_000).travel(1000, 0);
        if option == 0 {
            rig.set(0x60F2, 0, 0);
        }
        rig.pass(450).inputs(|inputs| inputs.blocked = true).pass(100);
        rig.travel(10, RELATIVE | IMMEDIATELY).inputs(|inputs| inputs.blocked = false).pass(5000);
        assert_eq!(rig.position(), end, "60F2h is {option}");
    }
}

#[test]
fn a_change_on_set_point_needs_a_travel_that_gets_there() {
    // At rest in front of it, with a speed of 0, and in halt.
    for word in [0, HALT] {
        let mut rig = Rig::enabled(POSITION);
        rig.set(0x6081, 0, 0).travel(1000, 0).set(0x6081, 0, 1000).control(0x0F | word);
        rig.travel(2000, ON_SET_POINT | word).pass(1000);
        assert_eq!((rig.position(), rig.velocity(), rig.status(REACHED)), (0, 0, word == HALT));
    }
    let mut rig = Rig::enabled(POSITION);
    rig.travel(1000, 0).pass(500).control(0x0F | HALT).pass(100).travel(2000, ON_SET_POINT | HALT).pass(1000);
    assert_eq!(rig.position(), 500);
    rig.control(0x0F).pass(3000);
    assert_eq!((rig.position(), rig.status(REACHED)), (2000, true));
    // Backwards, from beyond 0.
    let mut rig = Rig::enabled(POSITION);
    rig.travel(500, 0).pass(2000).travel(-500, 0).pass(500).travel(-1500, ON_SET_POINT).pass(550);
    assert_eq!((rig.position(), rig.velocity()), (-500, -1000));
    // A new travel cancels the order to pass a set-point without stopping.
    rig.pass(200).travel(0, IMMEDIATELY).pass(3000);
    assert_eq!((rig.position(), rig.velocity(), rig.status(REACHED)), (0, 0, true));
    rig.travel(1000, 0).pass(500).travel(2000, ON_SET_POINT).travel(600, IMMEDIATELY).pass(100);
    rig.pass(5000);
    assert_eq!((rig.position(), rig.velocity(), rig.status(REACHED)), (2000, 0, true));
}

/// A range from -100 to 99 (607Bh), crossed in both directions, with and without inverted polarity.
#[test]
fn positions_of_a_range_stay_in_it() {
    use lexican_runtime::object::DataType::Integer32;
    let rows = [SERVO, &[(0x607B, 1, Integer32, -100), (0x607B, 2, Integer32, 99)]].concat();
    for polarity in [0, 0x80] {
        let mut rig = Rig::of(&ServoModel::CIA_402, &rows);
        rig.set(0x607E, 0, polarity).enable();
        let sign = if polarity == 0 { 1.0 } else { -1.0 };
        for (target, bits, shown, turned) in [
            (50, 0, 50, 50.0),
            (100, RELATIVE, -50, 150.0),
            (250, 0, 50, 250.0),
            (-150, RELATIVE, -100, 100.0),
            (-101, 0, 99, 299.0),
            (1, RELATIVE, -100, 300.0),
        ] {
            rig.travel(target, bits).pass(3000);
            let shaft = rig.servo.shaft(rig.now).position * sign;
            assert_eq!((rig.position(), shaft), (shown, turned), "{target} with {polarity:#X}");
        }
    }
}

/// 607Dh counts like 6064h: from the home position, and in its direction.
#[test]
fn software_limits_have_the_sign_and_zero_of_positions() {
    for (polarity, sign) in [(0, 1.0), (0x80, -1.0)] {
        let mut rig = Rig::enabled(POSITION);
        rig.set(0x607E, 0, polarity).set(0x607D, 1, -100).set(0x607D, 2, 200);
        rig.servo.set_position(rig.now, &mut rig.od, 50.0);
        assert_eq!(rig.position(), 50);
        for (target, end) in [(500, 200), (-500, -100), (0, 0)] {
            rig.travel(target, 0).pass(2000);
            assert_eq!((rig.position(), rig.status(LIMITED)), (end, end != target));
            assert_eq!(rig.servo.shaft(rig.now).position * sign, (end - 50) as f64);
        }
    }
}

/// 6062h, 6064h, 606Bh, 606Ch, 6077h and 60F4h of a held shaft.
#[test]
fn a_held_shaft_shows_what_is_demanded_and_what_is() {
    let mut rig = Rig::enabled(POSITION);
    rig.set(0x6065, 0, 0).travel(1000, 0).pass(550).inputs(|inputs| inputs.blocked = true).pass(100);
    let shown = [0x6062, 0x6064, 0x60F4, 0x606B, 0x606C, 0x6077].map(|index| rig.get(index, 0));
    assert_eq!(shown, [600, 500, 100, 1000, 0, 1000]);
    rig.control(0x00).pass(1000);
    let shown = [0x6062, 0x6064, 0x60F4, 0x606B, 0x606C, 0x6077].map(|index| rig.get(index, 0));
    assert_eq!(shown, [500, 500, 0, 0, 0, 0], "without torque it is where it stands");
}

/// The window 6065h applies unless it is 0 or FFFF FFFFh, and only while the axis is enabled.
#[test]
fn the_following_error_counts_with_its_window_and_its_time() {
    for (window, time, fault_after) in [(0, 0, None), (0xFFFF_FFFF, 0, None), (1, 0, Some(2)), (100, 50, Some(152))] {
        let mut rig = Rig::enabled(POSITION);
        rig.set(0x6065, 0, window).set(0x6066, 0, time).travel(5000, 0).pass(500);
        rig.inputs(|inputs| inputs.blocked = true);
        match fault_after {
            None => assert_eq!(rig.pass(400).state(), State::OperationEnabled),
            Some(ms) => {
                assert_eq!(rig.pass(ms - 2).state(), State::OperationEnabled, "{window} for {time} ms");
                assert_eq!((rig.pass(2).state(), rig.emergencies()), (State::Fault, vec![0x8611]));
            }
        }
    }
}

/// A switch placed in the way of a travel stops it; when the switch is removed, the axis goes on.
#[test]
fn the_machine_may_change_during_a_travel() {
    let mut rig = Rig::enabled(POSITION);
    rig.travel(1000, 0).pass(300).inputs(|inputs| inputs.machine.positive_limit = Some(500.0)).pass(2000);
    assert_eq!((rig.position(), rig.status(LIMITED)), (505, true));
    let mut rig = Rig::enabled(POSITION);
    rig.inputs(|inputs| inputs.machine.positive_limit = Some(500.0)).travel(1000, 0).pass(300);
    rig.inputs(|inputs| inputs.machine.positive_limit = None).pass(2000);
    assert_eq!((rig.position(), rig.status(LIMITED)), (1000, false));
    // Not during halt, and not when it is switched off.
    for word in [0x10F, 0x00] {
        let mut rig = Rig::enabled(POSITION);
        rig.travel(1000, 0).pass(300).control(word).pass(200);
        let stands = rig.position();
        rig.inputs(|inputs| inputs.machine.positive_limit = Some(5000.0)).pass(2000);
        assert_eq!((rig.position(), rig.velocity()), (stands, 0), "{word:#X}");
    }
}

/// CiA 402-2: internal positions are in increments of the encoder, others in units of the axis.
#[test]
fn internal_positions_are_in_increments_of_the_encoder() {
    let factors = |rows: &[Row]| {
        let internal = [(0x6063, 0, DataType::Integer32, 0), (0x60FC, 0, DataType::Integer32, 0)];
        let mut rig = Rig::of(&ServoModel::CIA_402, &[SERVO, &internal, rows].concat());
        rig.set(0x6060, 0, POSITION).enable().travel(-300, 0).pass(2000);
        [0x6064, 0x6063, 0x60FC].map(|index| rig.get(index, 0))
    };
    let of = |index, numerator, denominator| {
        [(index, 1, DataType::Unsigned32, numerator), (index, 2, DataType::Unsigned32, denominator)]
    };
    assert_eq!(factors(&[]), [-300, -300, -300]);
    // Without a feed constant, units are increments.
    assert_eq!(factors(&of(0x608F, 4096, 1)), [-300, -300, -300]);
    let scaled = [of(0x608F, 8192, 2), of(0x6091, 5, 1), of(0x6092, 200, 2)].concat();
    assert_eq!(factors(&scaled), [-300, -61440, -61440]);
}
