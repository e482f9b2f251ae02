//! Homing mode: every method ends where the figures of CiA 402-2, 11, have it.

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

/// A servo in homing mode whose shaft stands somewhere.
fn at(position: f64, machine: Machine) -> Rig {
    let mut rig = Rig::new();
    assert!(rig.servo.turn(rig.now, &mut rig.od, position));
    rig.inputs(|inputs| inputs.machine = machine).set(0x6060, 0, 6).enable();
    rig
}

#[test]
fn every_method_ends_where_its_figure_has_it() {
    for (method, home) in [
        // With the index pulse beside a limit switch, on the side of the travel.
        (1, -1850.0),
        (2, 1950.0),
        // Left and right of the edge where a switch begins that is active at the positive end.
        (3, 150.0),
        (4, 350.0),
        // The same of one that is active at the negative end.
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
        // From each side of each switch, and from on it.
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
    rig.inputs(|inputs| inputs.fault = Some(0x5530)).pass(60_000);
    assert_eq!((rig.state(), rig.servo.is_homed()), (State::Fault, false));
    rig.servo.restart(rig.now);
    assert!(!rig.servo.is_homed());
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
    // Probe 1 at both edges, once; probe 2 at the index pulse, again and again.
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
