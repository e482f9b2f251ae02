//! The sequences of figures 13 and 14 (AG02, 9.5.3 and 9.5.6), telegram by telegram, for both drives: the figures
//! of the AG03/1 are lost, and its bits are those of the AG02. Status words are as printed, except for bit 14 in velocity
//! mode.

use super::rig::Rig;
use lexican_profibus::pkw::{Refusal, Task, Value};
use lexican_profibus::{Application, State};
use lexican_runtime::Duration;
use lexican_runtime::host::Node;
use siko::sim::inputs::{Inputs, Key, Shaft};
use siko_profibus::words::order;
use siko_profibus::{AG02, AG03_1, Model, PPO};

const DRIVES: [&Model; 2] = [&AG03_1, &AG02];

const READY_TO_SWITCH_ON: &str = "0x1x 1x11 x01x 0011";
const OPERATION_ENABLED: &str = "xx1x 1x11 x011 0111";
const READY_TO_TRAVEL: &str = "101x 1x11 x011 0111";
const TRAVELLING: &str = "000x 1x1x x011 0111";
const INCHING: &str = "0x0x 1x1x x011 0111";

/// Power on to "ready to travel".
fn ready(model: &'static Model) -> Rig {
    let mut rig = Rig::new(model);
    rig.control(order::OFF);
    rig.shows(READY_TO_SWITCH_ON);
    rig.control(order::ENABLE);
    rig.shows(OPERATION_ENABLED);
    rig.control(order::READY);
    rig.shows(READY_TO_TRAVEL);
    rig
}

#[test]
fn figure_13_travels() {
    for model in DRIVES {
        let mut rig = ready(model);
        rig.target(5000);
        for (target, start) in [(5000, order::START), (-5000, 0)] {
            rig.target(target);
            let acknowledged = rig.word() & 0x1000;
            rig.control(order::READY | start);
            rig.shows(TRAVELLING);
            assert_ne!(rig.word() & 0x1000, acknowledged, "{}: each edge is acknowledged by one", model.name);
            rig.comes_to(READY_TO_TRAVEL);
            assert_eq!((rig.actual(), rig.word() & 0x0400), (target, 0x0400));
        }
    }
}

#[test]
fn figure_13_stops_on_the_way_and_goes_on() {
    for model in DRIVES {
        let mut rig = ready(model);
        rig.target(5000);
        rig.control(order::READY | order::START);
        rig.pass_ms(1000);
        rig.control(order::INTERMEDIATE_STOP | order::START);
        rig.comes_to("001x 1x11 x011 0111");
        // What is slower than 2 rev/min counts as standing.
        rig.pass_ms(50);
        let stopped = rig.actual();
        assert!((1..5000).contains(&stopped));
        rig.pass_ms(500);
        assert_eq!(rig.actual(), stopped);
        rig.control_once(order::READY | order::START);
        rig.shows("000x xx1x x011 0111");
        rig.control_once(order::READY | order::START);
        rig.shows(TRAVELLING);
        rig.comes_to(READY_TO_TRAVEL);
        assert_eq!(rig.actual(), 5000);
    }
}

#[test]
fn figure_13_a_stop_discards_the_travel() {
    for model in DRIVES {
        let mut rig = ready(model);
        rig.target(5000);
        rig.control(order::READY | order::START);
        rig.pass_ms(1000);
        rig.control(order::ENABLE | order::START);
        rig.comes_to("101x 1x11 x011 0111");
        rig.pass_ms(50);
        let stopped = rig.actual();
        assert!(stopped < 5000);
        rig.control(order::READY | order::START);
        rig.pass_ms(500);
        assert_eq!(rig.actual(), stopped, "{}: it is not taken up again", model.name);
        rig.control(order::READY);
        rig.comes_to(READY_TO_TRAVEL);
        assert_eq!(rig.actual(), 5000);
    }
}

#[test]
fn figure_13_inches() {
    for model in DRIVES {
        let mut rig = ready(model);
        rig.control(order::ENABLE);
        rig.control(order::INCHING_1);
        rig.shows(INCHING);
        rig.comes_to(READY_TO_TRAVEL);
        assert_eq!(rig.actual(), 1600);
        rig.control(order::ENABLE);
        for (word, sign) in [(order::INCHING_2_POSITIVE, 1), (order::INCHING_2_NEGATIVE, -1)] {
            let before = rig.actual();
            rig.control(word);
            rig.pass_ms(1000);
            rig.shows(INCHING);
            rig.control(order::ENABLE);
            rig.comes_to(READY_TO_TRAVEL);
            let moved = (rig.actual() - before) * sign;
            assert!(moved > 500, "{}: {moved}", model.name);
        }
    }
}

/// Parameter 25: with 50 % instead of all, the way is twice as long.
#[test]
fn inching_2_stops_as_programmed() {
    for model in DRIVES {
        let mut ways = [0; 2];
        for (stop, way) in (0..).zip(&mut ways) {
            let mut rig = ready(model);
            assert_eq!((rig.write(1021, stop), rig.write(1008, 30)), (Ok(stop.unsigned_abs()), Ok(30)));
            rig.control(order::INCHING_2_POSITIVE);
            rig.pass_ms(1000);
            rig.control(order::READY);
            let from = rig.actual();
            rig.comes_to(READY_TO_TRAVEL);
            rig.pass_ms(50);
            *way = rig.actual() - from;
        }
        // 800 increments/s: 50 or 100 increments, less what the telegrams take.
        assert!((35..=50).contains(&ways[0]) && (80..=100).contains(&ways[1]), "{}: {ways:?}", model.name);
    }
}

#[test]
fn figure_13_a_fault_is_acknowledged_and_the_interlock_released() {
    for (model, turns) in [(DRIVES[0], false), (DRIVES[1], false), (DRIVES[0], true), (DRIVES[1], true)] {
        let mut rig = if turns { Rig::in_velocity_mode(model) } else { Rig::new(model) };
        rig.control(order::ENABLE);
        rig.world(|inputs| inputs.sensor_fails = true);
        rig.shows("xxxx xxxx xxxx 1xxx");
        rig.shows("xxxx xxxx x0xx x0xx");
        // While the cause is there, it stays.
        rig.control(order::ENABLE | order::ACKNOWLEDGE);
        rig.shows("xxxx xxxx x0xx 1xxx");
        rig.world(|inputs| inputs.sensor_fails = false);
        rig.control(order::ENABLE);
        rig.shows("xxxx xxxx x0xx 1xxx");
        rig.control(order::ENABLE | order::ACKNOWLEDGE);
        rig.shows("xxxx xxxx x1xx 0xxx");
        rig.control(order::ENABLE);
        rig.shows("xxxx xxxx x1xx 00xx");
        rig.control(order::ENABLE & !1);
        rig.shows("xxxx xxxx x0xx 00xx");
        rig.control(order::ENABLE);
        rig.shows("xxxx xxxx x0xx 01xx");
        assert_eq!((rig.read(952), rig.read(1020).map(|word| word & 0x100)), (Ok(1), Ok(0)));
    }
}

#[test]
fn the_motor_is_released_by_off_1_and_off_2_and_held_without_enable() {
    for model in DRIVES {
        for (word, pattern, released) in [
            (0x000A, "xx1x xxxx x011 0011", true),
            (0x0009, "xx1x xxxx x010 0011", true),
            (0x0003, "xx1x xxxx x011 0011", false),
        ] {
            let mut rig = ready(model);
            rig.target(5000);
            rig.control(order::READY | order::START);
            rig.pass_ms(1000);
            rig.control(word);
            rig.comes_to(pattern);
            let status = rig.read(1020).unwrap();
            assert_eq!(status & 0x80 != 0, released, "{} {word:04X}", model.name);
            assert!(rig.actual() < 5000);
            rig.pass_ms(100);
            rig.shows(pattern);
            rig.control(order::READY);
            rig.comes_to(READY_TO_TRAVEL);
        }
    }
}

#[test]
fn figure_14_turns() {
    for model in DRIVES {
        let bit_14 = if model.velocity_bit_14 { '1' } else { '0' };
        let with = |pattern: &str| {
            let mut pattern: Vec<char> = pattern.chars().collect();
            pattern[1] = bit_14;
            pattern.into_iter().collect::<String>()
        };
        let mut rig = Rig::in_velocity_mode(model);
        rig.control(order::OFF);
        rig.shows(&with("0011 111x x01x 0011"));
        rig.control(order::ENABLE);
        rig.shows(&with("x011 111x x011 0111"));
        rig.comes_to(&with("1011 111x x011 0111"));
        rig.target(30);
        rig.control(order::TURN);
        rig.comes_to(&with("0001 1111 x011 0111"));
        rig.pass_ms(500);
        assert_eq!(rig.actual(), 30);
        // Another setpoint holds at once.
        rig.target(-20);
        rig.control(order::TURN);
        rig.comes_to(&with("0001 1110 x011 0111"));
        rig.comes_to(&with("0001 1111 x011 0111"));
        rig.pass_ms(500);
        assert_eq!(rig.actual(), -20);
        rig.control(order::ENABLE);
        rig.comes_to(&with("1011 111x x011 0111"));
        rig.pass_ms(50);
        assert_eq!(rig.actual(), 0);
    }
}

#[test]
fn a_travel_needs_a_target_within_the_limits() {
    for model in DRIVES {
        let mut rig = ready(model);
        assert_eq!(rig.write(1016, 1000), Ok(1000));
        rig.target(500);
        rig.control(order::READY);
        for target in [i32::MIN, 10_000_000, 1001] {
            rig.target(target);
            rig.control(order::READY | order::START);
            rig.shows(READY_TO_TRAVEL);
            rig.control(order::READY);
            assert_eq!((rig.actual(), rig.word() & 0x1000), (0, 0));
        }
        rig.target(1000);
        rig.control(order::READY | order::START);
        rig.shows(TRAVELLING);
        assert_eq!(rig.write(930, 1), Err(Refusal::WRONG_STATE));
        assert_eq!(rig.write(970, 5), Err(Refusal::WRONG_STATE));
    }
}

/// Beyond a limit ZSW.14 is set, and only inching leads back.
#[test]
fn beyond_a_limit_only_inching_leads_back() {
    for model in DRIVES {
        let mut rig = ready(model);
        assert_eq!((rig.write(1017, 1000), rig.write(1019, 2000)), (Ok(1000), Ok(2000)));
        rig.shows("011x 1x11 x011 0111");
        rig.target(5000);
        rig.control(order::READY | order::START);
        rig.shows("011x 1x11 x011 0111");
        rig.control(order::INCHING_2_NEGATIVE);
        rig.shows("011x 1x11 x011 0111");
        rig.control(order::ENABLE);
        rig.control(order::INCHING_1);
        rig.comes_to("101x 1x11 x011 0111");
        assert_eq!(rig.actual(), 2000);
    }
}

/// What the AG02 has besides: an input that enables the motor, and limit switches.
#[test]
fn the_inputs_of_the_ag02_take_readiness_away() {
    let mut rig = ready(&AG02);
    rig.world(|inputs| inputs.enable = false);
    rig.shows("001x 1x11 x011 0111");
    rig.world(|inputs| (inputs.enable, inputs.limit_switches) = (true, [true, false]));
    rig.shows("001x 1x11 x011 0111");
    assert_eq!(rig.read(1020).map(|word| word & 0x0003), Ok(0x0001));
    rig.world(|inputs| inputs.limit_switches = [false; 2]);
    rig.shows(READY_TO_TRAVEL);
}

#[test]
fn without_supply_it_is_not_ready_to_be_switched_on() {
    for model in DRIVES {
        let mut rig = Rig::new(model);
        rig.world(|inputs| inputs.output_stage_supply_100mv = 0);
        rig.control(order::ENABLE);
        rig.shows("0x1x 1x11 x011 0000");
        rig.world(|inputs| inputs.output_stage_supply_100mv = 240);
        rig.shows(OPERATION_ENABLED);
    }
}

/// What the slave does when data exchange ends: the motor is released, and the keys work again.
#[test]
fn without_its_master_the_drive_is_released() {
    for model in DRIVES {
        let mut rig = ready(model);
        rig.target(5000);
        rig.control(order::READY | order::START);
        rig.pass_ms(1000);
        let now = rig.now;
        rig.drive.take_outputs(now, &[0; 14]);
        rig.drive.enter(now, State::WaitParameters);
        rig.simulated().handle_timeout(now + Duration::from_secs(2));
        let (now, drive) = (now + Duration::from_secs(2), rig.drive.drive());
        let (position, status) = (drive.position(now), rig.drive.status_word(now));
        assert!((1..5000).contains(&position) && status & 4 == 0, "{}: {position}", model.name);
        assert_eq!(drive.velocity(now), 0);
    }
}

/// The word that enables a drive starts nothing, and one that is not interrupted takes each edge of bit 6.
#[test]
fn a_travel_begins_by_an_edge_once_the_drive_is_enabled() {
    for model in DRIVES {
        let mut rig = Rig::power_on(model);
        assert_eq!(rig.drive.status_word(rig.now) & 0x1040, 0);
        rig.target(5000);
        rig.control(order::READY | order::START);
        rig.shows(READY_TO_TRAVEL);
        assert_eq!(rig.actual(), 0);
        rig.control(order::ENABLE);
        rig.control(order::READY | order::START);
        rig.shows(TRAVELLING);
    }
}

#[test]
fn bits_for_travels_leave_inching_alone() {
    for model in DRIVES {
        let mut rig = ready(model);
        rig.control(order::INCHING_1 | order::INTERMEDIATE_STOP);
        rig.comes_to(READY_TO_TRAVEL);
        assert_eq!(rig.actual(), 1600);
    }
}

#[test]
fn each_enabled_setpoint_turns_until_the_drive_is_released() {
    for model in DRIVES {
        let mut rig = Rig::power_on(model);
        rig.control(order::TURN);
        assert_eq!(rig.write(930, 1), Ok(1));
        for end in [order::OFF, order::TURN & !1, order::ENABLE] {
            rig.target(30);
            rig.control(order::TURN);
            rig.pass_ms(1000);
            assert_eq!((rig.actual(), rig.word() & 0x8000), (30, 0), "{} {end:04X}", model.name);
            rig.control(end);
            rig.pass_ms(2000);
            assert_eq!(rig.actual(), 0);
        }
        // A velocity that the drive does not take is none, nor is that of before.
        rig.target(1_000_000);
        rig.control(order::TURN);
        rig.pass_ms(1000);
        assert_eq!((rig.actual(), rig.word() & 0x8000), (0, 0x8000));
    }
}

/// What the AG02's input has stopped does not turn again by itself.
#[test]
fn what_an_input_has_stopped_waits_for_another_order() {
    let mut rig = Rig::in_velocity_mode(&AG02);
    rig.control(order::ENABLE);
    rig.target(30);
    rig.control(order::TURN);
    rig.pass_ms(1000);
    for enable in [false, true] {
        rig.world(|inputs| inputs.enable = enable);
        rig.pass_ms(2000);
        assert_eq!((rig.actual(), rig.word() & 0x8000), (0, 0));
    }
    rig.control(order::ENABLE);
    rig.control(order::TURN);
    rig.pass_ms(1000);
    assert_eq!(rig.actual(), 30);
}

#[test]
fn a_warning_shows_and_a_drive_without_supply_shows_no_readiness() {
    for model in DRIVES {
        let mut rig = ready(model);
        assert_eq!(rig.word() & 0x80, 0);
        rig.world(|inputs| inputs.battery_10mv = Inputs::BATTERY_LOW_10MV - 1);
        assert_eq!(rig.word() & 0x80, 0x80);
        rig.world(|inputs| inputs.control_supply_100mv = 0);
        assert_eq!(rig.word() & 0x0003, 0);
    }
}

#[test]
fn what_happens_between_two_telegrams_is_seen() {
    for model in DRIVES {
        let mut rig = ready(model);
        rig.target(900_000);
        rig.control(order::READY | order::START);
        rig.pass_ms(1000);
        rig.world(|inputs| inputs.shaft = Shaft::Blocked);
        let (later, mut drive, mut inputs) = (rig.now + Duration::from_secs(60), rig.drive.clone(), [0; 14]);
        drive.write_inputs(later, &mut inputs);
        assert_eq!(PPO.word(&inputs, 0).unwrap() & 0x0008, 0x0008);
        // The number of faults.
        rig.drive.take_outputs(later, &rig.outputs(Task::Read { number: 952 }.pkw()));
        rig.drive.write_inputs(later, &mut inputs);
        assert_eq!(PPO.pkw(&inputs).unwrap().value, 1);
    }
}

#[test]
fn a_write_is_carried_out_once_while_data_is_exchanged() {
    for model in DRIVES {
        let mut rig = Rig::new(model);
        let now = rig.now;
        let calibrate = rig.outputs(Task::Write { number: 970, value: Value::Word(5) }.pkw());
        for (begins, position) in [(false, 0), (false, 500), (true, 0)] {
            assert!(rig.simulated().turn_shaft(now, 500));
            if begins {
                rig.drive.enter(now, State::WaitParameters);
                rig.drive.enter(now, State::DataExchange);
            }
            rig.drive.take_outputs(now, &calibrate);
            assert_eq!(rig.simulated().position(now), position, "{}", model.name);
        }
    }
}

/// The AG03/1 has keys.
#[test]
fn the_keys_work_while_no_data_is_exchanged() {
    let mut rig = Rig::new(&AG03_1);
    for (state, moves) in [(State::DataExchange, false), (State::WaitParameters, true)] {
        let (now, later) = (rig.now, rig.now + Duration::from_secs(1));
        rig.drive.enter(now, state);
        rig.simulated().set_inputs(now, |inputs| inputs.key = Some(Key::CounterClockwise));
        assert_eq!(rig.simulated().position(later) != 0, moves);
        rig.simulated().set_inputs(now, |inputs| inputs.key = None);
    }
}
