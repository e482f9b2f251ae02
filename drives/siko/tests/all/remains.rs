//! What an order, a stop, a fault or a reset leaves behind, and what it does not.

use super::controller_rig::Rig;
use lexican_runtime::{Duration, Instant};
use siko_ag03_1::fault::{self, register};
use siko_ag03_1::sim::MODEL;
use siko_ag03_1::sim::controller::{Controller, Emergency, Network};
use siko_ag03_1::sim::inputs::{BusState, Inputs, Key, Shaft};
use siko_ag03_1::sim::motion::{FULL_ACCELERATION, Motion};
use siko_ag03_1::sim::parameters::{Mode, Parameters};
use siko_ag03_1::state::State;
use siko_ag03_1::words::{control, generic, status, system};

fn in_velocity_mode() -> Rig {
    let mut rig = Rig::enabled(Parameters { mode: Mode::Velocity, target_velocity: 30, ..Parameters::default() });
    rig.control(0x000F);
    rig.pass_ms(1000);
    rig
}

fn enable(rig: &mut Rig) {
    [0x0106, 0x0107, 0x010F].into_iter().for_each(|word| rig.control(word));
    assert_eq!(rig.controller.state(), State::OperationEnabled);
}

/// A drive that has travelled to 5000, and then was given another target without an order.
fn arrived() -> Rig {
    let mut rig = Rig::enabled(Parameters::default());
    rig.travel_to(5000);
    rig.pass_ms(60_000);
    rig.control(0x000F);
    rig.set(|parameters| parameters.target_position = 0);
    rig
}

fn is_in_position(rig: &Rig) -> bool {
    rig.controller.system_status(rig.now) & system::IN_POSITION != 0
}

fn torque_is_deactivated(rig: &Rig) -> bool {
    rig.controller.generic_status() & generic::TORQUE_DEACTIVATED != 0
}

#[test]
fn a_new_controller_has_the_faults_and_the_load_that_are_there() {
    let now = Instant::ZERO;
    let inputs = Inputs { internal_error: true, ..Inputs::default() };
    assert_eq!(Controller::new(&MODEL, now, Parameters::default(), inputs, 0).faults(), [fault::INTERNAL]);
    let inputs = Inputs { attainable_rpm: Some(20), ..Inputs::default() };
    let mut rig = Rig::new(Parameters::default());
    (rig.controller, rig.inputs) = (Controller::new(&MODEL, now, Parameters::default(), inputs, 0), inputs);
    rig.controller.set_network(now, Network::Operational);
    enable(&mut rig);
    rig.control(0x000F);
    rig.travel_to(5000);
    rig.pass_ms(1000);
    assert_eq!(rig.controller.velocity(rig.now), 20);
}

#[test]
fn leaving_operational_forgets_the_control_word() {
    let mut rig = Rig::enabled(Parameters::default());
    rig.world(|inputs| inputs.internal_error = true);
    rig.control(control::FAULT_RESET);
    rig.world(|inputs| inputs.internal_error = false);
    assert_eq!(rig.controller.state(), State::Fault, "the cause was still there");
    rig.controller.set_network(rig.now, Network::PreOperational);
    rig.controller.set_network(rig.now, Network::Operational);
    rig.control(control::FAULT_RESET);
    assert_eq!(rig.controller.state(), State::SwitchOnDisabled);
}

#[test]
fn a_velocity_that_was_stopped_stands_whatever_target_comes() {
    let mut rig = in_velocity_mode();
    rig.control(0x010F);
    rig.pass_ms(1000);
    rig.set(|parameters| parameters.target_velocity = 60);
    rig.pass_ms(1000);
    assert_eq!(rig.controller.velocity(rig.now), 0);
}

#[test]
fn a_velocity_that_a_fault_has_ended_stands_whatever_target_comes() {
    let mut rig = in_velocity_mode();
    rig.world(|inputs| inputs.internal_error = true);
    rig.pass_ms(1000);
    rig.set(|parameters| parameters.target_velocity = 60);
    rig.pass_ms(1000);
    assert_eq!(rig.controller.velocity(rig.now), 0);
}

/// 2410h:06 is of no meaning for the ramp that is under way, when other parameters change too.
#[test]
fn an_acceleration_holds_from_the_next_order_on() {
    let mut rig = Rig::enabled(Parameters { mode: Mode::Velocity, target_velocity: 60, ..Parameters::default() });
    rig.control(0x000F);
    rig.set(|parameters| parameters.a_rot = 100);
    rig.world(|inputs| inputs.load_ma = 700);
    // 50 %: 2 rev/s2.
    rig.pass_ms(250);
    assert_eq!(rig.controller.velocity(rig.now), 30);
    rig.set(|parameters| parameters.target_velocity = 90);
    rig.pass_ms(125);
    assert_eq!(rig.controller.velocity(rig.now), 60);
}

#[test]
fn a_new_travel_ends_the_torque_deactivation_of_the_one_before() {
    let mut rig = Rig::enabled(Parameters { torque_deactivation: 29, ..Parameters::default() });
    rig.travel_to(5000);
    assert!(torque_is_deactivated(&rig), "600 mA are 30 %");
    rig.control(0x0000);
    rig.pass_ms(1000);
    rig.world(|inputs| inputs.load_ma = 100);
    enable(&mut rig);
    assert!(torque_is_deactivated(&rig));
    rig.control(0x000F);
    rig.travel_to(6000);
    assert!(!torque_is_deactivated(&rig));
}

/// 2 A are 100 %.
#[test]
fn torque_is_deactivated_above_its_threshold_and_at_once() {
    for (load_ma, deactivated) in [(2000, false), (2019, false), (2020, true)] {
        let mut rig = Rig::enabled(Parameters { torque_deactivation: 100, ..Parameters::default() });
        rig.world(|inputs| inputs.load_ma = load_ma);
        rig.travel_to(5000);
        assert_eq!(torque_is_deactivated(&rig), deactivated, "{load_ma} mA");
    }
    let mut rig = Rig::enabled(Parameters::default());
    rig.travel_to(5000);
    rig.set(|parameters| parameters.torque_deactivation = 20);
    assert!(torque_is_deactivated(&rig));
}

#[test]
fn a_travel_that_stop_has_interrupted_is_not_deactivated_as_well() {
    let mut rig = Rig::enabled(Parameters { torque_deactivation: 50, ..Parameters::default() });
    rig.travel_to(5000);
    rig.pass_ms(1000);
    rig.control(0x011F);
    rig.world(|inputs| inputs.load_ma = 2000);
    rig.pass_ms(50);
    assert!(!torque_is_deactivated(&rig));
}

#[test]
fn a_travel_that_was_released_is_not_resumed() {
    for blocked in [false, true] {
        let mut rig = Rig::enabled(Parameters::default());
        rig.travel_to(5000);
        rig.pass_ms(1000);
        if blocked {
            rig.world(|inputs| inputs.shaft = Shaft::Blocked);
        } else {
            rig.control(0x011F);
            rig.pass_ms(1000);
        }
        rig.control(0x0000);
        assert!(!rig.controller.is_travelling(rig.now), "blocked: {blocked}");
        rig.world(|inputs| inputs.shaft = Shaft::Free);
        enable(&mut rig);
        let there = rig.controller.position(rig.now);
        rig.control(0x000F);
        rig.pass_ms(1000);
        assert_eq!(rig.controller.position(rig.now), there, "blocked: {blocked}");
    }
}

#[test]
fn a_travel_that_has_arrived_stays_known() {
    let disabled = |rig: &mut Rig| rig.control(0x0000);
    let in_fault = |rig: &mut Rig| rig.world(|inputs| inputs.internal_error = true);
    let in_the_other_mode = |rig: &mut Rig| {
        rig.set(|parameters| parameters.mode = Mode::Velocity);
        rig.control(0x010F);
        rig.set(|parameters| parameters.mode = Mode::Positioning);
    };
    for happen in [disabled, in_fault, in_the_other_mode] {
        let mut rig = arrived();
        happen(&mut rig);
        rig.pass_ms(1000);
        assert!(is_in_position(&rig) && rig.has(status::TARGET_REACHED));
    }
}

/// An order or a key that leads beyond a limit, where it starts nothing, replaces no travel.
#[test]
fn what_starts_nothing_replaces_nothing() {
    for (limits, key) in [([0, 5000], Key::CounterClockwise), ([5000, 9000], Key::Clockwise)] {
        for by_key in [false, true] {
            let mut rig = Rig::enabled(Parameters::default());
            rig.travel_to(5000);
            rig.pass_ms(60_000);
            rig.set(|parameters| {
                (parameters.limits, parameters.target_position) = (limits, 0);
                parameters.delta_inch = if key == Key::Clockwise { -100 } else { 100 };
            });
            if by_key {
                rig.controller.set_network(rig.now, Network::PreOperational);
                rig.world(|inputs| inputs.key = Some(key));
            } else {
                rig.control(0x000F);
                rig.control(0x000F | control::INCHING_1);
            }
            rig.pass_ms(1000);
            assert_eq!(rig.controller.position(rig.now), 5000);
            assert!(is_in_position(&rig), "{key:?}, by key: {by_key}");
        }
    }
}

#[test]
fn a_target_is_reached_at_the_end_of_the_travel_and_not_in_its_window() {
    let mut rig = Rig::enabled(Parameters::default());
    rig.travel_to(5);
    assert!(is_in_position(&rig) && !rig.has(status::TARGET_REACHED));
    rig.pass_ms(1000);
    assert!(rig.has(status::TARGET_REACHED));
}

/// A turn that was made is not made again when the load or the shaft lets the drive go on.
#[test]
fn a_loop_turns_once() {
    for held in [false, true] {
        let mut rig = Rig::enabled(Parameters { positioning_type: 1, ..Parameters::default() });
        rig.travel_to(-1000);
        // 1800 increments take 2.5 s.
        rig.pass_ms(3000);
        let there = rig.controller.position(rig.now);
        if held {
            rig.world(|inputs| inputs.shaft = Shaft::Blocked);
            rig.pass_ms(100);
            rig.world(|inputs| inputs.shaft = Shaft::Free);
        } else {
            rig.world(|inputs| inputs.attainable_rpm = Some(20));
        }
        rig.pass_ms(300);
        assert!(rig.controller.position(rig.now) > there && rig.controller.velocity(rig.now) > 0, "{held}");
        rig.pass_ms(60_000);
        assert_eq!(rig.controller.position(rig.now), -1000);
    }
}

#[test]
fn a_shaft_that_is_held_at_rest_or_without_a_job_is_not_blocked() {
    let mut rig = Rig::enabled(Parameters::default());
    rig.world(|inputs| inputs.shaft = Shaft::Blocked);
    rig.pass_ms(5000);
    assert_eq!(rig.controller.faults(), []);
    rig.world(|inputs| inputs.shaft = Shaft::Free);
    rig.travel_to(5000);
    rig.pass_ms(1000);
    rig.control(0x0002);
    rig.pass_ms(50);
    rig.world(|inputs| inputs.shaft = Shaft::Blocked);
    rig.pass_ms(5000);
    assert_eq!(rig.controller.faults(), []);
}

#[test]
fn a_shaft_that_is_held_after_its_travel_is_not_blocked() {
    let mut rig = arrived();
    rig.world(|inputs| inputs.shaft = Shaft::Blocked);
    rig.pass_ms(5000);
    assert_eq!(rig.controller.faults(), []);
}

#[test]
fn a_step_is_not_deactivated() {
    let mut rig = Rig::enabled(Parameters { torque_deactivation: 20, ..Parameters::default() });
    rig.control(0x000F);
    rig.control(0x000F | control::INCHING_1);
    rig.pass_ms(100);
    assert!(rig.controller.is_travelling(rig.now) && !torque_is_deactivated(&rig));
}

/// Parameter 26 has released the motor: another load does not bring the shaft back.
#[test]
fn another_load_moves_nothing_that_has_arrived() {
    let mut rig = Rig::enabled(Parameters { in_position_mode: 2, ..Parameters::default() });
    rig.travel_to(1000);
    rig.pass_ms(60_000);
    assert!(rig.controller.turn_shaft(rig.now, 100));
    rig.world(|inputs| inputs.attainable_rpm = Some(20));
    rig.pass_ms(5000);
    assert_eq!(rig.controller.position(rig.now), 1100);
}

/// What stops or resumes a travel does nothing where there is nothing to stop or to resume.
#[test]
fn only_a_travel_under_way_is_interrupted_and_only_once() {
    let ms = |ms| Instant::ZERO + Duration::from_millis(ms);
    let parameters = Parameters { positioning_type: 1, loop_length: 4000, numerator: 5, ..Parameters::default() };
    let mut motion = Motion::at_rest(ms(0), 0.0);
    motion.move_to(ms(0), -1000.0, parameters.positioning(), parameters.by_loop());
    assert_eq!(motion.next_change(ms(1), |_| ()).map(|at| motion.state(at).position), Some(-21_000.0));
    let end = motion.rest_at().unwrap();
    // The turn is behind it.
    let before_the_end = Instant::ZERO + Duration::from_micros(end.as_micros() - 1_000_000);
    motion.resume(before_the_end);
    assert_eq!(motion.rest_at(), Some(end));
    motion.interrupt(before_the_end);
    let stands = motion.rest_at();
    motion.interrupt_braking(before_the_end + Duration::from_millis(1), FULL_ACCELERATION);
    assert_eq!(motion.rest_at(), stands);
    motion.resume(end);
    let end = motion.rest_at().unwrap();
    motion.interrupt(end);
    assert!(!motion.is_interrupted() && motion.state(end).position == -1000.0);
}

#[test]
fn what_is_due_is_said_at_once_and_to_the_millisecond() {
    let mut rig = Rig::enabled(Parameters::default());
    rig.travel_to(9000);
    rig.world(|inputs| inputs.load_ma = 2401);
    let begun = rig.now;
    assert_eq!(rig.controller.next_event(), Some(begun + Duration::from_secs(4)));
    rig.pass_ms(4000);
    assert_eq!(rig.controller.faults(), [fault::OVERCURRENT]);
    let mut rig = Rig::enabled(Parameters::default());
    rig.travel_to(9000);
    rig.pass_ms(1000);
    rig.world(|inputs| inputs.shaft = Shaft::Blocked);
    assert_eq!(rig.controller.next_event(), Some(rig.now + Duration::from_millis(500)));
    rig.controller.set_network(rig.now, Network::PreOperational);
    assert_eq!(rig.controller.next_event(), None);
}

/// While it still brakes, too: what has caused the fault begins anew.
#[test]
fn a_fault_is_reset_when_its_cause_is_gone() {
    for load_ma in [600, 3000] {
        let mut rig = Rig::enabled(Parameters::default());
        rig.world(|inputs| inputs.load_ma = load_ma);
        rig.travel_to(9000);
        if load_ma == 600 {
            rig.pass_ms(1000);
            rig.world(|inputs| inputs.shaft = Shaft::Blocked);
        }
        while rig.controller.state() != State::Fault {
            rig.now = rig.controller.next_event().unwrap();
            rig.controller.advance(rig.now);
        }
        rig.control(control::FAULT_RESET);
        assert_eq!(rig.controller.state(), State::SwitchOnDisabled, "{load_ma} mA");
    }
}

/// 800 increments/s with 6400/s2 against it: 50 increments.
#[test]
fn a_fault_brakes_what_runs_out() {
    let mut rig = Rig::enabled(Parameters::default());
    rig.travel_to(5000);
    rig.pass_ms(1000);
    rig.control(0x0000);
    let there = rig.controller.position(rig.now);
    rig.world(|inputs| inputs.internal_error = true);
    rig.pass_ms(1000);
    assert_eq!(rig.controller.position(rig.now), there + 50);
}

#[test]
fn emergencies_have_the_bits_of_what_they_report() {
    let mut rig = Rig::enabled(Parameters::default());
    rig.world(|inputs| inputs.bus = BusState::Passive);
    let communication = register::GENERAL | register::COMMUNICATION;
    let passive = Emergency { code: 0x8120, register: communication, stored: false };
    assert_eq!(rig.controller.next_emergency(), Some(passive));
    rig.world(|inputs| inputs.bus = BusState::Active);
    rig.world(|inputs| inputs.internal_error = true);
    assert!(rig.controller.next_emergency().is_some_and(|emergency| emergency.stored));
    rig.world(|inputs| inputs.internal_error = false);
    rig.control(control::FAULT_RESET);
    let none = Emergency { code: 0x0000, register: 0, stored: false };
    assert_eq!((rig.controller.next_emergency(), rig.controller.next_emergency()), (Some(none), None));
}
