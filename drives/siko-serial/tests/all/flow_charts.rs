//! Figures 4 and 6 of the manual, on the paths that `tests/verify` does not take, by the client over a line of 9600
//! baud in virtual time. F0 is the set-point, H08 the velocity of inching; T3 and T4 select how inching operation 2
//! stops.

use super::serial_rig::{Rig, is};
use siko_serial::command::{Command, Long};
use siko_serial::error::ErrorNumber;

#[track_caller]
fn plays(script: &str) {
    Rig::new().plays(script);
}

#[test]
fn positioning_follows_figure_4() {
    let under_way = "shows 000x 0000 x000 x000; F0+0005000; M; comes-to travelling";
    plays(&format!(
        "{under_way}; M?04; Y?04; O; comes-to interrupted; M; comes-to travelling; comes-to arrived; Z=5000"
    ));
    // "akt. Fahrauftrag beenden": from the travel, and from the intermediate stop.
    plays("F0+0005000; M; comes-to arrived; F0+0000000; M; comes-to travelling; I; comes-to over; Z>0");
    plays(&format!("{under_way}; N; comes-to interrupted; I; comes-to over; Z<5000; Z>0"));
    plays(&format!("{under_way}; O; comes-to interrupted; F0-0000100; M; comes-to arrived; W=-100"));
    // Chapter 2.2.1: parameters changed meanwhile apply to the next travel.
    plays(&format!("{under_way}; O; comes-to interrupted; H0400010; M; wait 1000; V>10"));
}

#[test]
fn inching_follows_figure_4() {
    plays("H0800030; Y; comes-to inching; comes-to arrived; Z=1600");
    // The stops of "jederzeit vorzeitig".
    plays("Y; comes-to inching; O; comes-to over; Y; comes-to inching; N; comes-to over");
    for (direction, sign) in [("up", 1), ("down", -1)] {
        // 30 rev/min are 800 increments/s.
        for (setting, braking) in [("T3", 50), ("T4", 100)] {
            let mut rig = Rig::new();
            rig.plays(&format!("H0800030; {setting}; inch {direction}; wait 1000; shows inching; V={}", 30 * sign));
            rig.plays("inch no-more");
            // The last character is valid for 100 ms, in which the drive travels 80 increments.
            let before = rig.position();
            rig.plays("wait 1500; shows over");
            let way = (rig.position() - before) * sign;
            assert!((braking..=braking + 80).contains(&way), "{way}");
        }
    }
    plays("H0800030; inch up; wait 1000; inch down; wait 1000; V=-30");
}

/// A stop remains in force even if characters are still being sent.
#[test]
fn characters_that_go_on_after_a_stop_move_nothing() {
    for stop in ["N", "O"] {
        plays(&format!("inch up; wait 1000; {stop}; wait 5000; V=0; inch no-more; wait 200; inch up; wait 1000; V>0"));
    }
}

#[test]
fn velocity_follows_figure_6() {
    plays("X1; shows standing; Y?04; I?04; inch up; wait 1000; V=0");
    for stop in ["O", "N", "F0+0000000"] {
        let turns = "X1; H0900000; F0+0000068; M; comes-to turning; V=68";
        let otherwise = "F0-0000072; comes-to 00xx 1000 0001 0000; comes-to turning; V=-72";
        plays(&format!("{turns}; {otherwise}; {stop}; comes-to standing; V=0"));
    }
}

/// The edge in both figures from anywhere to "Störung".
#[test]
fn a_fault_is_acknowledged_by_s11103() {
    for mode in ["X0", "X1"] {
        plays(&format!(
            "{mode}; F0+0000050; S11103; sensor fails; shows fault; M?10; Y?10; O?10; S11103?10; J1:E---------;
            sensor works; S11103; shows standing; M"
        ));
    }
}

#[test]
fn the_buffer_has_the_faults_in_their_order() {
    let b = "F0+0900000; M; wait 1000; shaft blocked; comes-to fault; shaft free; S11103";
    let e = "sensor fails; sensor works; S11103";
    // EEPROM: a restart does not empty it.
    plays(&format!(
        "{b}; {e}; {b}; {e}; J0=4; J1:BEBE------; K; wait 1000; J1:BEBE------; S11105; J0=0; J1:----------"
    ));
}

#[test]
fn the_motor_is_in_control_from_the_first_order_until_it_is_released() {
    plays("shows released; enable off; M?11; enable on; shows released; M; shows controlled; P; shows released");
}

#[test]
fn with_a_lag_error_the_stops_release_the_motor() {
    for stop in ["N", "O"] {
        let lags = "F0+0005000; M; attainable 10; comes-to 1xxx xxxx xxxx xxxx";
        plays(&format!("{lags}; {stop}; comes-to 000x 0000 1000 0000"));
    }
}

#[test]
fn a_refusal_has_its_number_in_words() {
    Rig::new().refuses(Command::WriteLong(Long::Setpoint, 1_000_001), ErrorNumber::SETPOINT_BEYOND_LIMIT);
    let words = ErrorNumber::SETPOINT_BEYOND_LIMIT.to_string();
    assert_eq!(words, "error 09: the setpoint is beyond a limit");
    assert!(is(0x2948, "0010 1001 0100 1000"), "the example of figure 1");
}
