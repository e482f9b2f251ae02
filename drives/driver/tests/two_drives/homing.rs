//! Homing by any method of the description: its end, and the drive's behaviour afterwards.

use lexican_driver::{Error, HomingOutcome};
use lexican_runtime::Duration;
use lexican_runtime::profile::cia402::State;

use crate::script::Rig;
use crate::servo::{BySdo, Drive, SHEET, check};

const START: &str = "
    = 6041:00 0237
    > 603#2F60600006000000    homing mode
    = 6061:00 06
    > 603#2F9860000C000000    method 12
    > 603#2B4060000F000000    the edge begins below
    > 603#2B4060001F000000
    = 606C:00 FFFFE000
    ~ 300
";

const BACK: &str = "
    > 603#2B4060000F000000
    > 603#2F60600001000000
    = 6061:00 01
";

fn home(drive: &mut Drive<BySdo>) -> Result<HomingOutcome, Error> {
    drive.home(12)
}

#[test]
fn it_ends_when_the_drive_stands() {
    let stands = "
        = 6064:00 00000007
        = 606C:00 00000000
    ";
    let attained = format!("{START} = 6041:00 1237 \n ~ 300 {stands} = 6041:00 1637 {BACK}");
    assert_eq!(check(&attained, home).unwrap(), HomingOutcome::Attained { position: 7 });
    let failed = format!("{START} = 6041:00 2237 \n ~ 300 {stands} = 6041:00 2637 {BACK}");
    assert_eq!(check(&failed, home).unwrap(), HomingOutcome::Failed { status_word: 0x2637, position: 7 });
    let stopped = format!("{START} {stands} = 6041:00 0637 \n ~ 300 {BACK}");
    let interrupted = |state| HomingOutcome::Interrupted { state, position: 7 };
    assert_eq!(check(&stopped, home).unwrap(), interrupted(State::OperationEnabled));
    let quick_stop = format!("{START} {stands} = 6041:00 0217 \n > 603#2F60600001000000 \n = 6061:00 01");
    assert_eq!(check(&quick_stop, home).unwrap(), interrupted(State::QuickStopActive));
    let fault = format!("{START} = 1003:01 00008611 \n = 6041:00 0218 \n > 603#2F60600001000000 \n = 6061:00 01");
    let outcome = check(&fault, home).unwrap();
    assert!(matches!(outcome, HomingOutcome::Fault(cause) if cause.to_string() == "F439 (8611): following error"));
}

#[test]
fn a_drive_that_was_in_no_mode_stays_in_homing_mode() {
    let attained = format!(
        "= 6061:00 00 {START} = 6041:00 1237 \n ~ 300 \n = 606C:00 00000000 \n = 6041:00 1637 \n > 603#2B4060000F000000"
    );
    let mut rig = Rig::<BySdo>::new(SHEET);
    assert_eq!(rig.check(&attained, home).unwrap(), HomingOutcome::Attained { position: 0 });
    let travel = rig.check("= 6061:00 00", |drive| drive.move_to(5)).unwrap_err();
    assert_eq!(travel.to_string(), "the drive would refuse: it is in no mode: `set_mode` chooses one");
}

#[test]
fn a_drive_that_is_still_homing_keeps_its_mode_until_it_is_stopped() {
    let mut rig = Rig::<BySdo>::new(SHEET);
    rig.drive.set_patience(Duration::from_secs(2));
    let outcome = rig.check(START, home).unwrap();
    assert!(matches!(outcome, HomingOutcome::TimedOut { .. }), "{outcome:?}");
    let other = rig.check("", |drive| drive.home(35)).unwrap_err();
    assert_eq!(other.to_string(), "the drive would refuse: a travel is under way");
    rig.check("> 603#2B4060000F010000 \n = 606C:00 00000000", Drive::stop).unwrap();
}

#[test]
fn a_drive_that_is_dropped_while_it_homes_is_stopped() {
    let mut rig = Rig::<BySdo>::new(SHEET);
    rig.drive.set_patience(Duration::from_secs(2));
    rig.check(START, home).unwrap();
    rig.follow("> 603#2B4060000F010000");
    rig.check_dropped();
}

#[test]
fn a_method_that_it_does_not_have_is_refused_before_anything_is_sent() {
    Rig::<BySdo>::new(SHEET).check_unsupported("the servo has no homing method 3", |drive| drive.home(3));
}
