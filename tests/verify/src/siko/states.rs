//! What the motor does in a state of the state machine, and whether it travels (7.3).

use lexican_runtime::object::{Object, Rw};
use lexican_runtime::profile::cia402::{Cause, State};
use siko::state::{TRANSITIONS, has_torque};

use super::rig::{Rig, Siko, moving_to};
use crate::checker::{Against, Checker};
use crate::kinds::prose::said;
use crate::manual::Row;
use crate::notation::yes;
use crate::rig::once;

/// Compares the columns `motor` and `travel_commands` of `states.csv`.
pub(crate) fn beyond<D: Siko>(checker: &mut Checker<'_>, row: &Row, state: State, rig: Option<Rig<D>>) {
    // The German manual says "released" where the English one says "enabled".
    if state == State::QuickStopActive {
        checker.cell(row, "motor", Against::Drive, once::<D, _>((), quick_stop::<D>));
    } else {
        checker.cell(row, "motor", Against::Code, if has_torque(state) { "in control" } else { "released" });
    }
    let Some(mut rig) = rig else {
        // The drive passes this state while it boots, when it accepts no command.
        let none = TRANSITIONS.0.iter().all(|change| change.from != state || change.cause == Cause::Internal);
        return checker.cell(row, "travel_commands", Against::Code, yes(!none));
    };
    checker.that(row, "motor", Against::Drive, rig.is_released() != has_torque(state), "bit 7 of 1002h");
    let word = rig.see(|drive, _| drive.stored(Object::<u16, Rw>::new(0x6040, 0)));
    rig.command(0x405, word & 0x8F | 0x10, 1000);
    rig.hear(100);
    checker.cell(row, "travel_commands", Against::Drive, yes(rig.status() >> 15 & 1 == 1));
}

/// What the motor does in QUICK STOP ACTIVE.
fn quick_stop<D: Siko>() -> String {
    let mut rig = moving_to::<D>(100_000, 1000);
    rig.control(0x0002);
    // 4 rev/s2 from 800 increments/s.
    let brakes = rig.way_to_rest() == 50;
    said(&vec![("decelerates at maximum", brakes), ("stops with torque", !rig.turn(10))])
}
