//! What the driver can do, through whichever interface: the tests of the drive's other interfaces run these, too.

use lexican_runtime::service::sdo_client::SdoError;
use siko_ag02::Direction;
use siko_ag02::driver::{Approach, Drive, Error, Missing, Mode, Outcome, Refusal, VelocityOutcome};
use siko_ag02::fault::{self, Cause, FaultKind};
use siko_ag02::od;
use siko_ag02::sim::inputs::Shaft;

use super::bench::Bench;

#[track_caller]
pub(crate) fn is_refused<T: std::fmt::Debug>(result: Result<T, Error>, missing: &[Missing]) {
    match result {
        Err(Error::Refused(Refusal(found))) => assert_eq!(found, missing),
        other => panic!("{other:?}"),
    }
}

/// A velocity is reached within the window of 6067h.
#[track_caller]
pub(crate) fn reaches(result: Result<VelocityOutcome, Error>, target: i32) {
    match result {
        Ok(VelocityOutcome::Reached { velocity }) => assert!((velocity - target).abs() <= 10, "{velocity}"),
        other => panic!("{other:?}"),
    }
}

/// Operates the drive as table 25 of the manual does.
pub(crate) fn table_25(bench: &mut Bench) {
    bench.drive.enable().unwrap();
    assert_eq!(bench.drive.move_to(5000).unwrap(), Outcome::Reached { position: 5000 });
    bench.drive.start_moving_to(-5000).unwrap();
    bench.pass(2000);
    bench.drive.interrupt().unwrap();
    bench.drive.resume().unwrap();
    assert_eq!(bench.drive.finish().unwrap(), Outcome::Reached { position: -5000 });
}

/// Operates the drive as table 26 of the manual does.
pub(crate) fn table_26(bench: &mut Bench) {
    bench.drive.set_mode(Mode::Velocity).unwrap();
    bench.drive.enable().unwrap();
    reaches(bench.drive.run_at(68), 68);
    reaches(bench.drive.run_at(30), 30);
    bench.drive.stop().unwrap();
    reaches(bench.drive.run_at(-72), -72);
    bench.drive.stop().unwrap();
    is_refused(bench.drive.run_at(101), &[Missing::VelocityWithinGear { velocity: 101, most: 100 }]);
}

#[test]
fn the_outcomes_are_those_of_tables_25_and_26() {
    table_25(&mut Bench::new());
    table_26(&mut Bench::new());
}

#[test]
fn limits_are_named_and_end_inching() {
    let mut bench = Bench::new();
    bench.drive.write(od::SOFTWARE_POSITION_LIMIT.limit_1(), od::Position(3000)).unwrap();
    bench.drive.enable().unwrap();
    let beyond = Missing::TargetWithinLimits { target: 3001, low: -1_000_000, high: 3000 };
    is_refused(bench.drive.move_to(3001), &[beyond]);
    assert_eq!(bench.drive.move_to(2000).unwrap(), Outcome::Reached { position: 2000 });
    bench.drive.inch(Direction::Positive).unwrap();
    bench.pass(10_000);
    let at = bench.drive.stop_inching().unwrap();
    assert!((2900..3400).contains(&at), "{at}");
    let refused = bench.drive.inch(Direction::Positive);
    assert!(matches!(refused, Err(Error::Refused(_))), "{refused:?}");
    bench.drive.inch(Direction::Negative).unwrap();
    bench.pass(1000);
    assert!(bench.drive.stop_inching().unwrap() < at);
}

#[test]
fn a_quick_stop_and_a_release_end_a_travel() {
    let mut bench = Bench::new();
    for stop in [Drive::quick_stop, Drive::disable, Drive::stop] {
        bench.drive.enable().unwrap();
        bench.drive.start_moving_to(50_000).unwrap();
        bench.pass(2000);
        stop(&mut bench.drive).unwrap();
        bench.pass(3000);
        let stands = bench.drive.position().unwrap();
        bench.pass(3000);
        assert_eq!((bench.drive.position().unwrap(), bench.drive.velocity().unwrap()), (stands, 0));
        bench.drive.disable().unwrap();
    }
}

#[test]
fn parameters_are_kept_and_refused_as_the_data_sheet_says() {
    let mut bench = Bench::new();
    bench.drive.write(od::MOTOR_PARAMETER_SET.a_pos(), od::Acceleration(75)).unwrap();
    assert_eq!(bench.drive.read(od::MOTOR_PARAMETER_SET.a_pos()).unwrap(), od::Acceleration(75));
    let refused = bench.drive.write(od::SOFTWARE_POSITION_LIMIT.limit_1(), od::Position(-2_000_000));
    assert!(matches!(refused, Err(Error::Sdo(SdoError::Aborted { .. }))), "{refused:?}");
    assert_eq!(bench.drive.fault_history().unwrap(), []);
}

#[test]
fn it_travels_inches_and_is_set_up() {
    let mut bench = Bench::new();
    assert_eq!(bench.drive.firmware().unwrap(), "2.00");
    bench.drive.write(od::MOTOR_PARAMETER_SET.v_pos(), od::Speed(100)).unwrap();
    bench.drive.set_approach(Approach::Negative).unwrap();
    bench.drive.calibrate(100).unwrap();
    bench.drive.enable().unwrap();
    assert_eq!(bench.drive.move_to(1000).unwrap(), Outcome::Reached { position: 1000 });
    assert_eq!(bench.drive.step().unwrap(), Outcome::Reached { position: 2600 });
    bench.drive.inch(Direction::Negative).unwrap();
    bench.pass(500);
    bench.drive.stop_inching().unwrap();
    assert!(bench.drive.position().unwrap() < 2600);
    bench.drive.quick_stop().unwrap();
    bench.drive.disable().unwrap();
    let settings = bench.drive.read_parameters().unwrap();
    bench.drive.write_parameters(&settings).unwrap();
    bench.drive.restore(None).unwrap();
    assert_eq!(bench.drive.read(od::MOTOR_PARAMETER_SET.v_pos()).unwrap(), od::Speed(50));
}

#[test]
fn what_is_missing_is_named() {
    let mut bench = Bench::new();
    bench.drive.enable().unwrap();
    bench.world(|inputs| inputs.limit_switches = [true, true]);
    is_refused(bench.drive.move_to(0), &[Missing::OffLimitSwitch(1), Missing::OffLimitSwitch(2)]);
    bench.world(|inputs| (inputs.limit_switches, inputs.enable) = ([false, false], false));
    is_refused(bench.drive.move_to(0), &[Missing::EnableInput]);
}

#[test]
fn a_limit_switch_ends_a_travel() {
    let mut bench = Bench::new();
    bench.drive.enable().unwrap();
    bench.drive.start_moving_to(20_000).unwrap();
    bench.pass(2000);
    bench.world(|inputs| inputs.limit_switches[0] = true);
    let outcome = bench.drive.finish().unwrap();
    assert!(!matches!(outcome, Outcome::Reached { .. } | Outcome::TimedOut { .. }), "{outcome:?}");
}

#[test]
fn faults_are_named_with_and_without_emergencies() {
    for emergencies in [false, true] {
        for (kind, fault) in [
            (FaultKind::Undervoltage, fault::UNDERVOLTAGE),
            (FaultKind::ShaftBlocked, fault::SHAFT_BLOCKED),
            (FaultKind::Overcurrent, fault::OVERCURRENT),
            (FaultKind::Overtemperature, fault::OVERTEMPERATURE),
            (FaultKind::Sensor, fault::SENSOR),
        ] {
            let mut bench = Bench::new();
            bench.drive.set_emergencies(emergencies).unwrap();
            bench.drive.enable().unwrap();
            bench.drive.start_moving_to(5000).unwrap();
            bench.pass(500);
            bench.world(|inputs| inputs.force(kind));
            assert_eq!(bench.drive.finish().unwrap(), Outcome::Fault(Cause::from(fault)));
            bench.world(|inputs| inputs.clear(kind));
            assert_eq!(bench.drive.reset_fault().unwrap(), Some(Cause::from(fault)));
            // The shaft runs out.
            bench.pass(3000);
            bench.drive.enable().unwrap();
            assert_eq!(bench.drive.move_to(5000).unwrap(), Outcome::Reached { position: 5000 });
        }
    }
}

#[test]
fn a_blocked_shaft_is_fault_b() {
    let mut bench = Bench::new();
    bench.drive.enable().unwrap();
    bench.drive.start_moving_to(5000).unwrap();
    bench.pass(500);
    bench.world(|inputs| inputs.shaft = Shaft::Blocked);
    assert_eq!(bench.drive.finish().unwrap(), Outcome::Fault(Cause::from(fault::SHAFT_BLOCKED)));
}
