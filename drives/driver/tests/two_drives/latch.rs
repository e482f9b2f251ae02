//! Positions that inputs latch (touch probe).

use lexican_driver::description::Trigger;
use lexican_driver::{Capability, Error};

use crate::servo::{Drive, check};

const RISING: Trigger = Trigger::Rising(1);

#[test]
fn an_edge_latches_the_position() {
    let script = "
        > 603#2BB8600011000000    input 1, rising edge
        ~ 100
        = 60BA:00 FFFFFC18
        = 60B9:00 0003
    ";
    let latched = check(script, |drive| {
        drive.arm_latch(RISING)?;
        let before = drive.latched(RISING)?;
        drive.pass(lexican_runtime::Duration::from_millis(200))?;
        Ok((before, drive.latched(RISING)?))
    });
    assert_eq!(latched.unwrap(), (None, Some(-1000)));
}

#[test]
fn a_latch_that_is_armed_again_forgets_and_leaves_the_other_edge_armed() {
    let script = "
        = 60B8:00 0031
        = 60B9:00 0003
        > 603#2BB8600021000000
        ~ 200
        = 60B9:00 0001
        > 603#2BB8600031000000
        > 603#2BB8600011000000    the falling edge
    ";
    check(script, |drive| {
        drive.arm_latch(RISING)?;
        drive.disarm_latch(Trigger::Falling(1))
    })
    .unwrap();
    let script = "
        = 60B8:00 0011
        = 60B9:00 0002
        > 603#2BB8600000000000
    ";
    let stale = check(script, |drive| drive.arm_latch(RISING));
    assert!(matches!(stale, Err(Error::NotTaken { status_word: 2 })), "{stale:?}");
}

#[test]
fn a_latch_that_it_does_not_have_is_refused() {
    let result = check("", |drive: &mut Drive<_>| drive.latched(Trigger::Index));
    assert!(matches!(result, Err(Error::Unsupported { what: Capability::Latch(Trigger::Index), .. })), "{result:?}");
}
