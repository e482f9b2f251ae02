//! The operations of the driver, over any interface: the tests of the drive's other interfaces run them, too.

use lexican_runtime::service::sdo_client::SdoError;
use siko_ag02::Direction;
use siko_ag02::driver::{Approach, Drive, Error, Missing, Mode, Outcome, Refusal, VelocityOutcome};
use siko_ag02::fault::{self, Cause, FaultKind};
use siko_ag02::od;

use super::rig::Rig;

#[track_caller]
pub(crate) fn is_refused<T: std::fmt::Debug>(result: Result<T, Error>, missing: &[Missing]) {
    match result {
        Err(Error::Refused(Refusal(found))) => assert_eq!(found, missing),
        other => panic!("{other:?}"),
    }
}

/// Checks that a velocity is reached within the window of 6067h.
#[track_caller]
pub(crate) fn reaches(result: Result<VelocityOutcome, Error>, target: i32) {
    match result {
        Ok(VelocityOutcome::Reached { velocity }) => assert!((velocity - target).abs() <= 10, "{velocity}"),
        other => panic!("{other:?}"),
    }
}

/// Operates the drive as table 25 of the manual does.
pub(crate) fn table_25(rig: &mut Rig) {
    rig.drive.enable().unwrap();
    assert_eq!(rig.drive.move_to(5000).unwrap(), Outcome::Reached { position: 5000 });
    rig.drive.start_moving_to(-5000).unwrap();
    rig.pass(2000);
    rig.drive.interrupt().unwrap();
    rig.drive.resume().unwrap();
    assert_eq!(rig.drive.finish().unwrap(), Outcome::Reached { position: -5000 });
}

/// Operates the drive as table 26 of the manual does.
pub(crate) fn table_26(rig: &mut Rig) {
    rig.drive.set_mode(Mode::Velocity).unwrap();
    rig.drive.enable().unwrap();
    reaches(rig.drive.run_at(68), 68);
    reaches(rig.drive.run_at(30), 30);
    rig.drive.stop().unwrap();
    reaches(rig.drive.run_at(-72), -72);
    rig.drive.stop().unwrap();
    is_refused(rig.drive.run_at(101), &[Missing::VelocityWithinGear { velocity: 101, most: 100 }]);
}

#[test]
fn the_outcomes_are_those_of_tables_25_and_26() {
    table_25(&mut Rig::new());
    table_26(&mut Rig::new());
}

#[test]
fn limits_are_named_and_end_inching() {
    let mut rig = Rig::new();
    rig.drive.write(od::SOFTWARE_POSITION_LIMIT.limit_1(), od::Position(3000)).unwrap();
    rig.drive.enable().unwrap();
    let beyond = Missing::TargetWithinLimits { target: 3001, low: -1_000_000, high: 3000 };
    is_refused(rig.drive.move_to(3001), &[beyond]);
    assert_eq!(rig.drive.move_to(2000).unwrap(), Outcome::Reached { position: 2000 });
    rig.drive.inch(Direction::Positive).unwrap();
    rig.pass(10_000);
    let at = rig.drive.stop_inching().unwrap();
    assert!((2900..3400).contains(&at), "{at}");
    let refused = rig.drive.inch(Direction::Positive);
    assert!(matches!(refused, Err(Error::Refused(_))), "{refused:?}");
    rig.drive.inch(Direction::Negative).unwrap();
    rig.pass(1000);
    assert!(rig.drive.stop_inching().unwrap() < at);
}

#[test]
fn a_quick_stop_and_a_release_end_a_travel() {
    let mut rig = Rig::new();
    for stop in [Drive::quick_stop, Drive::disable, Drive::stop] {
        rig.drive.enable().unwrap();
        rig.drive.start_moving_to(50_000).unwrap();
        rig.pass(2000);
        stop(&mut rig.drive).unwrap();
        rig.pass(3000);
        let stands = rig.drive.position().unwrap();
        rig.pass(3000);
        assert_eq!((rig.drive.position().unwrap(), rig.drive.velocity().unwrap()), (stands, 0));
        rig.drive.disable().unwrap();
    }
}

#[test]
fn parameters_are_kept_and_refused_as_the_data_sheet_says() {
    let mut rig = Rig::new();
    rig.drive.write(od::MOTOR_PARAMETER_SET.a_pos(), od::Acceleration(75)).unwrap();
    assert_eq!(rig.drive.read(od::MOTOR_PARAMETER_SET.a_pos()).unwrap(), od::Acceleration(75));
    let refused = rig.drive.write(od::SOFTWARE_POSITION_LIMIT.limit_1(), od::Position(-2_000_000));
    assert!(matches!(refused, Err(Error::Sdo(SdoError::Aborted { .. }))), "{refused:?}");
    assert_eq!(rig.drive.fault_history().unwrap(), []);
}

#[test]
fn it_travels_inches_and_is_set_up() {
    let mut rig = Rig::new();
    assert_eq!(rig.drive.firmware().unwrap(), "2.00");
    rig.drive.write(od::MOTOR_PARAMETER_SET.v_pos(), od::Speed(100)).unwrap();
    rig.drive.set_approach(Approach::Negative).unwrap();
    rig.drive.calibrate(100).unwrap();
    rig.drive.enable().unwrap();
    assert_eq!(rig.drive.move_to(1000).unwrap(), Outcome::Reached { position: 1000 });
    assert_eq!(rig.drive.step().unwrap(), Outcome::Reached { position: 2600 });
    rig.drive.inch(Direction::Negative).unwrap();
    rig.pass(500);
    rig.drive.stop_inching().unwrap();
    assert!(rig.drive.position().unwrap() < 2600);
    rig.drive.quick_stop().unwrap();
    rig.drive.disable().unwrap();
    let settings = rig.drive.read_parameters().unwrap();
    rig.drive.write_parameters(&settings).unwrap();
    rig.drive.restore(None).unwrap();
    assert_eq!(rig.drive.read(od::MOTOR_PARAMETER_SET.v_pos()).unwrap(), od::Speed(50));
}

#[test]
fn what_is_missing_is_named() {
    let mut rig = Rig::new();
    rig.drive.enable().unwrap();
    rig.world(|inputs| inputs.limit_switches = [true, true]);
    is_refused(rig.drive.move_to(0), &[Missing::OffLimitSwitch(1), Missing::OffLimitSwitch(2)]);
    rig.world(|inputs| (inputs.limit_switches, inputs.enable) = ([false, false], false));
    is_refused(rig.drive.move_to(0), &[Missing::EnableInput]);
}

#[test]
fn a_limit_switch_ends_a_travel() {
    let mut rig = Rig::new();
    rig.drive.enable().unwrap();
    rig.drive.start_moving_to(20_000).unwrap();
    rig.pass(2000);
    rig.world(|inputs| inputs.limit_switches[0] = true);
    let outcome = rig.drive.finish().unwrap();
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
            let mut rig = Rig::new();
            rig.drive.set_emergencies(emergencies).unwrap();
            rig.drive.enable().unwrap();
            rig.drive.start_moving_to(5000).unwrap();
            rig.pass(500);
            rig.world(|inputs| inputs.force(kind));
            assert_eq!(rig.drive.finish().unwrap(), Outcome::Fault(Cause::from(fault)));
            rig.world(|inputs| inputs.clear(kind));
            assert_eq!(rig.drive.reset_fault().unwrap(), Some(Cause::from(fault)));
            // The shaft coasts to a standstill.
            rig.pass(3000);
            rig.drive.enable().unwrap();
            assert_eq!(rig.drive.move_to(5000).unwrap(), Outcome::Reached { position: 5000 });
        }
    }
}
