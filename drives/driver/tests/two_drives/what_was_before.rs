//! For a moment after an order, bits of the status word may still show the former state: target reached, homing
//! attained. The driver does not take them for the end of the new motion.

use lexican_driver::{Cause, Code, Error, Outcome, VelocityOutcome};
use lexican_runtime::Duration;
use lexican_runtime::host::Fate;
use lexican_runtime::profile::cia402::State;

use crate::script::Rig;
use crate::servo::{ByPdo, BySdo, SHEET, enabled};

const TRAVEL: &str = "
    @ travel 36000 1637    acknowledged, and the target before is still reached
";

#[test]
fn a_target_that_was_reached_before_is_not_the_end_of_a_travel() {
    let script = format!(
        "{TRAVEL}
        = 6041:00 0637
        ~ 60
        = 6041:00 0237
        ~ 400
        = 6064:00 8CA0
        = 6041:00 0637
    "
    );
    let outcome = enabled::<ByPdo, _>(&script, |drive| drive.move_to(36_000)).unwrap();
    assert_eq!(outcome, Outcome::Reached { position: 36_000 });
}

#[test]
fn a_travel_to_where_the_drive_is_ends_although_nothing_changes() {
    let script = format!("= 6064:00 8CA0\n{TRAVEL}");
    let outcome = enabled::<ByPdo, _>(&script, |drive| drive.move_to(36_000)).unwrap();
    assert_eq!(outcome, Outcome::Reached { position: 36_000 });
}

#[test]
fn a_limit_that_was_active_before_is_not_the_end_of_the_way_back() {
    let script = "
        = 6041:00 0A37
        @ travel 0 1A37    not yet moving
        ~ 50
        = 606C:00 FFFFF000
        ~ 100
        = 6041:00 0237
        ~ 100
        = 606C:00 00000000
        = 6041:00 0637
    ";
    let outcome = enabled::<ByPdo, _>(script, |drive| drive.move_to(0)).unwrap();
    assert_eq!(outcome, Outcome::Reached { position: 0 });
}

#[test]
fn a_travel_that_has_only_just_begun_can_be_interrupted() {
    let script = format!(
        "{TRAVEL}
        = 606C:00 00001000
        > 203#0F01
        = 606C:00 00000000
        > 203#0F01            again, since it might not have begun to move
    "
    );
    enabled::<ByPdo, _>(&script, |drive| {
        drive.start_moving_to(36_000)?;
        drive.interrupt()
    })
    .unwrap();
}

#[test]
fn an_interrupted_travel_that_cannot_be_resumed_is_not_over() {
    let script = format!(
        "{TRAVEL}
        = 6041:00 0237
        = 606C:00 00001000
        > 203#0F01
        = 606C:00 00000000
        > 203#0F01            again, since it might not have begun to move
        = 6041:00 0637            it stands
    "
    );
    let mut rig = Rig::<ByPdo>::new(SHEET);
    rig.follow(&format!("= 6041:00 0237\n{script}"));
    rig.drive.start_moving_to(36_000).unwrap();
    rig.drive.interrupt().unwrap();
    rig.bus.set_fate(|_, _| Fate::Lose);
    assert!(matches!(rig.drive.resume().map_err(Error::into_cause), Err(Error::Sdo(_))));
    rig.bus.set_fate(|_, _| Fate::Deliver);
    rig.drive.set_patience(Duration::from_secs(1));
    let outcome = rig.drive.finish().unwrap();
    assert!(matches!(outcome, Outcome::TimedOut { .. }), "{outcome:?}");
    rig.check_through("an interrupted travel");
}

#[test]
fn a_velocity_that_was_reached_before_is_not_the_end_of_another_one() {
    let script = "
        @ run 4100
        > 603#23FF600000200000
        > 603#2B4060000F000000
        ~ 60
        = 1002:00 20000000
        ~ 400
        = 606C:00 00002000
        = 1002:00 20000200
    ";
    let outcomes = enabled::<BySdo, _>(script, |drive| Ok([drive.run_at(0x4100)?, drive.run_at(0x2000)?]));
    assert_eq!(outcomes.unwrap(), [0x4100, 0x2000].map(|velocity| VelocityOutcome::Reached { velocity }));
}

#[test]
fn homing_that_was_attained_before_is_not_the_end_of_another_one() {
    let script = "
        > 603#2F60600006000000
        = 6061:00 06
        > 603#237C6000A8610000
        > 603#2F98600023000000
        > 603#2B4060000F000000
        = 6041:00 1237
        > 603#2B4060001F000000
        ~ 60
        = 6041:00 0237
        ~ 100
        = 6041:00 2237            it fails this time
        > 603#2B4060000F000000
        > 603#2F60600001000000
        = 6061:00 01
    ";
    let failed = enabled::<BySdo, _>(script, |drive| drive.calibrate(25_000));
    assert!(matches!(failed, Err(Error::NotCalibrated { status_word: 0x2237 })), "{failed:?}");
}

#[test]
fn a_drive_that_stands_after_a_quick_stop_has_not_reached_its_target() {
    let script = format!(
        "{TRAVEL}
        = 6041:00 0237
        ~ 300
        = 6064:00 1000
        = 6041:00 0617            somebody else; it stands
    "
    );
    let outcome = enabled::<ByPdo, _>(&script, |drive| drive.move_to(36_000)).unwrap();
    assert_eq!(outcome, Outcome::Interrupted { state: State::QuickStopActive, position: 0x1000 });
}

#[test]
fn a_fault_does_not_outlive_a_restart() {
    let script = "
        < 083#1043080100000000
        < 703#00
        = 1003:01 00008611
    ";
    let cause = enabled::<BySdo, _>(script, |drive| {
        let _ = drive.pass(Duration::from_millis(10));
        drive.cause()
    });
    assert!(matches!(cause, Ok(Cause::Fault(Code { label: "F439", .. }))), "{cause:?}");
}

/// The driver still knows that the drive runs after waiting for a travel that does not exist.
#[test]
fn velocity_mode_does_not_end_with_a_travel() {
    let script = "
        @ run 4100
        > 603#2B4060000F010000    the driver is dropped
    ";
    let mut rig = Rig::<BySdo>::new(SHEET);
    rig.follow(&format!("= 6041:00 0237\n{script}"));
    rig.drive.run_at(0x4100).unwrap();
    rig.drive.finish().unwrap();
    rig.check_dropped();
}
