//! The state machine: enabling, disabling, quick stop, faults.

use lexican_runtime::wire::nmt::NmtCommand;

use super::travel::come_to_stand;
use crate::driver::desk::Desk;
use crate::driver::error::{Error, Missing, Refusal};
use crate::fault::Cause;
use crate::od;
use crate::state::{Cause as How, Command, State, Transition};

/// How often a quick stop is sent to a drive that does not obey: whoever wants one must hear soon that there is
/// none.
const QUICK_STOPS: u32 = 10;

/// The state of the drive.
///
/// # Errors
///
/// As [`Desk::read`]; [`Error::UnknownState`].
pub async fn state(desk: &Desk) -> Result<State, Error> {
    state_of(desk.status().await?)
}

pub(super) fn state_of(status_word: u16) -> Result<State, Error> {
    State::from_status_word(status_word).ok_or(Error::UnknownState(status_word))
}

/// Why the drive is in fault: the last emergency, or else the latest entry of 1003h.
///
/// # Errors
///
/// As [`Desk::read`].
pub async fn cause(desk: &Desk) -> Result<Cause, Error> {
    let cause_of = desk.description().cause_of;
    let told = desk.lock().emergency.map(cause_of);
    if let Some(Cause::Fault(fault)) = told {
        return Ok(Cause::Fault(fault));
    }
    match od::PRE_DEFINED_ERROR_FIELD.at(1) {
        Some(latest) => Ok(cause_of(desk.read(latest).await?.0)),
        None => Ok(Cause::Unknown(0)),
    }
}

/// Leads the drive to OPERATION ENABLED, by way of NMT OPERATIONAL.
///
/// # Errors
///
/// [`Error::Refused`] without supply; [`Error::Fault`] in FAULT, which [`reset_fault`] leaves;
/// [`Error::NoReaction`].
pub async fn enable(desk: &Desk) -> Result<(), Error> {
    let description = desk.description();
    desk.command(NmtCommand::Start);
    let status_word = match desk.await_status(|word| word & description.status.remote != 0).await? {
        Ok(word) | Err(word) => word,
    };
    if state_of(status_word)? == State::Fault {
        return Err(Error::Fault(cause(desk).await?));
    }
    let system = desk.read(od::MANUFACTURER_STATUS_REGISTER).await?.0;
    if system & description.system.no_supply != 0 {
        return Err(Error::Refused(Refusal(vec![Missing::Supply])));
    }
    reach(desk, State::OperationEnabled).await
}

/// Stops the drive with its programmed deceleration, then releases the motor.
///
/// # Errors
///
/// [`Error::NoReaction`], [`Error::Fault`].
pub async fn disable(desk: &Desk) -> Result<(), Error> {
    if state(desk).await? == State::OperationEnabled {
        super::travel::come_to_rest(desk).await?;
    }
    reach(desk, State::SwitchOnDisabled).await?;
    at_rest(desk);
    Ok(())
}

/// Brakes with full deceleration and forgets the travel; the motor keeps its torque. [`disable`] or [`enable`]
/// lead on.
///
/// # Errors
///
/// [`Error::Refused`] outside OPERATION ENABLED, where nothing is to be stopped; [`Error::NoReaction`];
/// [`Error::NotStopped`].
pub async fn quick_stop(desk: &Desk) -> Result<(), Error> {
    let command = Command::QuickStop;
    let stopping = |word| State::from_status_word(word) == Some(State::QuickStopActive);
    let mut left = QUICK_STOPS;
    loop {
        // Before anything is asked: a drive in another state ignores it, and so does one that has obeyed.
        desk.control(desk.description().word(command));
        left -= 1;
        let Err(word) = desk.await_status(stopping).await? else { break };
        match state_of(word)? {
            State::OperationEnabled if left > 0 => {}
            state @ State::OperationEnabled => return Err(Error::NoReaction { state, command }),
            state => return Err(Error::Refused(Refusal(vec![Missing::Enabled(state)]))),
        }
    }
    let velocity = come_to_stand(desk, desk.now() + desk.description().braking).await?;
    if velocity != 0 {
        return Err(Error::NotStopped { velocity });
    }
    at_rest(desk);
    Ok(())
}

/// Resets a fault, and says what it was; `None` when there was none.
///
/// # Errors
///
/// [`Error::Fault`] when the drive stays in FAULT, since the cause is still there.
pub async fn reset_fault(desk: &Desk) -> Result<Option<Cause>, Error> {
    if state(desk).await? != State::Fault {
        return Ok(None);
    }
    // The state machine obeys in NMT OPERATIONAL only.
    desk.command(NmtCommand::Start);
    let was = cause(desk).await?;
    let description = desk.description();
    desk.control(description.idle);
    desk.control(description.word(Command::FaultReset));
    let left = desk.await_status(|word| State::from_status_word(word) != Some(State::Fault)).await?;
    desk.control(description.idle);
    if left.is_err() {
        return Err(Error::Fault(was));
    }
    desk.lock().emergency = None;
    at_rest(desk);
    Ok(Some(was))
}

/// Commands the drive from state to state until it is in `goal`.
async fn reach(desk: &Desk, goal: State) -> Result<(), Error> {
    let description = desk.description();
    let mut from = state(desk).await?;
    while from != goal {
        if from == State::Fault {
            return Err(Error::Fault(cause(desk).await?));
        }
        let next = description.transitions.next(from, goal).ok_or(Error::NoWay { from, to: goal })?;
        let Transition { cause: How::Command(command), .. } = next else {
            // The drive goes on by itself, or there is no way.
            let word = desk.await_status(|word| State::from_status_word(word) != Some(from)).await?;
            from = state_of(word.map_err(|_| Error::NoWay { from, to: goal })?)?;
            continue;
        };
        desk.control(description.word(command));
        let word = desk.await_status(|word| State::from_status_word(word) != Some(from)).await?;
        from = state_of(word.map_err(|_| Error::NoReaction { state: from, command })?)?;
    }
    Ok(())
}

pub(super) fn at_rest(desk: &Desk) {
    let mut shared = desk.lock();
    shared.moving = false;
    shared.paused = false;
    shared.running = false;
}
