//! Figures 4 and 6 of the manual, step by step, by the client over a line of 9600 baud in virtual time.

use super::serial_rig::{Rig, is};
use lexican_driver::Direction;
use lexican_runtime::Duration;
use siko_ag02::sim::inputs::Shaft;
use siko_serial::command::{Command, Long, Mode, Setting, Short, Turning};
use siko_serial::error::ErrorNumber;

#[test]
fn positioning_follows_figure_4() {
    let mut rig = Rig::new();
    assert!(rig.is("000x 0000 x000 x000"), "operation enabled");
    rig.done(Command::WriteLong(Long::Setpoint, 5000));
    rig.done(Command::Start);
    rig.reaches("x1xx 10x0 0001 0000");
    rig.refuses(Command::Start, ErrorNumber::OPERATING_STATE);
    rig.refuses(Command::Step, ErrorNumber::OPERATING_STATE);
    for stop in [Command::Stop, Command::EmergencyStop] {
        rig.done(stop);
        rig.reaches("x10x 00x0 0000 0000");
        rig.done(Command::Start);
        rig.reaches("x1xx 10x0 0001 0000");
    }
    rig.reaches("000x 0000 0000 1000");
    assert_eq!(rig.number(Command::Position), 5000);
    // "akt. Fahrauftrag beenden": from the travel, and from the intermediate stop.
    for stops_first in [false, true] {
        rig.done(Command::WriteLong(Long::Setpoint, 0));
        rig.done(Command::Start);
        rig.reaches("x1xx 10x0 0001 0000");
        if stops_first {
            rig.done(Command::Stop);
            rig.reaches("x10x 00x0 0000 0000");
        }
        rig.done(Command::Abort);
        rig.reaches("000x 0000 0000 x000");
    }
    assert!(rig.number(Command::Position) > 0, "it has not arrived");
}

#[test]
fn an_intermediate_stop_goes_on_to_another_setpoint() {
    let mut rig = Rig::new();
    rig.done(Command::WriteLong(Long::Setpoint, 5000));
    rig.done(Command::Start);
    rig.reaches("x1xx 10x0 0001 0000");
    rig.done(Command::Stop);
    rig.reaches("x10x 00x0 0000 0000");
    rig.done(Command::WriteLong(Long::Setpoint, -100));
    rig.done(Command::Start);
    rig.reaches("000x 0000 0000 1000");
    assert_eq!(rig.number(Command::BinaryPosition), -100);
}

#[test]
fn inching_follows_figure_4() {
    let mut rig = Rig::new();
    rig.done(Command::WriteShort(Short::VJog, 30));
    rig.done(Command::Step);
    rig.reaches("x0xx 1000 0001 0000");
    rig.reaches("000x 0000 0000 1000");
    assert_eq!(rig.number(Command::Position), 1600);
    for (direction, sign) in [(Direction::Positive, 1), (Direction::Negative, -1)] {
        // 30 rev/min are 800 increments/s.
        for (setting, braking) in [(Turning::JogStopsFully, 50), (Turning::JogStopsByRamp, 100)] {
            rig.done(Command::SetTurning(setting));
            rig.drive.start_inching(direction);
            rig.pass(Duration::from_secs(1));
            assert!(rig.is("x0xx 1000 0001 0000"));
            assert_eq!(rig.number(Command::Velocity), 30 * sign);
            rig.drive.stop_inching();
            // The last character counts for 100 ms, in which the drive travels 80 increments.
            let before = rig.position();
            rig.pass(Duration::from_millis(1500));
            let way = (rig.position() - before) * sign;
            assert!((braking..=braking + 80).contains(&way), "{way}");
            assert!(rig.is("000x 0000 0000 x000"));
        }
    }
    // The stops of "jederzeit vorzeitig".
    for stop in [Command::Stop, Command::EmergencyStop] {
        rig.done(Command::Step);
        rig.reaches("x0xx 1000 0001 0000");
        rig.done(stop);
        rig.reaches("000x 0000 0000 x000");
    }
}

/// A stop is not undone by the characters that are still being sent.
#[test]
fn characters_that_go_on_after_a_stop_move_nothing() {
    for stop in [Command::EmergencyStop, Command::Stop] {
        let mut rig = Rig::new();
        rig.drive.start_inching(Direction::Positive);
        rig.pass(Duration::from_secs(1));
        rig.done(stop);
        rig.pass(Duration::from_secs(5));
        assert_eq!(rig.number(Command::Velocity), 0);
        rig.drive.stop_inching();
        rig.pass(Duration::from_millis(200));
        rig.drive.start_inching(Direction::Positive);
        rig.pass(Duration::from_secs(1));
        assert!(rig.number(Command::Velocity) > 0);
    }
}

/// "Eine Aenderung der Reglerparameter waehrend eines Positioniervorganges hat keine Auswirkung" (chapter 2.2.1).
#[test]
fn a_travel_goes_on_with_the_parameters_with_which_it_began() {
    let mut rig = Rig::new();
    rig.done(Command::WriteLong(Long::Setpoint, 5000));
    rig.done(Command::Start);
    rig.reaches("x1xx 10x0 0001 0000");
    rig.done(Command::Stop);
    rig.reaches("x10x 00x0 0000 0000");
    rig.done(Command::WriteShort(Short::VPos, 10));
    rig.done(Command::Start);
    rig.pass(Duration::from_secs(1));
    assert!(rig.number(Command::Velocity) > 10);
}

#[test]
fn characters_of_the_other_direction_stop_before_they_move() {
    let mut rig = Rig::new();
    rig.done(Command::WriteShort(Short::VJog, 30));
    rig.drive.start_inching(Direction::Positive);
    rig.pass(Duration::from_secs(1));
    rig.drive.start_inching(Direction::Negative);
    rig.pass(Duration::from_secs(1));
    assert_eq!(rig.number(Command::Velocity), -30);
}

#[test]
fn velocity_follows_figure_6() {
    let mut rig = Rig::new();
    rig.done(Command::SetMode(Mode::Velocity));
    rig.done(Command::WriteShort(Short::Window, 0));
    assert!(rig.is("00xx 0000 x000 x000"));
    for command in [Command::Step, Command::Abort] {
        rig.refuses(command, ErrorNumber::OPERATING_STATE);
    }
    for stop in [Command::Stop, Command::EmergencyStop, Command::WriteLong(Long::Setpoint, 0)] {
        rig.done(Command::WriteLong(Long::Setpoint, 68));
        rig.done(Command::Start);
        rig.reaches("00xx 1000 0001 1000");
        assert_eq!(rig.number(Command::Velocity), 68);
        rig.done(Command::WriteLong(Long::Setpoint, -72));
        rig.reaches("00xx 1000 0001 0000");
        rig.reaches("00xx 1000 0001 1000");
        assert_eq!(rig.number(Command::Velocity), -72);
        rig.done(stop);
        rig.reaches("00xx 0000 x000 x000");
        assert_eq!(rig.number(Command::Velocity), 0);
    }
    rig.drive.start_inching(Direction::Positive);
    rig.pass(Duration::from_secs(1));
    assert_eq!(rig.number(Command::Velocity), 0);
}

/// The edge of both figures from anywhere to "Störung".
#[test]
fn a_fault_is_acknowledged_by_s11103() {
    for mode in [Mode::Positioning, Mode::Velocity] {
        let mut rig = Rig::new();
        rig.done(Command::SetMode(mode));
        rig.done(Command::WriteLong(Long::Setpoint, 50));
        rig.done(Command::Set(Setting::ResetFault));
        rig.world(|inputs| inputs.sensor_fails = true);
        assert!(rig.is("xxxx xxx1 1xxx xxxx"));
        for command in [Command::Start, Command::Step, Command::Stop, Command::Set(Setting::ResetFault)] {
            rig.refuses(command, ErrorNumber::FAULT);
        }
        assert_eq!(rig.request(Command::Faults), *b"E---------");
        rig.world(|inputs| inputs.sensor_fails = false);
        rig.done(Command::Set(Setting::ResetFault));
        assert!(rig.is("00xx 0000 x000 x000"));
        rig.done(Command::Start);
    }
}

#[test]
fn the_buffer_has_the_faults_in_their_order() {
    let mut rig = Rig::new();
    for _ in 0..2 {
        rig.done(Command::WriteLong(Long::Setpoint, 900_000));
        rig.done(Command::Start);
        rig.pass(Duration::from_secs(1));
        rig.world(|inputs| inputs.shaft = Shaft::Blocked);
        rig.reaches("xxxx xxx1 1xxx xxxx");
        rig.world(|inputs| inputs.shaft = Shaft::Free);
        rig.done(Command::Set(Setting::ResetFault));
        rig.world(|inputs| inputs.sensor_fails = true);
        rig.world(|inputs| inputs.sensor_fails = false);
        rig.done(Command::Set(Setting::ResetFault));
    }
    assert_eq!((rig.number(Command::FaultCount), rig.request(Command::Faults)), (4, *b"BEBE------"));
    // EEPROM: a restart does not empty it.
    rig.done(Command::Restart);
    rig.pass(Duration::from_secs(1));
    assert_eq!(rig.request(Command::Faults), *b"BEBE------");
    rig.done(Command::Set(Setting::ClearFaults));
    assert_eq!((rig.number(Command::FaultCount), rig.request(Command::Faults)), (0, *b"----------"));
}

#[test]
fn the_motor_is_in_control_from_the_first_order_until_it_is_released() {
    let mut rig = Rig::new();
    assert!(rig.is("xxxx xxxx 1xxx xxxx"));
    rig.world(|inputs| inputs.enable = false);
    rig.refuses(Command::Start, ErrorNumber::NOT_ENABLED);
    rig.world(|inputs| inputs.enable = true);
    assert!(rig.is("xxxx xxxx 1xxx xxxx"), "what is refused leaves the motor released");
    rig.done(Command::Start);
    assert!(rig.is("xxxx xxxx 0xxx xxxx"));
    rig.done(Command::Release);
    assert!(rig.is("xxxx xxxx 1xxx xxxx"));
}

#[test]
fn with_a_lag_error_the_stops_release_the_motor() {
    for stop in [Command::Stop, Command::EmergencyStop] {
        let mut rig = Rig::new();
        rig.done(Command::WriteLong(Long::Setpoint, 5000));
        rig.done(Command::Start);
        rig.world(|inputs| inputs.attainable_rpm = Some(10));
        rig.reaches("1xxx xxxx xxxx xxxx");
        rig.done(stop);
        rig.reaches("000x 0000 1000 0000");
    }
}

#[test]
fn a_refusal_has_its_number_in_words() {
    let mut rig = Rig::new();
    rig.refuses(Command::WriteLong(Long::Setpoint, 1_000_001), ErrorNumber::SETPOINT_BEYOND_LIMIT);
    let words = ErrorNumber::SETPOINT_BEYOND_LIMIT.to_string();
    assert_eq!(words, "error 09: the setpoint is beyond a limit");
    assert!(is(0x2948, "0010 1001 0100 1000"), "the example of figure 1");
}
