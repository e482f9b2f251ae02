//! The state machine: enabling, disabling, quick stop, faults.

use lexican_runtime::profile::cia402::{Cause as How, Command, State, Transition};
use lexican_runtime::service::sdo_client::SdoError;
use lexican_runtime::wire::nmt::NmtCommand;

use super::refusal::require;
use super::setup::mode;
use super::travel::{come_to_rest, come_to_stand};
use super::velocity::unasked;
use crate::description::Orders;
use crate::desk::Desk;
use crate::error::{Error, Missing, Refusal};
use crate::fault::Cause;
use crate::mode::Mode;

/// How often a quick stop is sent to a drive that does not obey: whoever wants one must hear soon that there is
/// none.
const QUICK_STOPS: u32 = 10;

/// Through how many states a drive is led: twice as many as there are. One that falls back again and again is not to be
/// switched on without end.
const STEPS: u32 = 16;

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
    let codes = desk.description().codes;
    let told = desk.lock().emergency.map(|code| codes.cause(code));
    if let Some(Cause::Fault(fault)) = told {
        return Ok(Cause::Fault(fault));
    }
    match desk.get(desk.description().objects.latest_fault).await {
        // The upper half of an entry is the manufacturer's, where there is one (CiA 301, 7.5.2.4).
        Ok(latest) => Ok(codes.cause(latest as u16)),
        // There is no entry.
        Err(Error::Sdo(SdoError::Aborted { .. })) => Ok(Cause::NoError),
        Err(error) => Err(error),
    }
}

/// Leads the drive to OPERATION ENABLED, by way of NMT OPERATIONAL when it takes orders by PDO.
///
/// # Errors
///
/// [`Error::Refused`] without supply, say; [`Error::Fault`] in FAULT, which [`reset_fault`] leaves;
/// [`Error::NoReaction`]; [`Error::NoWay`] when the drive falls back again and again.
pub async fn enable(desk: &Desk) -> Result<(), Error> {
    start(desk);
    let remote = desk.description().status.remote;
    let status_word = match desk.await_status(|word| word & remote != 0).await? {
        Ok(word) | Err(word) => word,
    };
    match state_of(status_word)? {
        State::OperationEnabled => {}
        state if is_fault(state) => return Err(Error::Fault(cause(desk).await?)),
        // It brakes, and the way leads through states in which it would coast.
        State::QuickStopActive => {
            brake(desk).await?;
            at_rest(desk);
        }
        // Whatever was under way, the drive has forgotten it.
        _ => at_rest(desk),
    }
    require(desk, Orders::ENABLE, status_word).await?;
    if let Some(velocity) = unasked(desk)
        && state_of(status_word)? != State::OperationEnabled
        && mode(desk).await? == Some(Mode::Velocity)
    {
        desk.set(velocity, 0).await?;
    }
    reach(desk, State::OperationEnabled).await
}

/// Stops the drive with its programmed deceleration, then releases the motor.
///
/// # Errors
///
/// [`Error::NoReaction`], [`Error::Fault`].
pub async fn disable(desk: &Desk) -> Result<(), Error> {
    match state(desk).await? {
        State::OperationEnabled => come_to_rest(desk).await?,
        // It brakes, and would coast without its motor.
        State::QuickStopActive => brake(desk).await?,
        _ => {}
    }
    reach(desk, State::SwitchOnDisabled).await?;
    at_rest(desk);
    Ok(())
}

/// Brakes with full deceleration and forgets the travel; the motor keeps its torque, unless the drive is set to release
/// it then (605Ah). [`disable`] or [`enable`] lead on.
///
/// # Errors
///
/// [`Error::Refused`] outside OPERATION ENABLED, where nothing is to be stopped; [`Error::NoReaction`];
/// [`Error::NotStopped`].
pub async fn quick_stop(desk: &Desk) -> Result<(), Error> {
    let command = Command::QuickStop;
    let stopping = |word| State::from_status_word(word) == Some(State::QuickStopActive);
    let mut left = QUICK_STOPS;
    let moving = desk.lock().moving;
    loop {
        // Before anything is asked: a drive in another state ignores it, and so does one that has obeyed.
        desk.control(desk.description().word(command)).await?;
        left -= 1;
        let Err(word) = desk.await_status(stopping).await? else { break };
        match state_of(word)? {
            State::OperationEnabled if left > 0 => {}
            state @ State::OperationEnabled => return Err(Error::NoReaction { state, command }),
            // It has obeyed, and released its motor by itself (605Ah).
            State::SwitchOnDisabled if moving => break,
            state => return Err(Error::Refused(Refusal(vec![Missing::Enabled(state)]))),
        }
    }
    brake(desk).await?;
    at_rest(desk);
    Ok(())
}

/// Resets a fault, and says what it was; `None` when there was none.
///
/// # Errors
///
/// [`Error::Fault`] when the drive stays in FAULT, since the cause is still there.
pub async fn reset_fault(desk: &Desk) -> Result<Option<Cause>, Error> {
    match state(desk).await? {
        State::Fault => {}
        // It leads there by itself.
        State::FaultReactionActive => _ = desk.await_status(|word| !is_reaction(word)).await?,
        _ => return Ok(None),
    }
    // A state machine that is steered by PDO obeys in NMT OPERATIONAL only.
    start(desk);
    let was = cause(desk).await?;
    let description = desk.description();
    desk.control(description.control.idle).await?;
    desk.control(description.word(Command::FaultReset)).await?;
    let left = desk.await_status(|word| State::from_status_word(word).is_some_and(|state| !is_fault(state))).await?;
    desk.control(description.control.idle).await?;
    if left.is_err() {
        return Err(Error::Fault(was));
    }
    desk.lock().emergency = None;
    at_rest(desk);
    Ok(Some(was))
}

/// Waits until a drive stands that brakes by itself.
async fn brake(desk: &Desk) -> Result<(), Error> {
    match come_to_stand(desk, desk.now() + desk.description().times.braking).await? {
        None => Ok(()),
        Some(velocity) => Err(stuck(desk, velocity)),
    }
}

/// Commands the drive from state to state until it is in `goal`.
pub(super) async fn reach(desk: &Desk, goal: State) -> Result<(), Error> {
    let description = desk.description();
    let mut from = state(desk).await?;
    let mut steps = STEPS;
    while from != goal {
        if steps == 0 {
            return Err(Error::NoWay { from, to: goal });
        }
        steps -= 1;
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
        desk.control(description.word(command)).await?;
        let word = desk.await_status(|word| State::from_status_word(word) != Some(from)).await?;
        from = state_of(word.map_err(|_| Error::NoReaction { state: from, command })?)?;
    }
    Ok(())
}

/// NMT OPERATIONAL, where there are PDOs.
fn start(desk: &Desk) {
    if desk.description().needs_operational() {
        desk.command(NmtCommand::Start);
    }
}

pub(super) fn is_fault(state: State) -> bool {
    matches!(state, State::Fault | State::FaultReactionActive)
}

fn is_reaction(status_word: u16) -> bool {
    State::from_status_word(status_word) == Some(State::FaultReactionActive)
}

pub(super) fn at_rest(desk: &Desk) {
    desk.lock().rest();
}

/// The drive has been told to stop, and does not.
pub(super) fn stuck(desk: &Desk, velocity: i32) -> Error {
    Error::NotStopped { velocity, unit: desk.description().status.velocity_unit }
}
