//! Bringing the drive to rest, in every way.

use lexican_runtime::Instant;
use lexican_runtime::profile::cia402::{Command, State};

use super::observe::{is_inching, moves, state_of};
use crate::context::{Awaited, DriveContext, Motion, Pause};
use crate::description::Still;
use crate::error::{Error, Missing, Refusal};
use crate::mode::Mode;

/// How often a quick stop is sent to a drive that does not obey: the application must hear soon that there is
/// none.
const QUICK_STOPS: u32 = 10;

/// Stops all that moves with its programmed deceleration, a step by quick stop; returns once the drive stands.
///
/// Errors: [`Error::NotStopped`], and those of an access.
pub async fn stop(drive: &DriveContext) -> Result<(), Error> {
    come_to_rest(drive).await?;
    stopped(drive);
    Ok(())
}

/// Brakes with full deceleration and forgets the travel; the motor keeps its torque, unless the drive is set to release
/// it then (605Ah). [`disable`](super::disable) or [`enable`](super::enable) lead on.
///
/// Errors: [`Error::Refused`] outside OPERATION ENABLED, where nothing is to be stopped; [`Error::NotStopped`].
pub async fn quick_stop(drive: &DriveContext) -> Result<(), Error> {
    let command = Command::QuickStop;
    let stopping = |word| State::from_status_word(word) == Some(State::QuickStopActive);
    let mut left = QUICK_STOPS;
    let moving = drive.may_move();
    drive.lock().stop = Some(drive.description().word(command));
    loop {
        // Before anything is asked: a drive in another state ignores it, and so does one that has obeyed.
        drive.control(drive.description().word(command)).await?;
        left -= 1;
        let Awaited { status_word, came } = drive.await_status(stopping).await?;
        if came {
            break;
        }
        match state_of(status_word)? {
            State::OperationEnabled if left > 0 => {}
            state @ State::OperationEnabled => return Err(Error::NoReaction { state, command }),
            // It has obeyed, and released its motor by itself (605Ah).
            State::SwitchOnDisabled if moving => break,
            state => {
                drive.lock().stop = None;
                return Err(Error::Refused(Refusal(vec![Missing::Enabled(state)])));
            }
        }
    }
    brake(drive).await?;
    at_rest(drive);
    Ok(())
}

/// Stops all that moves, in either mode, with its programmed deceleration; a step by a quick stop, since Stop
/// interrupts travels only.
pub(super) async fn come_to_rest(drive: &DriveContext) -> Result<(), Error> {
    let stepping = matches!(drive.lock().motion, Motion::Stepping { .. });
    if stepping && drive.may_be_stopped().await? {
        let moves = come_to_stand(drive, drive.now()).await?.is_some();
        if moves || is_inching(drive).await? {
            return quick_stop(drive).await;
        }
    }
    stand_still(drive, drive.description().stopping()).await
}

/// Sends a word that stops the drive, until it stands. The word means the same when it comes again, so that
/// one that gets lost is sent again; and braking may take a minute with the gentlest deceleration.
pub(super) async fn stand_still(drive: &DriveContext, word: u16) -> Result<(), Error> {
    let times = drive.description().times;
    let by_pdo = drive.description().outputs.control.is_some();
    let end = drive.now() + times.braking;
    drive.lock().stop = Some(word);
    loop {
        if drive.may_be_stopped().await? {
            drive.control(word).await?;
        }
        match come_to_stand(drive, drive.reacts_by()).await? {
            // It may have been ordered to move only just now, and not have begun: a PDO is not acknowledged.
            None if by_pdo && !drive.has_settled() => drive.settle().await?,
            None => {
                drive.lock().stop = None;
                return Ok(());
            }
            Some(velocity) if drive.now() >= end => return Err(stuck(drive, velocity)),
            Some(_) => {}
        }
    }
}

/// Waits until a drive stands that brakes by itself.
pub(super) async fn brake(drive: &DriveContext) -> Result<(), Error> {
    match come_to_stand(drive, drive.now() + drive.description().times.braking).await? {
        None => Ok(()),
        Some(velocity) => Err(stuck(drive, velocity)),
    }
}

/// Waits until the drive stands, no longer than `until`; how fast it still moves then, or `None` when it stands.
pub(super) async fn come_to_stand(drive: &DriveContext, until: Instant) -> Result<Option<i32>, Error> {
    loop {
        // Read after the command was sent, so that it has had its effect.
        let moves = moves(drive, drive.status().await?).await?;
        if !moves || drive.now() >= until {
            return Ok(if moves { Some(drive.velocity().await?) } else { None });
        }
        drive.next_status().await?;
    }
}

/// Waits for a drive that has been sent a stop, no longer than a reaction takes; how fast it still moves then.
pub(crate) async fn look_for_standstill(drive: &DriveContext) -> Result<Option<i32>, Error> {
    come_to_stand(drive, drive.reacts_by()).await
}

/// The drive has been stopped, and stands. A travel is interrupted then, and goes on with the next word that takes back
/// Stop: so it is not forgotten.
pub(super) fn stopped(drive: &DriveContext) {
    let mut shared = drive.lock();
    let motion = shared.motion;
    shared.rest();
    if let Motion::Travelling(_) = motion {
        shared.motion = motion.with_pause(Pause::Stopped);
    }
}

/// Gives the drive the set-point at which it stands, before a mode in which it obeys the one that is there.
pub(super) async fn hold_still(drive: &DriveContext, mode: Mode) -> Result<(), Error> {
    let Some((set_point, still)) = drive.description().obeyed_unasked(mode) else { return Ok(()) };
    let value = match still {
        Still::Zero => 0,
        Still::Here => drive.position().await?.into(),
    };
    drive.set(set_point, value).await
}

pub(super) fn at_rest(drive: &DriveContext) {
    drive.lock().rest();
}

/// The drive has been sent a stop, and still moves.
pub(super) fn stuck(drive: &DriveContext, velocity: i32) -> Error {
    Error::NotStopped { velocity, unit: drive.description().status.velocity_unit }
}
