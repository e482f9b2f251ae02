//! The state machine: enabling, disabling, faults.

use lexican_runtime::profile::cia402::{Cause as How, Command, State, Transition};
use lexican_runtime::wire::nmt::NmtCommand;

use super::observe::{cause, is_fault, mode, state, state_of};
use super::refusal::require;
use super::standstill::{at_rest, brake, come_to_rest, hold_still};
use crate::context::{Awaited, DriveContext};
use crate::description::Orders;
use crate::error::Error;
use crate::fault::Cause;
use crate::mode::Mode;

/// How many transitions are tried: twice as many as there are states, so that a drive that falls back again and again
/// is not switched on for ever.
const STEPS: u32 = 16;

/// Leads the drive to OPERATION ENABLED, through NMT OPERATIONAL if it takes orders by PDO.
///
/// Errors: [`Error::Refused`], such as without supply; [`Error::Fault`] in FAULT, which [`reset_fault`] leaves;
/// [`Error::NoWay`] if the drive falls back again and again.
pub async fn enable(drive: &DriveContext) -> Result<(), Error> {
    start(drive);
    let remote = drive.description().status.remote;
    let Awaited { status_word, .. } = drive.await_status(|word| word & remote != 0).await?;
    match state_of(status_word)? {
        State::OperationEnabled => {}
        state if is_fault(state) => return Err(Error::Fault(cause(drive).await?)),
        // The drive brakes, and would coast in the states on the way.
        State::QuickStopActive => {
            brake(drive).await?;
            at_rest(drive);
        }
        // In the other states the drive has dropped its travel.
        _ => at_rest(drive),
    }
    require(drive, Orders::ENABLE, status_word).await?;
    let obeys_unasked = Mode::ALL.iter().any(|&mode| drive.description().obeyed_unasked(mode).is_some());
    if obeys_unasked
        && state_of(status_word)? != State::OperationEnabled
        && let Some(mode) = mode(drive).await?
    {
        hold_still(drive, mode).await?;
    }
    reach(drive, State::OperationEnabled).await
}

/// Stops the drive with its programmed deceleration, then releases the motor.
///
/// Errors: [`Error::NoReaction`], [`Error::Fault`].
pub async fn disable(drive: &DriveContext) -> Result<(), Error> {
    match state(drive).await? {
        State::OperationEnabled => come_to_rest(drive).await?,
        // The drive brakes, and would coast if its motor were released.
        State::QuickStopActive => brake(drive).await?,
        _ => {}
    }
    reach(drive, State::SwitchOnDisabled).await?;
    at_rest(drive);
    Ok(())
}

/// Resets a fault, and returns what it was; `None` if there was none.
///
/// Errors: [`Error::Fault`] if the drive stays in FAULT, since the cause persists.
pub async fn reset_fault(drive: &DriveContext) -> Result<Option<Cause>, Error> {
    match state(drive).await? {
        State::Fault => {}
        // The drive goes on to FAULT by itself.
        State::FaultReactionActive => _ = drive.await_status(|word| !is_reaction(word)).await?,
        _ => return Ok(None),
    }
    // A control word by PDO takes effect in NMT OPERATIONAL only.
    start(drive);
    let was = cause(drive).await?;
    let description = drive.description();
    drive.control(description.control.idle).await?;
    drive.control(description.word(Command::FaultReset)).await?;
    let left = drive.await_status(|word| State::from_status_word(word).is_some_and(|state| !is_fault(state))).await?;
    drive.control(description.control.idle).await?;
    if !left.came {
        return Err(Error::Fault(was));
    }
    drive.lock().emergency = None;
    at_rest(drive);
    Ok(Some(was))
}

/// Sends commands until the drive is in `goal`.
pub(super) async fn reach(drive: &DriveContext, goal: State) -> Result<(), Error> {
    let description = drive.description();
    let mut from = state(drive).await?;
    let mut steps = STEPS;
    while from != goal {
        if steps == 0 {
            return Err(Error::NoWay { from, to: goal });
        }
        steps -= 1;
        if from == State::Fault {
            return Err(Error::Fault(cause(drive).await?));
        }
        let next = description.transitions.next(from, goal).ok_or(Error::NoWay { from, to: goal })?;
        let Transition { cause: How::Command(command), .. } = next else {
            // Either the drive changes its state by itself, or no command leads to the goal.
            let Awaited { status_word, came } = drive.await_status(has_left(from)).await?;
            if !came {
                return Err(Error::NoWay { from, to: goal });
            }
            from = state_of(status_word)?;
            continue;
        };
        drive.control(description.word(command)).await?;
        let Awaited { status_word, came } = drive.await_status(has_left(from)).await?;
        if !came {
            return Err(Error::NoReaction { state: from, command });
        }
        from = state_of(status_word)?;
    }
    Ok(())
}

/// Enters NMT OPERATIONAL if the description has PDOs.
pub(super) fn start(drive: &DriveContext) {
    if drive.description().needs_operational() {
        drive.command(NmtCommand::Start);
    }
}

fn has_left(state: State) -> impl Fn(u16) -> bool {
    move |word| State::from_status_word(word) != Some(state)
}

fn is_reaction(status_word: u16) -> bool {
    State::from_status_word(status_word) == Some(State::FaultReactionActive)
}
