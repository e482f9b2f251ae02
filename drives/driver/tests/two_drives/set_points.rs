//! Consecutive set-points: bits 4, 5, 6 and 9 of the control word, bit 12 of the status word.

use lexican_driver::{Error, Outcome, SetPoint};
use lexican_runtime::Duration;

use crate::servo::{ByPdo, Drive, enabled};

const FIRST: &str = "
    @ travel 1000 1237
    = 6041:00 0237
    > 203#0F00
";

#[test]
fn the_last_one_ends_the_travel() {
    let script = format!(
        "{FIRST}
        > 603#237A6000D0070000
        > 203#1F00                2000, after a stop
        = 6041:00 1237            it has no room for another one
        > 203#0F00
        > 203#0F00
        ~ 400
        = 6064:00 000003E8
        = 6041:00 1637            the first one is reached
        ~ 50
        = 6041:00 0237
        > 603#237A6000B80B0000
        > 203#1F02                3000, without a stop (bit 9)
        = 6041:00 1237
        > 203#0F00
        ~ 400
        = 6064:00 000007D0
        = 6041:00 1637
        ~ 50
        = 6041:00 0237
        ~ 400
        = 6064:00 00000BB8
        = 6041:00 0637
    "
    );
    let outcome = enabled::<ByPdo, _>(&script, |drive| {
        drive.start_moving_to(1000)?;
        drive.add_set_point(SetPoint::to(2000))?;
        drive.add_set_point(SetPoint::to(3000).blended())?;
        drive.finish()
    });
    assert_eq!(outcome.unwrap(), Outcome::Reached { position: 3000 });
}

#[test]
fn one_replaces_the_travel_under_way() {
    let script = format!(
        "{FIRST}
        > 603#237A600018FCFFFF
        > 203#7F00                1000 back (bit 6), at once (bit 5)
        = 6041:00 1237
        > 203#0F00
        = 6041:00 0237
        ~ 200
        = 6064:00 FFFFFD00
        = 6041:00 0637
    "
    );
    let outcome = enabled::<ByPdo, _>(&script, |drive| {
        drive.start_moving_to(1000)?;
        drive.add_set_point(SetPoint::by(-1000).at_once())?;
        drive.finish()
    });
    assert_eq!(outcome.unwrap(), Outcome::Reached { position: -0x300 }, "from where it counts, the drive decides");
}

#[test]
fn a_drive_that_stands_takes_one_too() {
    let script = "
        > 203#0F00
        > 603#237A6000E8030000
        > 203#5F00
        = 6041:00 1237
        > 203#0F00
    ";
    enabled::<ByPdo, _>(script, |drive| drive.add_set_point(SetPoint::by(1000))).unwrap();
}

#[test]
fn an_interrupted_travel_is_not_resumed_by_another_set_point() {
    let script = "
        @ travel 1000 1237
        = 6041:00 0237
        > 203#0F01
        > 203#0F01                again, since it might not have begun to move
    ";
    let result = enabled::<ByPdo, _>(script, |drive| {
        drive.start_moving_to(1000)?;
        drive.interrupt()?;
        drive.add_set_point(SetPoint::to(0))
    });
    assert_eq!(result.unwrap_err().to_string(), "the drive would refuse: its travel is interrupted");
}

#[test]
fn what_is_wrong_is_found_before_anything_is_sent() {
    let check = |objects: &str, expected: &str| {
        let result = enabled::<ByPdo, _>(objects, |drive: &mut Drive<ByPdo>| drive.add_set_point(SetPoint::to(2)));
        assert_eq!(result.unwrap_err().to_string(), format!("the drive would refuse: {expected}"));
    };
    check("= 607D:01 FFFFFFFF\n= 607D:02 00000001", "the target 2 is outside its limits, -1 to 1");
    check("= 6061:00 03", "it is in velocity mode");
    check("= 6041:00 0233", "it is in SWITCHED ON, not in OPERATION ENABLED");
}

#[test]
fn one_for_which_there_is_no_room_is_not_sent() {
    let script = format!(
        "{FIRST}
        > 603#237A6000D0070000
        > 203#1F00
        = 6041:00 1237
        > 203#0F00
        > 203#0F00
    "
    );
    let result = enabled::<ByPdo, _>(&script, |drive| {
        drive.set_patience(Duration::from_secs(1));
        drive.start_moving_to(1000)?;
        drive.add_set_point(SetPoint::to(2000))?;
        drive.add_set_point(SetPoint::to(3000))
    });
    let result = result.map_err(Error::into_cause);
    assert!(matches!(result, Err(Error::NotTaken { status_word: 0x1237 })), "{result:?}");
}
