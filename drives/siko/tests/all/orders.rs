//! Which edges of the control word are orders, and which are none, in all that the drive may be doing.

use super::controller_rig::Rig;
use siko_ag03_1::sim::controller::{Motor, Network};
use siko_ag03_1::sim::inputs::{Inputs, Key, Shaft};
use siko_ag03_1::sim::parameters::{Mode, Parameters};
use siko_ag03_1::state::State;
use siko_ag03_1::words::{control, status, system};

fn in_velocity_mode() -> Rig {
    Rig::enabled(Parameters { mode: Mode::Velocity, target_velocity: 30, ..Parameters::default() })
}

#[test]
fn while_fault_reset_stays_set_there_are_no_commands() {
    let mut rig = Rig::new(Parameters::default());
    rig.controller.set_network(rig.now, Network::Operational);
    rig.control(control::FAULT_RESET);
    rig.control(control::FAULT_RESET | 0x0006);
    assert_eq!(rig.controller.state(), State::SwitchOnDisabled);
}

#[test]
fn a_key_has_the_motor_in_control_until_the_shaft_rests() {
    let mut rig = Rig::new(Parameters { limits: [-1000, 0], ..Parameters::default() });
    rig.world(|inputs| inputs.key = Some(Key::CounterClockwise));
    assert_eq!(rig.controller.motor(rig.now), Motor::Released, "at a limit nothing is started");
    rig.world(|inputs| inputs.key = Some(Key::Clockwise));
    rig.pass_ms(1000);
    assert_eq!(rig.controller.motor(rig.now), Motor::InControl);
    assert_eq!(rig.controller.system_status(rig.now) & system::MOTOR_RELEASED, 0);
    rig.world(|inputs| inputs.key = None);
    rig.pass_ms(50);
    assert_eq!(rig.controller.motor(rig.now), Motor::InControl, "it brakes");
    rig.pass_ms(1000);
    assert_eq!(rig.controller.motor(rig.now), Motor::Released);
}

#[test]
fn a_hand_does_not_turn_what_runs_out_or_is_held() {
    let mut rig = Rig::enabled(Parameters::default());
    rig.travel_to(5000);
    rig.pass_ms(1000);
    rig.control(0x0000);
    assert!(!rig.controller.turn_shaft(rig.now, 10), "it runs out");
    rig.pass_ms(1000);
    rig.world(|inputs| inputs.shaft = Shaft::Blocked);
    assert!(!rig.controller.turn_shaft(rig.now, 10), "something holds it");
    rig.world(|inputs| inputs.shaft = Shaft::Free);
    assert!(rig.controller.turn_shaft(rig.now, 10));
}

#[test]
fn another_mode_forgets_what_was_acknowledged() {
    let mut rig = Rig::enabled(Parameters::default());
    rig.travel_to(100);
    rig.pass_ms(5000);
    assert!(rig.has(status::ACKNOWLEDGED));
    rig.set(|parameters| parameters.mode = Mode::Velocity);
    rig.set(|parameters| parameters.mode = Mode::Positioning);
    assert!(!rig.has(status::ACKNOWLEDGED));
}

#[test]
fn a_drive_that_stands_at_velocity_0_does_not_run_in_the_other_mode() {
    let mut rig = in_velocity_mode();
    rig.set(|parameters| parameters.target_velocity = 0);
    rig.control(0x000F);
    rig.set(|parameters| parameters.mode = Mode::Positioning);
    rig.set(|parameters| parameters.target_velocity = 30);
    rig.pass_ms(1000);
    assert_eq!(rig.controller.velocity(rig.now), 0);
}

#[test]
fn a_word_that_disables_starts_nothing() {
    let mut rig = Rig::enabled(Parameters { target_position: 5000, ..Parameters::default() });
    rig.control(0x0017);
    rig.pass_ms(1000);
    assert_eq!((rig.controller.state(), rig.controller.position(rig.now)), (State::SwitchedOn, 0));
}

#[test]
fn a_quick_stop_of_velocity_mode_stands_whatever_target_comes() {
    let mut rig = in_velocity_mode();
    rig.control(0x000F);
    rig.pass_ms(1000);
    rig.control(0x0002);
    rig.pass_ms(1000);
    rig.set(|parameters| parameters.target_velocity = 60);
    rig.pass_ms(1000);
    assert_eq!(rig.controller.velocity(rig.now), 0);
}

#[test]
fn a_travel_is_resumed_by_stop_alone() {
    let mut rig = Rig::enabled(Parameters::default());
    rig.travel_to(5000);
    rig.pass_ms(1000);
    rig.control(0x011F);
    rig.pass_ms(1000);
    for word in [0x010F, 0x011F, 0x010F] {
        rig.control(word);
        rig.pass_ms(500);
        assert_eq!(rig.controller.velocity(rig.now), 0, "{word:04X}");
    }
    rig.control(0x000F);
    rig.pass_ms(500);
    assert_eq!(rig.controller.velocity(rig.now), 30);
}

#[test]
fn inching_ends_with_its_own_bit_only_and_takes_no_other_order() {
    let mut rig = Rig::enabled(Parameters { target_position: -5000, ..Parameters::default() });
    rig.control(0x000F);
    // The positive direction comes first; then bits of others fall, rise, and come again.
    for word in [0xC00F, 0x400F, 0x400F, 0x600F, 0x400F, 0x401F, 0x400F, 0xC00F, 0x400F] {
        rig.control(word);
        rig.pass_ms(1000);
        assert_eq!(rig.controller.velocity(rig.now), 30, "{word:04X}");
    }
    rig.control(0x000F);
    rig.pass_ms(1000);
    assert_eq!(rig.controller.velocity(rig.now), 0);
}

#[test]
fn an_order_that_leads_beyond_a_limit_replaces_nothing() {
    for (limits, limit, delta_inch, inch) in [([-1000, 1000], 1000, 10, 0x400F), ([-1000, 1000], -1000, -10, 0x800F)] {
        for word in [0x200F, inch] {
            let mut rig = Rig::enabled(Parameters { limits, delta_inch, ..Parameters::default() });
            rig.travel_to(limit);
            rig.pass_ms(60_000);
            rig.control(0x000F);
            rig.set(|parameters| parameters.target_position = 0);
            rig.control(word);
            rig.pass_ms(1000);
            assert!(rig.has(status::TARGET_REACHED), "{word:04X} at {limit}");
        }
    }
}

#[test]
fn a_world_that_stays_as_it_is_changes_nothing() {
    let mut rig = Rig::enabled(Parameters::default());
    rig.travel_to(5000);
    rig.pass_ms(1000);
    rig.world(|inputs| *inputs = Inputs::default());
    rig.pass_ms(5500);
    assert!(rig.has(status::TARGET_REACHED));
}

#[test]
fn a_key_does_not_touch_a_travel() {
    let mut rig = Rig::enabled(Parameters::default());
    rig.travel_to(5000);
    rig.pass_ms(1000);
    rig.world(|inputs| inputs.key = Some(Key::Clockwise));
    rig.world(|inputs| inputs.key = None);
    rig.pass_ms(500);
    assert_eq!(rig.controller.velocity(rig.now), 30);
}

/// A job that something holds is under way, and goes on when it is let go; one that was interrupted stays so.
#[test]
fn what_is_held_stays_under_way() {
    for (word, mode, goes_on) in
        [(0x001F, Mode::Positioning, true), (0x200F, Mode::Positioning, false), (0x000F, Mode::Velocity, true)]
    {
        let mut rig = Rig::enabled(Parameters { mode, target_velocity: 30, ..Parameters::default() });
        rig.set(|parameters| (parameters.target_position, parameters.delta_inch) = (9000, 9000));
        rig.control(if mode == Mode::Velocity { 0x010F } else { 0x000F });
        rig.control(word);
        rig.pass_ms(1000);
        rig.world(|inputs| inputs.shaft = Shaft::Blocked);
        rig.pass_ms(100);
        assert!(rig.controller.is_travelling(rig.now) && !rig.has(status::READY), "{word:04X}");
        // Another load moves nothing that is held.
        rig.world(|inputs| inputs.attainable_rpm = Some(20));
        assert_eq!(rig.controller.velocity(rig.now), 0, "{word:04X}");
        rig.world(|inputs| *inputs = Inputs::default());
        rig.pass_ms(1000);
        assert_eq!(rig.controller.velocity(rig.now) == 30, goes_on, "{word:04X}");
    }
    let mut rig = Rig::enabled(Parameters::default());
    rig.travel_to(9000);
    rig.pass_ms(1000);
    rig.control(0x011F);
    rig.pass_ms(100);
    rig.world(|inputs| inputs.shaft = Shaft::Blocked);
    rig.world(|inputs| inputs.shaft = Shaft::Free);
    rig.pass_ms(1000);
    assert!(rig.has(status::POSITIONING) && rig.controller.velocity(rig.now) == 0);
    rig.control(0x001F);
    rig.pass_ms(1000);
    assert_eq!(rig.controller.velocity(rig.now), 30);
}

#[test]
fn a_loop_that_is_interrupted_or_held_is_still_before_its_turn() {
    let against = |rig: &Rig| rig.controller.system_status(rig.now) & system::AGAINST_APPROACH != 0;
    for held in [false, true] {
        let mut rig = Rig::enabled(Parameters { positioning_type: 1, ..Parameters::default() });
        rig.travel_to(-5000);
        rig.pass_ms(1000);
        if held {
            rig.world(|inputs| inputs.shaft = Shaft::Blocked);
        } else {
            rig.control(0x011F);
        }
        rig.pass_ms(400);
        assert!(rig.controller.velocity(rig.now) == 0 && against(&rig), "held: {held}");
    }
}

/// From wherever the drive stands, the direction of the way decides.
#[test]
fn a_loop_turns_by_the_way_and_not_by_the_target() {
    for (from, target, turns) in [(1000, 500, true), (-1000, -500, false), (1000, 1000, false), (500, 1000, false)] {
        let mut rig = Rig::new(Parameters { positioning_type: 1, loop_length: 400, ..Parameters::default() });
        rig.controller.calibrate(rig.now, from);
        rig.controller.set_network(rig.now, Network::Operational);
        [0x0106, 0x0107, 0x010F, 0x000F].into_iter().for_each(|word| rig.control(word));
        rig.travel_to(target);
        let mut least = from;
        for _ in 0..500 {
            rig.pass_ms(20);
            least = least.min(rig.controller.position(rig.now));
        }
        assert_eq!(rig.controller.position(rig.now), target);
        assert_eq!(least == target - 400, turns, "from {from} to {target}: {least}");
    }
}

#[test]
fn a_load_that_just_allows_the_velocity_is_no_lag_error() {
    for (attainable_rpm, lags) in [(30, false), (29, true)] {
        let mut rig = Rig::enabled(Parameters::default());
        rig.world(|inputs| inputs.attainable_rpm = Some(attainable_rpm));
        rig.travel_to(5000);
        rig.pass_ms(1000);
        assert_eq!(rig.has(status::WARNING), lags, "{attainable_rpm} rev/min");
    }
}

/// Exactly at a threshold: those of the manual, and those that are assumptions.
#[test]
fn thresholds_are_where_they_are_said_to_be() {
    let with = |change: fn(&mut Inputs)| {
        let mut inputs = Inputs::default();
        change(&mut inputs);
        inputs
    };
    assert!(with(|inputs| inputs.output_stage_supply_100mv = 100).supply_is_present());
    assert!(!with(|inputs| inputs.output_stage_supply_100mv = 99).supply_is_present());
    assert!(with(|inputs| inputs.control_supply_100mv = 100).control_is_supplied());
    assert!(!with(|inputs| inputs.control_supply_100mv = 99).control_is_supplied());
    assert!(!with(|inputs| inputs.battery_10mv = 260).battery_is_low());
    assert!(with(|inputs| inputs.battery_10mv = 259).battery_is_low());
    for (supply, good) in [(179, false), (180, true), (350, true), (351, false)] {
        let inputs = Inputs { output_stage_supply_100mv: supply, ..Inputs::default() };
        assert_eq!(inputs.supply_is_good(), good, "{supply}");
    }
}

/// The named ones of the review: each had gone unnoticed.
#[test]
fn the_current_of_a_fault_is_above_its_threshold() {
    for (load_ma, faulty) in [(200, false), (201, true)] {
        let mut rig = Rig::enabled(Parameters::default());
        rig.travel_to(5000);
        rig.world(|inputs| (inputs.output_stage_supply_100mv, inputs.load_ma) = (170, load_ma));
        rig.pass_ms(100);
        assert_eq!(rig.controller.state() == State::Fault, faulty, "{load_ma} mA");
    }
    for (load_ma, warned) in [(2400, false), (2401, true)] {
        let mut rig = Rig::enabled(Parameters::default());
        rig.travel_to(5000);
        rig.world(|inputs| inputs.load_ma = load_ma);
        let shown = rig.controller.system_status(rig.now) & system::OVERCURRENT != 0;
        assert_eq!((shown, rig.has(status::WARNING)), (warned, warned), "{load_ma} mA");
    }
    let mut rig = Rig::enabled(Parameters::default());
    rig.travel_to(5000);
    rig.pass_ms(1000);
    rig.world(|inputs| inputs.internal_error = true);
    rig.pass_ms(125);
    assert_eq!((rig.controller.velocity(rig.now), rig.controller.position(rig.now)), (0, 750));
    rig.controller.set_network(rig.now, Network::PreOperational);
    rig.world(|inputs| inputs.key = Some(Key::CounterClockwise));
    rig.pass_ms(1000);
    assert_eq!(rig.controller.position(rig.now), 750, "keys rest in FAULT");
}
