//! Homing: to a switch, a limit or an index pulse, or on the present position.

use lexican_runtime::profile::cia402::State;
use lexican_runtime::{Duration, Instant};

use super::observe::{cause, is_fault, moves, shown_mode, state_of};
use super::refusal::{require, require_enabled, require_rest};
use super::setup::choose;
use super::standstill::at_rest;
use crate::context::{DriveContext, Motion};
use crate::description::{Calibration, Homing, Orders};
use crate::error::{Capability, Error};
use crate::mode::Mode;
use crate::outcome::HomingOutcome;

/// Homes by a method of 6098h, and waits for the end; then returns to the former mode, unless there was none (0 in
/// 6061h) or the drive is still under way.
///
/// Errors: [`Error::Unsupported`] before anything is sent, also if the drive does not have the method;
/// [`Error::Refused`] before anything moves.
pub async fn home(drive: &DriveContext, method: i8, within: Duration) -> Result<HomingOutcome, Error> {
    let homing = drive.need(drive.description().homing, Capability::Mode(Mode::Homing))?;
    let has_method = homing.methods.contains(&method).then_some(());
    drive.need(has_method, Capability::HomingMethod(method))?;
    go_through(drive, Start { homing, method, offset: None }, within).await
}

/// Makes `position` the actual position.
///
/// Errors: [`Error::Refused`] while a travel is under way, and outside OPERATION ENABLED if it is done by homing;
/// [`Error::Sdo`] if the position is outside the limits.
pub async fn calibrate(drive: &DriveContext, position: i32) -> Result<(), Error> {
    let method = match drive.need(drive.description().calibration, Capability::Calibration)? {
        Calibration::Write(object) => {
            require_rest(drive).await?;
            return drive.set(object, position.into()).await;
        }
        Calibration::Homing(method) => method,
    };
    let homing = drive.need(drive.description().homing, Capability::Calibration)?;
    let start = Start { homing, method, offset: Some(position) };
    match go_through(drive, start, drive.description().times.reaction).await? {
        HomingOutcome::Attained { .. } => Ok(()),
        HomingOutcome::Fault(cause) => Err(Error::Fault(cause)),
        _ => Err(Error::NotCalibrated { status_word: drive.status().await? }),
    }
}

struct Start {
    homing: Homing,
    method: i8,
    /// The position of the reference point (607Ch); `None` to leave it unchanged.
    offset: Option<i32>,
}

/// Changes to homing mode, homes, and changes back.
async fn go_through(drive: &DriveContext, start: Start, within: Duration) -> Result<HomingOutcome, Error> {
    let code = drive.need(drive.description().code_of(Mode::Homing), Capability::Mode(Mode::Homing))?;
    require_rest(drive).await?;
    let status_word = drive.status().await?;
    require_enabled(drive, status_word).await?;
    require(drive, Orders::HOME, status_word).await?;
    let before = shown_mode(drive).await?;
    choose(drive, code).await?;
    let ended = run(drive, start, within).await;
    if drive.may_move() {
        // The mode of a moving drive is not changed.
        return ended;
    }
    if drive.may_be_stopped().await? {
        drive.control(drive.description().resting()).await?;
    }
    // 0 orders no mode (CiA 402-2, 6060h).
    if let Some(before) = i8::try_from(before).ok().filter(|&before| before != 0) {
        choose(drive, before).await?;
    }
    ended
}

async fn run(drive: &DriveContext, start: Start, within: Duration) -> Result<HomingOutcome, Error> {
    let Start { homing, method, offset } = start;
    if let Some(offset) = offset {
        drive.set(homing.offset, offset.into()).await?;
    }
    drive.set(homing.method, method.into()).await?;
    // The start bit takes effect by its edge.
    drive.control(drive.description().resting()).await?;
    drive.lock().order(Motion::Homing);
    drive.unsettle();
    drive.control(drive.description().moving() | homing.start).await?;
    let until = drive.now() + within;
    let mut stood = Stood { since: drive.now() };
    let mut status_word = drive.status().await?;
    loop {
        let stands = stood.look(drive, status_word).await?;
        if let Some(outcome) = end(drive, homing, status_word, stands).await? {
            at_rest(drive);
            return Ok(outcome);
        }
        if drive.now() >= until {
            return Ok(HomingOutcome::TimedOut { position: drive.position().await? });
        }
        status_word = drive.next_status().await?;
    }
}

struct Stood {
    since: Instant,
}

impl Stood {
    /// For how long the drive stands; `None` while it moves.
    async fn look(&mut self, drive: &DriveContext, status_word: u16) -> Result<Option<Duration>, Error> {
        if moves(drive, status_word).await? {
            self.since = drive.now();
            return Ok(None);
        }
        Ok(Some(drive.now().since(self.since)))
    }
}

/// How homing has ended; `None` while it has not. The mode must not be changed before the drive stands.
async fn end(
    drive: &DriveContext,
    homing: Homing,
    status_word: u16,
    stands: Option<Duration>,
) -> Result<Option<HomingOutcome>, Error> {
    let description = drive.description();
    let state = state_of(status_word)?;
    if is_fault(state) {
        return Ok(Some(HomingOutcome::Fault(cause(drive).await?)));
    }
    let position = drive.position().await?;
    if state != State::OperationEnabled {
        return Ok(Some(HomingOutcome::Interrupted { state, position }));
    }
    let ended = status_word & (homing.attained | homing.error);
    let Some(stood) = stands else { return Ok(None) };
    if drive.settled(ended == 0) && ended != 0 {
        return Ok(Some(match ended == homing.attained {
            true => HomingOutcome::Attained { position },
            false => HomingOutcome::Failed { status_word, position },
        }));
    }
    // Stopped by something else, such as another manager (CiA 402-2, 10.3: "interrupted or not started"). A drive may
    // briefly report the same before homing is attained, so it has to last.
    let stopped = status_word & description.status.target_reached != 0 && stood >= description.times.reaction;
    Ok(stopped.then_some(HomingOutcome::Interrupted { state, position }))
}
