//! Bringing the drive to rest, in every way.

use lexican_runtime::Instant;
use lexican_runtime::profile::cia402::{Command, State};

use super::observe::{is_inching, moves, state_of};
use crate::desk::{Awaited, Desk, Motion, Pause};
use crate::error::{Error, Missing, Refusal};

/// How often a quick stop is sent to a drive that does not obey: the application must hear soon that there is
/// none.
const QUICK_STOPS: u32 = 10;

/// Stops all that moves with its programmed deceleration, a step by quick stop; returns once the drive stands.
///
/// # Errors
///
/// [`Error::NotStopped`]; as [`Desk::read`].
pub async fn stop(desk: &Desk) -> Result<(), Error> {
    come_to_rest(desk).await?;
    stopped(desk);
    Ok(())
}

/// Brakes with full deceleration and forgets the travel; the motor keeps its torque, unless the drive is set to release
/// it then (605Ah). [`disable`](super::disable) or [`enable`](super::enable) lead on.
///
/// # Errors
///
/// [`Error::Refused`] outside OPERATION ENABLED, where nothing is to be stopped; [`Error::NoReaction`];
/// [`Error::NotStopped`].
pub async fn quick_stop(desk: &Desk) -> Result<(), Error> {
    let command = Command::QuickStop;
    let stopping = |word| State::from_status_word(word) == Some(State::QuickStopActive);
    let mut left = QUICK_STOPS;
    let moving = desk.may_move();
    desk.lock().stop = Some(desk.description().word(command));
    loop {
        // Before anything is asked: a drive in another state ignores it, and so does one that has obeyed.
        desk.control(desk.description().word(command)).await?;
        left -= 1;
        let Awaited { status_word, came } = desk.await_status(stopping).await?;
        if came {
            break;
        }
        match state_of(status_word)? {
            State::OperationEnabled if left > 0 => {}
            state @ State::OperationEnabled => return Err(Error::NoReaction { state, command }),
            // It has obeyed, and released its motor by itself (605Ah).
            State::SwitchOnDisabled if moving => break,
            state => {
                desk.lock().stop = None;
                return Err(Error::Refused(Refusal(vec![Missing::Enabled(state)])));
            }
        }
    }
    brake(desk).await?;
    at_rest(desk);
    Ok(())
}

/// Stops all that moves, in either mode, with its programmed deceleration; a step by a quick stop, since Stop
/// interrupts travels only.
pub(super) async fn come_to_rest(desk: &Desk) -> Result<(), Error> {
    let stepping = matches!(desk.lock().motion, Motion::Stepping { .. });
    if stepping && desk.may_be_stopped().await? {
        let moves = come_to_stand(desk, desk.now()).await?.is_some();
        if moves || is_inching(desk).await? {
            return quick_stop(desk).await;
        }
    }
    stand_still(desk, desk.description().stopping()).await
}

/// Sends a word that stops the drive, until it stands. The word means the same when it comes again, so that
/// one that gets lost is sent again; and braking may take a minute with the gentlest deceleration.
pub(super) async fn stand_still(desk: &Desk, word: u16) -> Result<(), Error> {
    let times = desk.description().times;
    let by_pdo = desk.description().outputs.control.is_some();
    let end = desk.now() + times.braking;
    desk.lock().stop = Some(word);
    loop {
        if desk.may_be_stopped().await? {
            desk.control(word).await?;
        }
        match come_to_stand(desk, desk.now() + times.reaction).await? {
            // It may have been ordered to move only just now, and not have begun: a PDO is not acknowledged.
            None if by_pdo && !desk.has_settled() => desk.settle().await?,
            None => {
                desk.lock().stop = None;
                return Ok(());
            }
            Some(velocity) if desk.now() >= end => return Err(stuck(desk, velocity)),
            Some(_) => {}
        }
    }
}

/// Waits until a drive stands that brakes by itself.
pub(super) async fn brake(desk: &Desk) -> Result<(), Error> {
    match come_to_stand(desk, desk.now() + desk.description().times.braking).await? {
        None => Ok(()),
        Some(velocity) => Err(stuck(desk, velocity)),
    }
}

/// Waits until the drive stands, no longer than `until`; how fast it still moves then, or `None` when it stands.
pub(super) async fn come_to_stand(desk: &Desk, until: Instant) -> Result<Option<i32>, Error> {
    loop {
        // Read after the command was sent, so that it has had its effect.
        let moves = moves(desk, desk.status().await?).await?;
        if !moves || desk.now() >= until {
            return Ok(if moves { Some(desk.velocity().await?) } else { None });
        }
        desk.next_status().await?;
    }
}

/// Waits for a drive that has been sent a stop, no longer than a reaction takes; how fast it still moves then.
pub(crate) async fn look_for_standstill(desk: &Desk) -> Result<Option<i32>, Error> {
    come_to_stand(desk, desk.now() + desk.description().times.reaction).await
}

/// The drive has been stopped, and stands. A travel is interrupted then, and goes on with the next word that takes back
/// Stop: so it is not forgotten.
pub(super) fn stopped(desk: &Desk) {
    let mut shared = desk.lock();
    let motion = shared.motion;
    shared.rest();
    if let Motion::Travelling(_) = motion {
        shared.motion = motion.with_pause(Pause::Stopped);
    }
}

pub(super) fn at_rest(desk: &Desk) {
    desk.lock().rest();
}

/// The drive has been sent a stop, and still moves.
pub(super) fn stuck(desk: &Desk, velocity: i32) -> Error {
    Error::NotStopped { velocity, unit: desk.description().status.velocity_unit }
}
