//! Homing mode: every method ends where the figures of CiA 402-2, 11, show it.

use lexican_runtime::Instant;
use lexican_runtime::object::DataType;
use lexican_runtime::profile::cia402::State;
use simulator::servo::{Machine, ServoModel};

use crate::support::{Rig, SERVO};

/// Limit switches at -2000 and 2000, a home switch from 300 to 700, index pulses at -2000 + 150, + 350, and so on.
const MACHINE: Machine = Machine {
    negative_limit: Some(-2000.0),
    positive_limit: Some(2000.0),
    home_switch: Some((300.0, 700.0)),
    index: Some((150.0, 200.0)),
};

const START: u16 = 0x1F;
const DONE: [bool; 3] = [true, true, false];
const FAILED: [bool; 3] = [true, false, true];

/// A servo in homing mode with its shaft at a position.
fn at(position: f64, machine: Machine) -> Rig {
    let mut rig = Rig::new();
    assert!(rig.servo.turn(rig.now, &mut rig.od, position));
    rig.inputs(|inputs| inputs.machine = machine).set(0x6060, 0, 6).enable();
    rig
}

#[test]
fn every_method_ends_where_its_figure_has_it() {
    for (method, home) in [
        // With the index pulse next to a limit switch, on the side of the travel.
        (1, -1850.0),
        (2, 1950.0),
        // Left and right of the edge at which a switch begins that is active towards the positive end.
        (3, 150.0),
        (4, 350.0),
        // The same for a switch that is active towards the negative end.
        (5, 750.0),
        (6, 550.0),
        // Left and right of the negative edge of a switch, then of its positive edge.
        (7, 150.0),
        (8, 350.0),
        (9, 550.0),
        (10, 750.0),
        // The same, looking for the switch in the negative direction.
        (11, 750.0),
        (12, 550.0),
        (13, 350.0),
        (14, 150.0),
        // Without the index pulse, at the edge itself.
        (17, -2000.0),
        (18, 2000.0),
        (19, 300.0),
        (20, 300.0),
        (21, 700.0),
        (22, 700.0),
        (23, 300.0),
        (24, 300.0),
        (25, 700.0),
        (26, 700.0),
        (27, 700.0),
        (28, 700.0),
        (29, 300.0),
        (30, 300.0),
    ] {
        let switch = match method {
            3 | 4 | 19 | 20 => (300.0, f64::INFINITY),
            5 | 6 | 21 | 22 => (f64::NEG_INFINITY, 700.0),
            _ => (300.0, 700.0),
        };
        // From each side of each switch, and from within it.
        for start in [-2050.0, -1000.0, 310.0, 500.0, 690.0, 1500.0, 2050.0] {
            let mut rig = at(start, Machine { home_switch: Some(switch), ..MACHINE });
            rig.set(0x6098, 0, method).set(0x607C, 0, 70).control(START);
            assert_eq!(rig.mode_bits(), [false; 3], "method {method} from {start}");
            rig.pass(60_000);
            assert_eq!(rig.servo.shaft(rig.now).position, home, "method {method} from {start}");
            assert_eq!((rig.position(), rig.mode_bits()), (70, DONE), "method {method} from {start}");
        }
    }
}

/// A travel over a distance with 10 000 units/s², from rest to rest.
fn travel_s(distance: f64, speed: f64) -> f64 {
    let ramps = speed * speed / 10_000.0;
    if distance < ramps { 2.0 * (distance / 10_000.0).sqrt() } else { (distance + ramps) / speed }
}

/// After a switch that it passes with 1000 units/s, the axis turns back 51 units behind it: 50 for the ramp, and 1. It
/// crosses the edge with 100 units/s, after 0.5 units for the ramp, and 1.
#[test]
fn every_method_searches_as_its_figure_has_it() {
    let (begins, ends, switch) = ((300.0, f64::INFINITY), (f64::NEG_INFINITY, 700.0), (300.0, 700.0));
    for (method, home_switch, start, turns) in [
        (1, switch, 0.0, &[-2051.0][..]),
        (1, switch, -2000.0, &[]),
        (2, switch, 0.0, &[2051.0]),
        (2, switch, 2000.0, &[]),
        (3, begins, 0.0, &[351.0]),
        (3, begins, 300.0, &[301.5]),
        (3, begins, 500.0, &[]),
        (4, begins, 0.0, &[351.0, 298.5]),
        (4, begins, 500.0, &[298.5]),
        (5, ends, 1000.0, &[649.0]),
        (5, ends, 700.0, &[698.5]),
        (5, ends, 500.0, &[]),
        (6, ends, 1000.0, &[649.0, 701.5]),
        (6, ends, 500.0, &[701.5]),
        (7, switch, 0.0, &[351.0]),
        (7, switch, 500.0, &[]),
        (7, switch, 1000.0, &[2051.0, 649.0]),
        (8, switch, 0.0, &[351.0, 298.5]),
        (8, switch, 500.0, &[298.5]),
        (8, switch, 1000.0, &[2051.0, 649.0, 298.5]),
        (9, switch, 0.0, &[351.0, 701.5]),
        (9, switch, 500.0, &[701.5]),
        (9, switch, 1000.0, &[2051.0, 649.0, 701.5]),
        (10, switch, 0.0, &[351.0]),
        (10, switch, 500.0, &[]),
        (10, switch, 1000.0, &[2051.0, 649.0]),
        (11, switch, 0.0, &[-2051.0, 351.0]),
        (11, switch, 500.0, &[]),
        (11, switch, 1000.0, &[649.0]),
        (12, switch, 0.0, &[-2051.0, 351.0, 701.5]),
        (12, switch, 500.0, &[701.5]),
        (12, switch, 1000.0, &[649.0, 701.5]),
        (13, switch, 0.0, &[-2051.0, 351.0, 298.5]),
        (13, switch, 500.0, &[298.5]),
        (13, switch, 1000.0, &[649.0, 298.5]),
        (14, switch, 0.0, &[-2051.0, 351.0]),
        (14, switch, 500.0, &[]),
        (14, switch, 1000.0, &[649.0]),
    ] {
        // Without the index pulse, the search is the same.
        for method in [method, method + 16] {
            let mut rig = at(start, Machine { home_switch: Some(home_switch), ..MACHINE });
            rig.set(0x6098, 0, method).control(START);
            let (mut before, mut time_s) = (start, 0.0);
            for turn in turns {
                time_s += travel_s((turn - before).abs(), 1000.0);
                let found = rig.servo.shaft(Instant::from_micros((time_s * 1e6) as u64));
                let turned = (found.position - turn).abs() < 0.01 && found.velocity.abs() < 0.1;
                assert!(turned, "method {method} from {start}: {found:?} instead of {turn}");
                before = *turn;
            }
            let end_s = |home: f64| time_s + travel_s((home - before).abs(), 100.0);
            rig.pass(60_000);
            let end_us = (end_s(rig.servo.shaft(rig.now).position) * 1e6) as u64;
            let mut rig = at(start, Machine { home_switch: Some(home_switch), ..MACHINE });
            rig.set(0x6098, 0, method).control(START);
            for (us, attained) in [(end_us.saturating_sub(10), end_us == 0), (end_us + 10, true)] {
                rig.now = Instant::from_micros(us);
                assert_eq!(rig.pass(0).servo.is_homed(), attained, "method {method} from {start} at {us} us");
            }
        }
    }
}

#[test]
fn index_pulses_are_found_in_either_direction_and_the_spot_without() {
    for (method, home) in [(33, 150.0), (34, 350.0), (35, 200.0), (37, 200.0)] {
        let mut rig = at(200.0, MACHINE);
        rig.set(0x6098, 0, method).set(0x607C, 0, -5).control(START).pass(10_000);
        assert_eq!((rig.servo.shaft(rig.now).position, rig.position()), (home, -5), "method {method}");
        assert_eq!(rig.mode_bits(), DONE);
    }
}

#[test]
fn the_spot_is_found_at_once() {
    for method in [35, 37] {
        let mut rig = at(200.0, MACHINE);
        rig.set(0x6098, 0, method).control(START);
        assert_eq!(rig.mode_bits(), DONE, "method {method}");
    }
}

#[test]
fn a_method_that_there_is_not_fails_and_moves_nothing() {
    for method in [0, 15, 16, 31, 32, 36, 38, -1] {
        let mut rig = at(0.0, MACHINE);
        rig.set(0x6098, 0, method).control(START).pass(1000);
        assert_eq!((rig.position(), rig.mode_bits()), (0, FAILED), "method {method}");
    }
}

#[test]
fn a_method_without_its_switch_fails() {
    let bare = Machine { negative_limit: None, positive_limit: None, home_switch: None, index: None };
    for method in (1..=14).chain(17..=30).chain(33..=34) {
        let mut rig = at(0.0, bare);
        rig.set(0x6098, 0, method).control(START).pass(1000);
        assert_eq!((rig.position(), rig.mode_bits()), (0, FAILED), "method {method}");
    }
}

#[test]
fn only_the_methods_of_the_model_and_of_60e3h_are_there() {
    static FEW: ServoModel = ServoModel { homing_methods: Some(&[35]), ..ServoModel::CIA_402 };
    let listed = [SERVO, &[(0x60E3, 0, DataType::Unsigned8, 1), (0x60E3, 1, DataType::Integer8, 35)]].concat();
    for (model, rows) in [(&FEW, SERVO), (&ServoModel::CIA_402, &listed)] {
        for (method, bits) in [(35, DONE), (37, FAILED), (33, FAILED)] {
            let mut rig = Rig::of(model, rows);
            rig.set(0x6060, 0, 6).enable().set(0x6098, 0, method).control(START).pass(1000);
            assert_eq!(rig.mode_bits(), bits, "method {method}");
        }
    }
}

#[test]
fn the_search_is_fast_and_the_edge_is_crossed_slowly() {
    let mut rig = at(-1000.0, MACHINE);
    rig.set(0x6098, 0, 23).control(START).pass(500);
    assert_eq!(rig.velocity(), 1000);
    // 350 units past the edge and back: it turns before it leaves the switch.
    rig.pass(1000);
    assert_eq!((rig.velocity(), rig.get(0x60FD, 0)), (-100, 0b100));
}

#[test]
fn homing_is_interrupted_by_bit_4_and_by_halt() {
    let mut rig = at(0.0, MACHINE);
    rig.set(0x6098, 0, 1).control(START).pass(500).control(0x0F).pass(200);
    assert_eq!((rig.velocity(), rig.mode_bits()), (0, [true, false, false]));
    rig.pass(60_000);
    assert!(!rig.servo.is_homed());
    let mut rig = at(0.0, MACHINE);
    rig.set(0x6098, 0, 1).control(START).pass(500).control(START | 0x100).pass(200);
    assert_eq!(rig.velocity(), 0);
    rig.pass(60_000);
    assert!(!rig.servo.is_homed());
    rig.control(START).pass(60_000);
    assert!(rig.servo.is_homed() && rig.mode_bits() == DONE);
}

#[test]
fn a_fault_ends_homing_and_power_off_forgets_it() {
    let mut rig = at(0.0, MACHINE);
    rig.set(0x6098, 0, 35).control(START).pass(1);
    assert!(rig.servo.is_homed());
    rig.control(0x0F).set(0x6098, 0, 1).control(START).pass(500);
    rig.inputs(|inputs| inputs.faults = 0x5530.into()).pass(60_000);
    assert_eq!((rig.state(), rig.servo.is_homed()), (State::Fault, false));
    rig.servo.restart(rig.now);
    assert!(!rig.servo.is_homed());
}

#[test]
fn homing_with_a_speed_of_0_fails_and_moves_nothing_but_the_spot_needs_none() {
    for (speeds, method, bits) in
        [([0, 100], 17, FAILED), ([1000, 0], 17, FAILED), ([0, 0], 35, DONE), ([0, 0], 37, DONE)]
    {
        let mut rig = at(0.0, MACHINE);
        rig.set(0x6099, 1, speeds[0]).set(0x6099, 2, speeds[1]).set(0x6098, 0, method).control(START).pass(1000);
        assert_eq!((rig.servo.shaft(rig.now).position, rig.mode_bits()), (0.0, bits), "method {method}, {speeds:?}");
    }
}

#[test]
fn an_order_to_home_during_halt_waits_for_its_end() {
    let mut rig = at(0.0, MACHINE);
    rig.set(0x6098, 0, 1).control(0x10F).control(START | 0x100).pass(1000);
    assert_eq!((rig.position(), rig.mode_bits()), (0, [false; 3]));
    rig.control(START).pass(60_000);
    assert_eq!((rig.servo.shaft(rig.now).position, rig.mode_bits()), (-1850.0, DONE));
}

/// Homing needs OPERATION ENABLED: if that state is left, no homing continues in another state, and a shaft that is
/// held is not at home.
#[test]
fn homing_ends_with_what_interrupts_it() {
    for (word, state) in [(0x06, State::ReadyToSwitchOn), (0x07, State::SwitchedOn), (0x02, State::SwitchOnDisabled)] {
        let mut rig = at(0.0, MACHINE);
        rig.set(0x6098, 0, 1).control(START).pass(500).control(word | 0x10).pass(60_000);
        assert_eq!((rig.state(), rig.servo.is_homed()), (state, false));
        rig.enable().pass(60_000);
        assert_eq!((rig.servo.is_homed(), rig.mode_bits()), (false, [true, false, false]));
    }
    let mut rig = at(0.0, MACHINE);
    rig.set(0x6065, 0, 0).set(0x6098, 0, 1).control(START).pass(500).inputs(|inputs| inputs.blocked = true).pass(499);
    assert_eq!((rig.servo.is_homed(), rig.state()), (false, State::OperationEnabled));
    rig.inputs(|inputs| inputs.blocked = false).pass(60_000);
    assert_eq!((rig.servo.shaft(rig.now).position, rig.mode_bits()), (-1850.0, DONE));
}

/// 609Ah, even for a stop with option 1 of 605Ah.
#[test]
fn a_stop_has_the_acceleration_of_homing() {
    for (object, word) in [(0x605A, 0x02), (0x605D, 0x11F), (0x605C, 0x17), (0x6098, 0x0F)] {
        let mut rig = at(0.0, MACHINE);
        rig.set(0x6084, 0, 50_000).set(0x6098, 0, 1).control(START).pass(500);
        rig.set(object, 0, 1).control(word).pass(99);
        assert_ne!(rig.velocity(), 0, "{object:04X}h");
        assert_eq!(rig.pass(1).velocity(), 0, "{object:04X}h");
    }
}

#[test]
fn software_limits_move_with_the_home_position() {
    let mut rig = at(200.0, MACHINE);
    rig.set(0x607D, 1, -100).set(0x607D, 2, 100).set(0x6098, 0, 35).control(START).pass(1).control(0x0F);
    rig.set(0x6060, 0, 1).travel(500, 0).pass(5000);
    assert_eq!((rig.position(), rig.servo.shaft(rig.now).position), (100, 300.0));
}

#[test]
fn probes_store_positions_at_edges_and_at_index_pulses() {
    let mut rig = at(0.0, MACHINE);
    // Probe 1 at both edges, once; probe 2 at the index pulse, repeatedly.
    rig.set(0x6060, 0, 3).set(0x60B8, 0, 0x1731).set(0x60FF, 0, 1000).pass(150);
    assert_eq!(rig.get(0x60B9, 0), 0x0101);
    for (level, status) in [(true, 0x03), (false, 0x07)] {
        rig.inputs(|inputs| inputs.probes[0] = level);
        assert_eq!(rig.get(0x60B9, 0) & 0xFF, status);
        rig.pass(100);
    }
    assert_eq!((rig.get(0x60BA, 0), rig.get(0x60BB, 0)), (100, 200));
    assert_eq!((rig.get(0x60BC, 0), rig.get(0x60B9, 0)), (150, 0x0307));
    rig.inputs(|inputs| inputs.probes[0] = true).pass(100);
    assert_eq!((rig.get(0x60BA, 0), rig.get(0x60BC, 0)), (100, 350));
}
