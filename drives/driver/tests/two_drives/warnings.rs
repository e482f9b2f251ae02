//! Warnings, which are not faults; the history of both; and how the driver handles a fault.

use lexican_driver::description::Reaction;
use lexican_driver::{Cause, Code};
use lexican_runtime::Duration;

use crate::servo::{Drive, check};

const HOT: &str = "F235 (4310): excess temperature, heat sink";
const WARM: &str = "n234 (4390): control temperature sensor 1 high";

#[test]
fn a_warning_does_not_hide_a_fault() {
    let script = "
        < 083#1043080000000000
        < 083#9043080000000000
        = 6041:00 02D8            fault, and a warning
    ";
    let (warning, cause) = check(script, |drive| {
        drive.pass(Duration::from_millis(10))?;
        Ok((drive.warning()?, drive.cause()?))
    })
    .unwrap();
    assert_eq!((warning.unwrap().to_string(), cause.to_string()), (WARM.to_owned(), HOT.to_owned()));
}

#[test]
fn a_warning_that_was_not_heard_is_in_the_history() {
    let history = "
        = 1003:00 03
        = 1003:01 00004390
        = 1003:02 00004310
        = 1003:03 00001234
    ";
    let warned = check(&format!("= 6041:00 02C0\n{history}"), Drive::warning).unwrap();
    assert_eq!(warned.unwrap().to_string(), WARM);
    assert_eq!(check("= 6041:00 02C0", Drive::warning).unwrap(), Some(Cause::NoError), "it does not say of what");
    assert_eq!(check(history, Drive::warning).unwrap(), None);
    assert_eq!(check(history, Drive::cause).unwrap().to_string(), HOT);
    let all = check(history, Drive::fault_history).unwrap();
    assert!(
        matches!(all[..], [Cause::Notice(_), Cause::Fault(Code { label: "F235", .. }), Cause::Unknown(0x1234)]),
        "{all:?}"
    );
    check("> 603#2F03100000000000", Drive::clear_fault_history).unwrap();
}

#[test]
fn a_reaction_is_chosen_by_its_option_code() {
    let script = "> 603#2B5E6000FFFF0000";
    let codes = check(script, |drive| {
        let before = drive.reaction(Reaction::Fault)?;
        drive.set_reaction(Reaction::Fault, -1)?;
        Ok((before, drive.reaction(Reaction::Fault)?))
    });
    assert_eq!(codes.unwrap(), (2, -1));
}
