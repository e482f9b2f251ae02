//! Bringing the drive to rest.

use lexican_runtime::Instant;
use lexican_runtime::profile::cia402::{Command, State};

use super::observe::{is_inching, moves, state_of};
use crate::context::{Awaited, DriveContext, Motion, Pause};
use crate::description::Still;
use crate::error::{Error, Missing, Refusal};
use crate::mode::Mode;

/// How often a quick stop is sent to a drive that does not obey: few times, since the application must soon hear that
/// the drive does not stop.
const QUICK_STOPS: u32 = 10;

/// Stops all movement with the programmed deceleration, a step by quick stop; returns once the drive stands.
///
/// Errors: [`Error::NotStopped`], and those of SDO transfers.
pub async fn stop(drive: &DriveContext) -> Result<(), Error> {
    come_to_rest(drive).await?;
    stopped(drive);
    Ok(())
}

/// Brakes with full deceleration and drops the travel; the motor keeps its torque, unless the drive is set to release
/// it then (605Ah). [`disable`](super::disable) and [`enable`](super::enable) leave that state.
///
/// Errors: [`Error::Refused`] outside OPERATION ENABLED, where nothing moves; [`Error::NotStopped`].
pub async fn quick_stop(drive: &DriveContext) -> Result<(), Error> {
    let command = Command::QuickStop;
    let stopping = |word| State::from_status_word(word) == Some(State::QuickStopActive);
    let mut left = QUICK_STOPS;
    let moving = drive.may_move();
    drive.lock().stop = Some(drive.description().word(command));
    loop {
        // Sent before the state is read: a drive in another state, or one that has obeyed, ignores it.
        drive.control(drive.description().word(command)).await?;
        left -= 1;
        let Awaited { status_word, came } = drive.await_status(stopping).await?;
        if came {
            break;
        }
        match state_of(status_word)? {
            State::OperationEnabled if left > 0 => {}
            state @ State::OperationEnabled => return Err(Error::NoReaction { state, command }),
            // The drive has obeyed, and has released its motor by itself (605Ah).
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

/// Stops all movement in any mode with the programmed deceleration, but a step by a quick stop, since Stop does not end
/// it.
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

/// Sends a control word that stops the drive, again and again until it stands, in case one gets lost: repeating it
/// changes nothing. Braking may take a minute with the gentlest deceleration.
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
            // The drive may not yet have begun an order of just now: a PDO is not acknowledged.
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

/// Waits until a braking drive stands.
pub(super) async fn brake(drive: &DriveContext) -> Result<(), Error> {
    match come_to_stand(drive, drive.now() + drive.description().times.braking).await? {
        None => Ok(()),
        Some(velocity) => Err(stuck(drive, velocity)),
    }
}

/// Waits until the drive stands, at most until `until`; returns its velocity then, or `None` if it stands.
pub(super) async fn come_to_stand(drive: &DriveContext, until: Instant) -> Result<Option<i32>, Error> {
    loop {
        // Read after the command was sent, so that it includes its effect.
        let moves = moves(drive, drive.status().await?).await?;
        if !moves || drive.now() >= until {
            return Ok(if moves { Some(drive.velocity().await?) } else { None });
        }
        drive.next_status().await?;
    }
}

/// Waits for a drive that has been sent a stop, at most for a reaction time; returns its velocity then, or `None` if it
/// stands.
pub(crate) async fn look_for_standstill(drive: &DriveContext) -> Result<Option<i32>, Error> {
    come_to_stand(drive, drive.reacts_by()).await
}

/// Notes that the drive was stopped and stands. A travel is kept as interrupted, since it resumes with the next control
/// word without Stop.
pub(super) fn stopped(drive: &DriveContext) {
    let mut shared = drive.lock();
    let motion = shared.motion;
    shared.rest();
    if let Motion::Travelling(_) = motion {
        shared.motion = motion.with_pause(Pause::Stopped);
    }
}

/// Writes the set-point at which the drive stands, before a mode in which it obeys the set-point at once.
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

pub(super) fn stuck(drive: &DriveContext, velocity: i32) -> Error {
    Error::NotStopped { velocity, unit: drive.description().status.velocity_unit }
}
