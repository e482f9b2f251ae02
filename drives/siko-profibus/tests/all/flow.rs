//! The sequences of figures 13 and 14 (AG02, 9.5.3 and 9.5.6), telegram by telegram, for both drives: the figures
//! of the AG03/1 are lost, and its bits are those of the AG02. Status words are as printed, except for bit 14 in velocity
//! mode. Of the control words, 000Bh enables, 003Bh is ready to travel, bit 6 starts, 001Bh stops on the way, 010Bh, 020Bh and 820Bh
//! inch, 004Bh turns.

use super::rig::Rig;
use lexican_profibus::pkw::{Task, Value};
use lexican_profibus::{Application, State};
use lexican_runtime::Duration;
use lexican_runtime::host::Node;
use siko::sim::inputs::{Key, Shaft};
use siko_profibus::words::order;
use siko_profibus::{AG02, AG03_1, Model, PPO};

const DRIVES: [&Model; 2] = [&AG03_1, &AG02];

/// Power on to "ready to travel".
const READY: &str = "0000; shows 0x1x 1x11 x01x 0011; 000B; shows xx1x 1x11 x011 0111; 003B; shows ready";

fn ready(model: &'static Model) -> Rig {
    let mut rig = Rig::new(model);
    rig.plays(READY);
    rig
}

/// Plays orders from "ready to travel".
#[track_caller]
fn plays(orders: &str) {
    DRIVES.into_iter().for_each(|model| ready(model).plays(orders));
}

/// Each edge in the control word is acknowledged by an edge in the status word.
#[test]
fn figure_13_travels() {
    let there = "t5000; 007B; shows travelling; shows xxx1 xxxx xxxx xxxx; comes-to ready; actual 5000; shows xxxx x1xx xxxx xxxx";
    let back = "t-5000; 003B; shows travelling; shows xxx0 xxxx xxxx xxxx; comes-to ready; actual -5000; shows xxxx x1xx xxxx xxxx";
    plays(&format!("{there}; {back}"));
}

/// Below 2 rev/min counts as standstill.
#[test]
fn figure_13_stops_on_the_way_and_goes_on() {
    let stops = "t5000; 007B; w1000; 005B; comes-to 001x 1x11 x011 0111; w50; mark; actual 1..4999; w500; way 0";
    let goes_on = "once 007B; shows 000x xx1x x011 0111; once 007B; shows travelling; comes-to ready; actual 5000";
    plays(&format!("{stops}; {goes_on}"));
}

#[test]
fn figure_13_a_stop_discards_the_travel() {
    let stops = "t5000; 007B; w1000; 004B; comes-to 101x 1x11 x011 0111; w50; mark; actual <5000; 007B; w500; way 0";
    plays(&format!("{stops}; 003B; comes-to ready; actual 5000"));
}

#[test]
fn figure_13_inches() {
    plays("000B; 010B; shows inching; comes-to ready; actual 1600");
    plays("000B; mark; 020B; w1000; shows inching; 000B; comes-to ready; way >500");
    plays("000B; mark; 820B; w1000; shows inching; 000B; comes-to ready; way <-500");
    // Only travels have an intermediate stop.
    plays("011B; comes-to ready; actual 1600");
}

/// Parameter 25: with 50 % instead of 100 %, the way is twice as long. From 800 increments/s: 50 or 100 increments,
/// less what the telegrams take.
#[test]
fn inching_2_stops_as_programmed() {
    for (stop, way) in [(0, "35..50"), (1, "80..100")] {
        plays(&format!("set 1021 {stop}; set 1008 30; 020B; w1000; 003B; mark; comes-to ready; w50; way {way}"));
    }
}

/// While the cause lasts, the fault stays.
#[test]
fn figure_13_a_fault_is_acknowledged_and_the_interlock_released() {
    let faulty = "000B; fault; shows xxxx xxxx x0xx 10xx; 008B; shows xxxx xxxx x0xx 1xxx; heal; 000B; shows xxxx xxxx x0xx 1xxx";
    let reset = "008B; shows xxxx xxxx x1xx 0xxx; 000B; shows xxxx xxxx x1xx 00xx; 000A; shows xxxx xxxx x0xx 00xx";
    for model in DRIVES {
        for mode in ["", "velocity"] {
            let again = "000B; shows xxxx xxxx x0xx 01xx; pnu 952 FFFF 1; pnu 1020 0100 0";
            Rig::new(model).plays(&format!("{mode}; {faulty}; {reset}; {again}"));
        }
    }
}

/// 1020.7: the motor is released.
#[test]
fn the_motor_is_released_by_off_1_and_off_2_and_held_without_enable() {
    for (word, pattern, released) in
        [("000A", "xx1x xxxx x011 0011", 128), ("0009", "xx1x xxxx x010 0011", 128), ("0003", "xx1x xxxx x011 0011", 0)]
    {
        let stops = format!("t5000; 007B; w1000; {word}; comes-to {pattern}; pnu 1020 0080 {released}; actual <5000");
        plays(&format!("{stops}; w100; shows {pattern}; 003B; comes-to ready"));
    }
}

/// Another setpoint takes effect at once.
#[test]
fn figure_14_turns() {
    let enabled =
        "velocity; 0000; shows 0b11 111x x01x 0011; 000B; shows xb11 111x x011 0111; comes-to 1b11 111x x011 0111";
    let turns = "t30; 004B; comes-to 0b01 1111 x011 0111; w500; actual 30";
    let back = "t-20; 004B; comes-to 0b01 1110 x011 0111; comes-to 0b01 1111 x011 0111; w500; actual -20";
    for model in DRIVES {
        let stands = "000B; comes-to 1b11 111x x011 0111; w50; actual 0";
        Rig::new(model).plays(&format!("{enabled}; {turns}; {back}; {stands}"));
    }
}

#[test]
fn a_travel_needs_a_target_within_the_limits() {
    for target in [i32::MIN, 10_000_000, 1001] {
        let refused = format!("t{target}; 007B; shows ready; 003B; actual 0; shows xxx0 xxxx xxxx xxxx");
        plays(&format!(
            "set 1016 1000; t500; 003B; {refused}; t1000; 007B; shows travelling; refused 930 1; refused 970 5"
        ));
    }
}

/// Beyond a limit, ZSW.14 is set, and only inching leads back.
#[test]
fn beyond_a_limit_only_inching_leads_back() {
    let beyond = "shows 011x 1x11 x011 0111";
    plays(&format!(
        "set 1017 1000; set 1019 2000; {beyond}; t5000; 007B; {beyond}; 820B; {beyond};
        000B; 010B; comes-to 101x 1x11 x011 0111; actual 2000"
    ));
}

/// The AG02 additionally has an input that enables the motor, and limit switches.
#[test]
fn the_inputs_of_the_ag02_take_readiness_away() {
    let unready = "shows 001x 1x11 x011 0111";
    ready(&AG02).plays(&format!(
        "enable off; {unready}; enable on; switch on; {unready}; pnu 1020 0003 1; switch off; shows ready"
    ));
    // After such a stop, it does not turn again by itself.
    Rig::new(&AG02).plays(
        "velocity; 000B; t30; 004B; w1000; enable off; w2000; actual 0; shows 0xxx xxxx xxxx xxxx;
        enable on; w2000; actual 0; shows 0xxx xxxx xxxx xxxx; 000B; 004B; w1000; actual 30",
    );
}

#[test]
fn without_supply_it_is_not_ready_to_be_switched_on() {
    for model in DRIVES {
        Rig::new(model).plays("nosupply; 000B; shows 0x1x 1x11 x011 0000; supply; shows xx1x 1x11 x011 0111");
    }
    plays("shows xxxx xxxx 0xxx xxxx; battery; shows xxxx xxxx 1xxx xxxx; dark; shows xxxx xxxx xxxx xx00");
}

/// The word that enables a drive starts nothing. Once enabled, a drive without an interrupted travel follows each edge
/// of bit 6.
#[test]
fn a_travel_begins_by_an_edge_once_the_drive_is_enabled() {
    for model in DRIVES {
        let mut rig = Rig::power_on(model);
        assert_eq!(rig.drive.status_word(rig.now) & 0x1040, 0);
        rig.plays("t5000; 007B; shows ready; actual 0; 000B; 007B; shows travelling");
    }
}

/// If the drive refuses a velocity, it runs neither at this nor at the previous one.
#[test]
fn each_enabled_setpoint_turns_until_the_drive_is_released() {
    for model in DRIVES {
        let mut rig = Rig::power_on(model);
        rig.plays("004B; velocity");
        for end in ["0000", "004A", "000B"] {
            rig.plays(&format!("t30; 004B; w1000; actual 30; shows 0xxx xxxx xxxx xxxx; {end}; w2000; actual 0"));
        }
        rig.plays("t1000000; 004B; w1000; actual 0; shows 1xxx xxxx xxxx xxxx");
    }
}

/// When data exchange ends, the slave releases the motor, and the keys work again.
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
