//! What the drive reports: its state, its mode, whether a travel is under way.

use lexican_runtime::Measured;
use lexican_runtime::object::DataType;
use lexican_runtime::profile::cia402::State;
use lexican_runtime::service::sdo_client::SdoError;

use crate::context::{DriveContext, Motion, Travel};
use crate::description::Number;
use crate::error::Error;
use crate::fault::Cause;
use crate::mode::Mode;

/// The state of the drive.
pub async fn state(drive: &DriveContext) -> Result<State, Error> {
    state_of(drive.status().await?)
}

pub(super) fn state_of(status_word: u16) -> Result<State, Error> {
    State::from_status_word(status_word).ok_or(Error::UnknownState(status_word))
}

pub(super) fn is_fault(state: State) -> bool {
    matches!(state, State::Fault | State::FaultReactionActive)
}

/// Why the drive is in fault: the last emergency message, or else the latest entry of 1003h.
pub async fn cause(drive: &DriveContext) -> Result<Cause, Error> {
    let codes = drive.description().codes;
    let reported = drive.lock().emergency.map(|code| codes.cause(code));
    if let Some(Cause::Fault(fault)) = reported {
        return Ok(Cause::Fault(fault));
    }
    // The upper 16 bits of an entry are the manufacturer's (CiA 301, 7.5.2.4).
    let latest = known(drive.get(drive.description().objects.latest_fault).await)?;
    let latest = match latest.map_or(Cause::NoError, |latest| codes.cause(latest as u16)) {
        // There is no history, or it is empty.
        Cause::NoError => return Ok(reported.unwrap_or(Cause::NoError)),
        latest => latest,
    };
    if !matches!(latest, Cause::Notice(_)) {
        return Ok(latest);
    }
    // The latest entry is not a fault: the fault is an earlier one.
    let fault = fault_history(drive).await?.into_iter().find(|cause| matches!(cause, Cause::Fault(_)));
    Ok(fault.unwrap_or(latest))
}

/// The faults since the history was cleared, the latest first (1003h).
pub async fn fault_history(drive: &DriveContext) -> Result<Vec<Cause>, Error> {
    let latest = drive.description().objects.latest_fault;
    let mut history = Vec::new();
    for sub in 1..=known(drive.get(fault_count(drive)).await)?.unwrap_or(0) {
        // Some drives have fewer entries than faults counted.
        let Some(entry) = known(drive.get(latest.at_sub(sub as u8)).await)? else { break };
        history.push(drive.description().codes.cause(entry as u16));
    }
    Ok(history)
}

/// 1003h:00.
pub(super) fn fault_count(drive: &DriveContext) -> Number {
    Number::new(drive.description().objects.latest_fault.address().index(), 0x00, DataType::Unsigned8)
}

/// The operating mode; `None` for one that the driver does not know.
pub async fn mode(drive: &DriveContext) -> Result<Option<Mode>, Error> {
    Ok(drive.description().mode_of(shown_mode(drive).await?))
}

/// The number of the operating mode, from the object that shows it.
pub(super) async fn shown_mode(drive: &DriveContext) -> Result<i64, Error> {
    let modes = drive.description().modes;
    let number = drive.get(modes.shown.unwrap_or(modes.chosen)).await?;
    let mut shared = drive.lock();
    shared.seen.mode = i8::try_from(number).ok().map(|mode| Measured::new(mode, shared.now));
    drop(shared);
    Ok(number)
}

/// Whether the drive moves. Its bit may say so only in one mode or above some velocity, so the velocity is read as
/// well.
pub(super) async fn moves(drive: &DriveContext, status_word: u16) -> Result<bool, Error> {
    if let Some(moving) = drive.description().status.moving
        && drive.holds(moving, status_word).await?
    {
        return Ok(true);
    }
    Ok(drive.velocity().await? != 0)
}

/// Whether a travel is under way, moving or interrupted. It is if it has just been ordered, even if the drive still
/// reports the end of the previous one.
pub(super) async fn under_way(drive: &DriveContext, status_word: u16) -> Result<bool, Error> {
    let reported = reports_under_way(drive, status_word).await?;
    let fresh = !drive.settled(reported) && matches!(drive.lock().motion, Motion::Travelling(_));
    Ok(reported || fresh)
}

/// Whether the drive reports that a travel is under way.
///
/// A drive without such a bit is under way until its target is reached, or until it stands at a limit. But during an
/// interruption Target reached means that the drive stands, and before the first travel it means nothing; in these
/// cases the driver goes by its orders.
pub(super) async fn reports_under_way(drive: &DriveContext, status_word: u16) -> Result<bool, Error> {
    let bits = drive.description().status;
    if let Some(positioning) = bits.positioning {
        return drive.holds(positioning, status_word).await;
    }
    let motion = drive.lock().motion;
    if let Motion::Travelling(Travel { queued: true, .. }) = motion
        && status_word & bits.acknowledged != 0
    {
        return Ok(true);
    }
    match motion.pause() {
        None => return Ok(false),
        Some(_) if motion.is_paused() => return Ok(true),
        Some(_) => {}
    }
    if status_word & bits.target_reached != 0 {
        return is_halted(drive).await;
    }
    Ok(status_word & bits.internal_limit == 0 || moves(drive, status_word).await?)
}

/// Whether another manager has stopped the drive: 6040h holds the last control word of any manager.
pub(super) async fn is_halted(drive: &DriveContext) -> Result<bool, Error> {
    let description = drive.description();
    let word = known(drive.get(description.objects.control_word).await)?.unwrap_or(0);
    Ok(word & i64::from(description.control.stop) != 0)
}

/// How far from its target the drive may settle; `None` if it does not say, or the window is off (FFFF FFFFh).
pub(super) async fn window(drive: &DriveContext) -> Result<Option<i64>, Error> {
    let Some(object) = drive.description().objects.position_window else { return Ok(None) };
    Ok(known(drive.get(object).await)?.filter(|window| *window != i64::from(u32::MAX)))
}

/// The value, or `None` if the drive aborts the access, such as of an object that it does not have.
pub(super) fn known<T>(read: Result<T, Error>) -> Result<Option<T>, Error> {
    match read {
        Ok(value) => Ok(Some(value)),
        Err(Error::Sdo(SdoError::Aborted { .. })) => Ok(None),
        Err(error) => Err(error),
    }
}

/// Whether the drive reports that it is inching, or that it takes no other order for another reason. A passed limit may
/// be such a reason, and then only the movement shows inching.
pub(super) async fn is_inching(drive: &DriveContext) -> Result<bool, Error> {
    let Some(busy) = drive.description().inching.and_then(|inching| inching.busy) else { return Ok(false) };
    let status_word = drive.status().await?;
    let limited = status_word & drive.description().status.internal_limit != 0;
    Ok(!limited && drive.holds(busy, status_word).await?)
}
