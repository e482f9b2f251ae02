//! No operation that stops, enables or sets up makes a drive of CiA 402 run. In profile velocity mode a drive runs as
//! soon as it is enabled, Halt is clear, and 60FFh is not 0.

use lexican_driver::{Error, Mode};

use crate::servo::{BySdo, Drive, check, enabled};

#[test]
fn a_drive_that_is_enabled_in_velocity_mode_does_not_run_at_its_last_velocity() {
    let script = "
        = 6061:00 03
        > 603#23FF600000000000
        @ enable
    ";
    check(script, Drive::enable).unwrap();
}

#[test]
fn a_drive_that_changes_to_velocity_mode_does_not_run_at_its_last_velocity() {
    let script = "
        > 603#23FF600000000000
        > 603#2F60600003000000
        = 6061:00 03
    ";
    enabled::<BySdo, _>(script, |drive| drive.set_mode(Mode::Velocity)).unwrap();
}

#[test]
fn a_drive_that_changes_to_a_mode_of_positions_stays_where_it_is() {
    for (mode, set_point, code) in
        [(Mode::CyclicPosition, "7A6000", "08"), (Mode::InterpolatedPosition, "C16001", "07")]
    {
        let script = format!(
            "
            = 6064:00 00008CA0
            > 603#23{set_point}A08C0000
            > 603#2F606000{code}000000
            = 6061:00 {code}
        "
        );
        enabled::<BySdo, _>(&script, |drive| drive.set_mode(mode)).unwrap();
    }
    let script = "
        = 6061:00 08
        = 6064:00 00008CA0
        > 603#237A6000A08C0000
        @ enable
    ";
    check(script, Drive::enable).unwrap();
}

#[test]
fn a_drive_that_is_calibrated_in_velocity_mode_does_not_run_at_its_last_velocity_afterwards() {
    let script = "
        = 6061:00 03
        > 603#2F60600006000000
        = 6061:00 06
        > 603#237C600000000000
        > 603#2F98600023000000
        > 603#2B4060000F000000    the edge begins below
        > 603#2B4060001F000000
        = 6041:00 0237
        ~ 100
        = 6041:00 1637
        > 603#2B4060000F000000
        > 603#23FF600000000000
        > 603#2F60600003000000
        = 6061:00 03
    ";
    enabled::<BySdo, _>(script, |drive| drive.calibrate(0)).unwrap();
}

#[test]
fn a_drive_that_brakes_by_quick_stop_keeps_its_motor_until_it_stands() {
    let script = "
        = 6041:00 0217
        = 606C:00 00004100
        ~ 700
        = 606C:00 00000000
        > 603#2B40600000000000    not before
        = 6041:00 0250
    ";
    check(script, Drive::disable).unwrap();
}

#[test]
fn a_drive_that_runs_is_not_set_up() {
    let script = "
        @ run 4100
    ";
    let refused = |operate: fn(&mut Drive<BySdo>) -> Result<(), Error>| {
        let result = enabled::<BySdo, _>(script, |drive| {
            drive.run_at(0x4100)?;
            operate(drive)
        });
        assert_eq!(result.unwrap_err().to_string(), "the drive would refuse: a travel is under way");
    };
    refused(|drive| drive.calibrate(0));
    refused(|drive| drive.set_mode(Mode::Positioning));
}

#[test]
fn a_drive_that_falls_back_again_and_again_is_not_switched_on_without_end() {
    let round = "
        > 603#2B40600007000000
        = 6041:00 0233
        > 603#2B4060000F000000
        = 6041:00 0231
    ";
    let script = format!("= 6041:00 0231 {}", round.repeat(8));
    let result = check(&script, Drive::enable);
    assert_eq!(result.unwrap_err().to_string(), "no command leads from READY TO SWITCH ON to OPERATION ENABLED");
}

#[test]
fn a_quick_stop_after_which_the_drive_releases_its_motor_is_one() {
    let script = "
        @ run 4100
        > 603#2B40600002000000
        = 606C:00 00000000
        = 6041:00 0250
    ";
    enabled::<BySdo, _>(script, |drive| {
        drive.run_at(0x4100)?;
        drive.quick_stop()
    })
    .unwrap();
}

#[test]
fn an_order_does_not_enable_a_drive_that_is_disabled_while_it_is_prepared() {
    let script = "
        = 6041:00 1237            acknowledged long ago
        > 603#2B4060000F000000
        ~ 200
        = 6041:00 0233            another manager
    ";
    let result = enabled::<BySdo, _>(script, |drive| drive.start_moving_to(1000));
    assert_eq!(
        result.unwrap_err().to_string(),
        "the drive would refuse: it is in SWITCHED ON, not in OPERATION ENABLED"
    );
}
