//! Inching operation: single steps, and movement until stopped.

use lexican_runtime::Duration;
use lexican_runtime::profile::cia402::State;

use super::observe::{is_inching, moves, state_of, window};
use super::refusal::{Order, refuse, refuse_at_limit};
use super::standstill::{come_to_rest, stopped};
use super::travel::{end_of_travel, withdraw};
use crate::context::{DriveContext, Motion, narrow};
use crate::description::Inching;
use crate::direction::Direction;
use crate::error::{Capability, Error};
use crate::outcome::Outcome;

/// Travels one step of the set width, and waits for the end.
///
/// A step is ordered by an edge, and only the state machine ends it early: to stop, the driver sends a quick stop.
///
/// Errors: [`Error::Refused`] before anything moves; [`Error::NotTaken`] if the drive does not move.
pub async fn step(drive: &DriveContext, within: Duration) -> Result<Outcome, Error> {
    let inching = drive.need(drive.description().inching, Capability::Inching)?;
    let width = drive.get(inching.width).await?;
    let direction = if width < 0 { Direction::Negative } else { Direction::Positive };
    if width == 0 {
        refuse(drive, Order::Inch(direction)).await?;
        return Ok(Outcome::Reached { position: drive.position().await? });
    }
    begin(drive, inching, Begin { direction, bit: inching.step, width: Some(width) }).await?;
    finish_step(drive, within).await
}

/// Waits for the end of a step. A standstill alone does not show it, since near its begin and end a step is slower than
/// 606Ch shows.
async fn finish_step(drive: &DriveContext, within: Duration) -> Result<Outcome, Error> {
    let (bits, times) = (drive.description().status, drive.description().times);
    let until = drive.now() + within;
    let mut moved = drive.now();
    loop {
        let status_word = drive.status().await?;
        let state = state_of(status_word)?;
        let stands = !moves(drive, status_word).await?;
        if !stands {
            moved = drive.now();
        }
        let rests = stands && drive.now() >= moved + times.reaction;
        let reached = stands && status_word & bits.target_reached != 0 && !is_inching(drive).await?;
        let limited = rests && status_word & bits.internal_limit != 0;
        if (state != State::OperationEnabled || reached || limited)
            && let Some(outcome) = end_of_travel(drive, status_word).await?
        {
            return Ok(outcome);
        }
        if rests {
            // For an unknown reason: it may go on.
            return Ok(Outcome::Interrupted { state, position: drive.position().await? });
        }
        if drive.now() >= until {
            return Ok(Outcome::TimedOut { position: drive.position().await? });
        }
        drive.next_status().await?;
    }
}

/// Moves until [`stop_inching`], or until the drive passes a limit.
///
/// Errors: [`Error::Refused`] before anything moves; [`Error::NotTaken`] if the drive does not move.
pub async fn inch(drive: &DriveContext, direction: Direction) -> Result<(), Error> {
    let inching = drive.need(drive.description().inching, Capability::Inching)?;
    let bit = match direction {
        Direction::Positive => inching.positive,
        Direction::Negative => inching.negative,
    };
    begin(drive, inching, Begin { direction, bit, width: None }).await
}

struct Begin {
    direction: Direction,
    /// The control bit whose edge starts it.
    bit: u16,
    /// How far a step goes.
    width: Option<i64>,
}

async fn begin(drive: &DriveContext, inching: Inching, order: Begin) -> Result<(), Error> {
    refuse(drive, Order::Inch(order.direction)).await?;
    let from = drive.position().await?;
    let was_busy = is_inching(drive).await?;
    let word = drive.description().moving();
    // The order is an edge, and it is refused while Stop is set.
    drive.control(word).await?;
    drive.lock().order(match order.width {
        Some(width) => Motion::Stepping { target: narrow(i64::from(from) + width) },
        None => Motion::Inching,
    });
    drive.unsettle();
    drive.control(word | order.bit).await?;
    let until = drive.reacts_by();
    drive.pass(inching.begins).await?;
    loop {
        let status_word = drive.status().await?;
        // Inching is not acknowledged: only the movement shows it, or a fault.
        if state_of(status_word)? != State::OperationEnabled
            || !was_busy && is_inching(drive).await?
            || has_begun(drive, &order, from).await?
        {
            return Ok(());
        }
        if drive.now() >= until {
            withdraw(drive).await?;
            refuse_at_limit(drive, order.direction).await?;
            return Err(Error::NotTaken { status_word });
        }
        drive.next_status().await?;
    }
}

/// Whether the drive turns in the ordered direction, or has gone farther than a shaft moves while it settles or is
/// turned by hand; or the whole width of the step, if that is less.
async fn has_begun(drive: &DriveContext, order: &Begin, from: i32) -> Result<bool, Error> {
    let forward = if order.direction == Direction::Negative { -1 } else { 1 };
    if i64::from(drive.velocity().await?) * forward > 0 {
        return Ok(true);
    }
    let gone = (i64::from(drive.position().await?) - i64::from(from)) * forward;
    let enough = window(drive).await?.unwrap_or(0).saturating_add(1);
    Ok(gone >= order.width.map_or(enough, |width| enough.min(width.abs())))
}

/// Ends inching, and returns the position of the drive.
pub async fn stop_inching(drive: &DriveContext) -> Result<i32, Error> {
    drive.need(drive.description().inching, Capability::Inching)?;
    // Stop stays set, since its falling edge would resume an interrupted travel, or run at the last velocity.
    come_to_rest(drive).await?;
    stopped(drive);
    drive.position().await
}
