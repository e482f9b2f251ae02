//! Figures 4 and 6 of the manual, step by step, by the client over a line of 9600 baud in virtual time.

use super::bench::{Bench, is};
use lexican_driver::Direction;
use lexican_runtime::Duration;
use siko_ag02::sim::inputs::Shaft;
use siko_serial::command::{Command, Long, Mode, Setting, Short, Turning};
use siko_serial::error::ErrorNumber;

#[test]
fn positioning_follows_figure_4() {
    let mut bench = Bench::new();
    assert!(bench.is("000x 0000 x000 x000"), "operation enabled");
    bench.done(Command::WriteLong(Long::Setpoint, 5000));
    bench.done(Command::Start);
    bench.reaches("x1xx 10x0 0001 0000");
    bench.refuses(Command::Start, ErrorNumber::OPERATING_STATE);
    bench.refuses(Command::Step, ErrorNumber::OPERATING_STATE);
    for stop in [Command::Stop, Command::EmergencyStop] {
        bench.done(stop);
        bench.reaches("x10x 00x0 0000 0000");
        bench.done(Command::Start);
        bench.reaches("x1xx 10x0 0001 0000");
    }
    bench.reaches("000x 0000 0000 1000");
    assert_eq!(bench.number(Command::Position), 5000);
    // "akt. Fahrauftrag beenden": from the travel, and from the intermediate stop.
    for stops_first in [false, true] {
        bench.done(Command::WriteLong(Long::Setpoint, 0));
        bench.done(Command::Start);
        bench.reaches("x1xx 10x0 0001 0000");
        if stops_first {
            bench.done(Command::Stop);
            bench.reaches("x10x 00x0 0000 0000");
        }
        bench.done(Command::Abort);
        bench.reaches("000x 0000 0000 x000");
    }
    assert!(bench.number(Command::Position) > 0, "it has not arrived");
}

#[test]
fn an_intermediate_stop_goes_on_to_another_setpoint() {
    let mut bench = Bench::new();
    bench.done(Command::WriteLong(Long::Setpoint, 5000));
    bench.done(Command::Start);
    bench.reaches("x1xx 10x0 0001 0000");
    bench.done(Command::Stop);
    bench.reaches("x10x 00x0 0000 0000");
    bench.done(Command::WriteLong(Long::Setpoint, -100));
    bench.done(Command::Start);
    bench.reaches("000x 0000 0000 1000");
    assert_eq!(bench.number(Command::BinaryPosition), -100);
}

#[test]
fn inching_follows_figure_4() {
    let mut bench = Bench::new();
    bench.done(Command::WriteShort(Short::VJog, 30));
    bench.done(Command::Step);
    bench.reaches("x0xx 1000 0001 0000");
    bench.reaches("000x 0000 0000 1000");
    assert_eq!(bench.number(Command::Position), 1600);
    for (direction, sign) in [(Direction::Positive, 1), (Direction::Negative, -1)] {
        // 30 rev/min are 800 increments/s.
        for (setting, braking) in [(Turning::JogStopsFully, 50), (Turning::JogStopsByRamp, 100)] {
            bench.done(Command::SetTurning(setting));
            bench.drive.start_inching(direction);
            bench.pass(Duration::from_secs(1));
            assert!(bench.is("x0xx 1000 0001 0000"));
            assert_eq!(bench.number(Command::Velocity), 30 * sign);
            bench.drive.stop_inching();
            // The last character counts for 100 ms, in which the drive travels 80 increments.
            let before = bench.position();
            bench.pass(Duration::from_millis(1500));
            let way = (bench.position() - before) * sign;
            assert!((braking..=braking + 80).contains(&way), "{way}");
            assert!(bench.is("000x 0000 0000 x000"));
        }
    }
    // The stops of "jederzeit vorzeitig".
    for stop in [Command::Stop, Command::EmergencyStop] {
        bench.done(Command::Step);
        bench.reaches("x0xx 1000 0001 0000");
        bench.done(stop);
        bench.reaches("000x 0000 0000 x000");
    }
}

/// A stop is not undone by the characters that are still being sent.
#[test]
fn characters_that_go_on_after_a_stop_move_nothing() {
    for stop in [Command::EmergencyStop, Command::Stop] {
        let mut bench = Bench::new();
        bench.drive.start_inching(Direction::Positive);
        bench.pass(Duration::from_secs(1));
        bench.done(stop);
        bench.pass(Duration::from_secs(5));
        assert_eq!(bench.number(Command::Velocity), 0);
        bench.drive.stop_inching();
        bench.pass(Duration::from_millis(200));
        bench.drive.start_inching(Direction::Positive);
        bench.pass(Duration::from_secs(1));
        assert!(bench.number(Command::Velocity) > 0);
    }
}

/// "Eine Aenderung der Reglerparameter waehrend eines Positioniervorganges hat keine Auswirkung" (chapter 2.2.1).
#[test]
fn a_travel_goes_on_with_the_parameters_with_which_it_began() {
    let mut bench = Bench::new();
    bench.done(Command::WriteLong(Long::Setpoint, 5000));
    bench.done(Command::Start);
    bench.reaches("x1xx 10x0 0001 0000");
    bench.done(Command::Stop);
    bench.reaches("x10x 00x0 0000 0000");
    bench.done(Command::WriteShort(Short::VPos, 10));
    bench.done(Command::Start);
    bench.pass(Duration::from_secs(1));
    assert!(bench.number(Command::Velocity) > 10);
}

#[test]
fn characters_of_the_other_direction_stop_before_they_move() {
    let mut bench = Bench::new();
    bench.done(Command::WriteShort(Short::VJog, 30));
    bench.drive.start_inching(Direction::Positive);
    bench.pass(Duration::from_secs(1));
    bench.drive.start_inching(Direction::Negative);
    bench.pass(Duration::from_secs(1));
    assert_eq!(bench.number(Command::Velocity), -30);
}

#[test]
fn velocity_follows_figure_6() {
    let mut bench = Bench::new();
    bench.done(Command::SetMode(Mode::Velocity));
    bench.done(Command::WriteShort(Short::Window, 0));
    assert!(bench.is("00xx 0000 x000 x000"));
    for command in [Command::Step, Command::Abort] {
        bench.refuses(command, ErrorNumber::OPERATING_STATE);
    }
    for stop in [Command::Stop, Command::EmergencyStop, Command::WriteLong(Long::Setpoint, 0)] {
        bench.done(Command::WriteLong(Long::Setpoint, 68));
        bench.done(Command::Start);
        bench.reaches("00xx 1000 0001 1000");
        assert_eq!(bench.number(Command::Velocity), 68);
        bench.done(Command::WriteLong(Long::Setpoint, -72));
        bench.reaches("00xx 1000 0001 0000");
        bench.reaches("00xx 1000 0001 1000");
        assert_eq!(bench.number(Command::Velocity), -72);
        bench.done(stop);
        bench.reaches("00xx 0000 x000 x000");
        assert_eq!(bench.number(Command::Velocity), 0);
    }
    bench.drive.start_inching(Direction::Positive);
    bench.pass(Duration::from_secs(1));
    assert_eq!(bench.number(Command::Velocity), 0);
}

/// The edge of both figures from anywhere to "Störung".
#[test]
fn a_fault_is_acknowledged_by_s11103() {
    for mode in [Mode::Positioning, Mode::Velocity] {
        let mut bench = Bench::new();
        bench.done(Command::SetMode(mode));
        bench.done(Command::WriteLong(Long::Setpoint, 50));
        bench.done(Command::Set(Setting::ResetFault));
        bench.world(|inputs| inputs.sensor_fails = true);
        assert!(bench.is("xxxx xxx1 1xxx xxxx"));
        for command in [Command::Start, Command::Step, Command::Stop, Command::Set(Setting::ResetFault)] {
            bench.refuses(command, ErrorNumber::FAULT);
        }
        assert_eq!(bench.request(Command::Faults), *b"E---------");
        bench.world(|inputs| inputs.sensor_fails = false);
        bench.done(Command::Set(Setting::ResetFault));
        assert!(bench.is("00xx 0000 x000 x000"));
        bench.done(Command::Start);
    }
}

#[test]
fn the_buffer_has_the_faults_in_their_order() {
    let mut bench = Bench::new();
    for _ in 0..2 {
        bench.done(Command::WriteLong(Long::Setpoint, 900_000));
        bench.done(Command::Start);
        bench.pass(Duration::from_secs(1));
        bench.world(|inputs| inputs.shaft = Shaft::Blocked);
        bench.reaches("xxxx xxx1 1xxx xxxx");
        bench.world(|inputs| inputs.shaft = Shaft::Free);
        bench.done(Command::Set(Setting::ResetFault));
        bench.world(|inputs| inputs.sensor_fails = true);
        bench.world(|inputs| inputs.sensor_fails = false);
        bench.done(Command::Set(Setting::ResetFault));
    }
    assert_eq!((bench.number(Command::FaultCount), bench.request(Command::Faults)), (4, *b"BEBE------"));
    // EEPROM: a restart does not empty it.
    bench.done(Command::Restart);
    bench.pass(Duration::from_secs(1));
    assert_eq!(bench.request(Command::Faults), *b"BEBE------");
    bench.done(Command::Set(Setting::ClearFaults));
    assert_eq!((bench.number(Command::FaultCount), bench.request(Command::Faults)), (0, *b"----------"));
}

#[test]
fn the_motor_is_in_control_from_the_first_order_until_it_is_released() {
    let mut bench = Bench::new();
    assert!(bench.is("xxxx xxxx 1xxx xxxx"));
    bench.world(|inputs| inputs.enable = false);
    bench.refuses(Command::Start, ErrorNumber::NOT_ENABLED);
    bench.world(|inputs| inputs.enable = true);
    assert!(bench.is("xxxx xxxx 1xxx xxxx"), "what is refused leaves the motor released");
    bench.done(Command::Start);
    assert!(bench.is("xxxx xxxx 0xxx xxxx"));
    bench.done(Command::Release);
    assert!(bench.is("xxxx xxxx 1xxx xxxx"));
}

#[test]
fn with_a_lag_error_the_stops_release_the_motor() {
    for stop in [Command::Stop, Command::EmergencyStop] {
        let mut bench = Bench::new();
        bench.done(Command::WriteLong(Long::Setpoint, 5000));
        bench.done(Command::Start);
        bench.world(|inputs| inputs.attainable_rpm = Some(10));
        bench.reaches("1xxx xxxx xxxx xxxx");
        bench.done(stop);
        bench.reaches("000x 0000 1000 0000");
    }
}

#[test]
fn a_refusal_has_its_number_in_words() {
    let mut bench = Bench::new();
    bench.refuses(Command::WriteLong(Long::Setpoint, 1_000_001), ErrorNumber::SETPOINT_BEYOND_LIMIT);
    let words = ErrorNumber::SETPOINT_BEYOND_LIMIT.to_string();
    assert_eq!(words, "error 09: the setpoint is beyond a limit");
    assert!(is(0x2948, "0010 1001 0100 1000"), "the example of figure 1");
}
