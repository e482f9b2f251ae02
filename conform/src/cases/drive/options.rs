//! Option codes, which choose how a drive stops.

use lexican_runtime::profile::cia402::{Command, State, control};

use crate::axis::{Axis, ENABLE, Ramp};
use crate::case::{Case, drive};
use crate::tester::Tester;
use crate::verdict::Outcome;

pub(super) const RAMPS: &str = "The option code chooses between the ramp of the profile and that of the quick stop.";

pub(crate) const CASES: &[Case] = &[
    drive("402/605Ah/1", "with each value of 605Ah the drive stops, and is then in the state that it asks for", |t| {
        let mut axis = Axis::of(t)?;
        for code in axis.options(0x605A, 0..=8)? {
            axis.set(0x605A, 0, code)?;
            axis.stops(quick_stop)?;
            let state = if code < 5 { State::SwitchOnDisabled } else { State::QuickStopActive };
            axis.reaches(&[state])?;
            axis.stays(state, &format!("605Ah with {code}"))?;
            axis.bring(State::SwitchOnDisabled)?;
        }
        Ok(())
    })
    .requires("605Ah says how a quick stop brings the drive to rest, and in which state it is then."),
    drive("402/605Ah/2", "a quick stop has the ramp that 605Ah asks for", |t| {
        ramps(
            t,
            0x605A,
            &[(1, Ramp::SlowDown), (2, Ramp::QuickStop), (5, Ramp::SlowDown), (6, Ramp::QuickStop)],
            quick_stop,
        )
    })
    .requires(RAMPS),
    drive("402/605Bh/1", "shutdown stops the drive with each value of 605Bh", |t| {
        leaves(t, 0x605B, 0..=1, Command::Shutdown, State::ReadyToSwitchOn)
    })
    .requires("605Bh says how the drive stops when shutdown takes it out of OPERATION ENABLED."),
    drive("402/605Bh/2", "shutdown has the ramp that 605Bh asks for", |t| {
        ramps(t, 0x605B, &[(1, Ramp::SlowDown)], |axis| axis.order(Command::Shutdown.apply(0)))
    })
    .requires(RAMPS),
    drive("402/605Ch/1", "disable operation stops the drive with each value of 605Ch", |t| {
        leaves(t, 0x605C, 0..=1, Command::SwitchOn, State::SwitchedOn)
    })
    .requires("605Ch says how the drive stops when disable operation takes it out of OPERATION ENABLED."),
    drive("402/605Ch/2", "disable operation has the ramp that 605Ch asks for", |t| {
        ramps(t, 0x605C, &[(1, Ramp::SlowDown)], |axis| axis.order(Command::SwitchOn.apply(0)))
    })
    .requires(RAMPS),
    drive("402/605Dh/1", "halt stops the drive with each value of 605Dh, in OPERATION ENABLED", |t| {
        let mut axis = Axis::of(t)?;
        for code in axis.options(0x605D, 1..=4)? {
            axis.set(0x605D, 0, code)?;
            axis.stops(halt)?;
            axis.stays(State::OperationEnabled, "halt")?;
            axis.bring(State::SwitchOnDisabled)?;
        }
        Ok(())
    })
    .requires("605Dh says how halt stops the drive, which stays in OPERATION ENABLED."),
    drive("402/605Dh/2", "halt has the ramp that 605Dh asks for", |t| {
        ramps(t, 0x605D, &[(1, Ramp::SlowDown), (2, Ramp::QuickStop)], halt)
    })
    .requires(RAMPS),
];

fn quick_stop(axis: &mut Axis<'_, '_>) -> Outcome {
    axis.order(Command::QuickStop.apply(0))
}

fn halt(axis: &mut Axis<'_, '_>) -> Outcome {
    axis.order(ENABLE | control::HALT)
}

/// Checks a command that leaves OPERATION ENABLED while the drive moves.
fn leaves(
    t: &mut Tester<'_>,
    option: u16,
    codes: std::ops::RangeInclusive<i64>,
    command: Command,
    state: State,
) -> Outcome {
    let mut axis = Axis::of(t)?;
    for code in axis.options(option, codes)? {
        axis.set(option, 0, code)?;
        axis.stops(|axis| axis.order(command.apply(0)))?;
        axis.reaches(&[state])?;
        axis.stays(state, &format!("{option:04X}h with {code}"))?;
        axis.bring(State::SwitchOnDisabled)?;
    }
    Ok(())
}

/// Tries the values of an option code that choose a ramp, as far as the drive accepts them.
pub(super) fn ramps(
    t: &mut Tester<'_>,
    option: u16,
    codes: &[(i64, Ramp)],
    mut stop: impl FnMut(&mut Axis<'_, '_>) -> Outcome,
) -> Outcome {
    let mut axis = Axis::of(t)?;
    let taken = axis.options(option, 0..=8)?;
    for (code, ramp) in codes.iter().filter(|(code, _)| taken.contains(code)) {
        axis.set(option, 0, *code)?;
        axis.brakes_with(*ramp, |axis| stop(axis))?;
        axis.bring(State::SwitchOnDisabled)?;
    }
    Ok(())
}
