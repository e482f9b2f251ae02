//! Velocity mode.

use lexican_runtime::Duration;
use lexican_runtime::profile::cia402::State;

use super::observe::{cause, is_fault, is_halted, known, state_of};
use super::refusal::{Order, refuse};
use super::rest::at_rest;
use crate::description::Number;
use crate::desk::{Desk, Motion};
use crate::error::{Capability, Error, VelocityOutcome};
use crate::mode::Mode;

/// Runs at a velocity, as 60FFh has it, whose sign is the direction; waits until it is reached.
///
/// # Errors
///
/// [`Error::Unsupported`], [`Error::Refused`] or [`Error::OutOfRange`] before anything moves; [`Error::NotTaken`].
pub async fn run_at(desk: &Desk, velocity: i32, within: Duration) -> Result<VelocityOutcome, Error> {
    refuse(desk, Order::Run { velocity }).await?;
    let description = desk.description();
    let velocities = desk.need(description.velocity, Capability::Mode(Mode::Velocity))?;
    velocities.target.check(velocity.into())?;
    if desk.lock().motion != Motion::Running || desk.velocity().await? == 0 {
        // Running begins with a falling edge of Stop, also for a drive that has stopped by itself; and until the new
        // velocity is there, none is to be run at.
        desk.control(description.stopping()).await?;
    }
    let until = desk.now() + within;
    if !give(desk, velocities.target, velocity).await? {
        return Ok(VelocityOutcome::Overridden { velocity: desk.velocity().await? });
    }
    let mut status_word = desk.status().await?;
    loop {
        match state_of(status_word)? {
            State::OperationEnabled => {}
            state if is_fault(state) => {
                at_rest(desk);
                return Ok(VelocityOutcome::Fault(cause(desk).await?));
            }
            state => {
                at_rest(desk);
                return Ok(VelocityOutcome::Interrupted { state });
            }
        }
        let reported = desk.holds(velocities.reached, status_word).await?;
        let reached = desk.settled(!reported) && reported;
        let actual = desk.velocity().await?;
        if (reached || actual == 0) && desk.has_settled() && is_overridden(desk, velocities.target, velocity).await? {
            return Ok(VelocityOutcome::Overridden { velocity: actual });
        }
        // The window around a low velocity includes standstill, and the other direction.
        if reached && (velocity == 0 || actual.signum() == velocity.signum()) {
            return Ok(VelocityOutcome::Reached { velocity: actual });
        }
        if desk.now() >= until {
            return Ok(VelocityOutcome::TimedOut { velocity: actual });
        }
        status_word = desk.next_status().await?;
    }
}

/// Orders a velocity, again if the order gets lost; `false` if the drive then has that of another manager.
async fn give(desk: &Desk, target: Number, velocity: i32) -> Result<bool, Error> {
    let before = known(desk.get(target).await)?;
    let until = desk.now() + desk.description().times.reaction;
    loop {
        desk.lock().order(Motion::Running);
        desk.unsettle();
        desk.control_velocity(desk.description().moving(), velocity).await?;
        match known(desk.get(target).await)? {
            Some(shown) if shown == velocity.into() => return Ok(true),
            None => return Ok(true),
            shown if shown != before => return Ok(false),
            Some(_) => {}
        }
        let status_word = desk.next_status().await?;
        // The order would enable it.
        if state_of(status_word)? != State::OperationEnabled {
            return Ok(true);
        }
        if desk.now() >= until {
            return Err(Error::NotTaken { status_word });
        }
    }
}

/// Whether another manager has stopped the drive, or has ordered another velocity.
async fn is_overridden(desk: &Desk, target: Number, ordered: i32) -> Result<bool, Error> {
    let target = known(desk.get(target).await)?;
    Ok(target.is_some_and(|target| target != ordered.into()) || is_halted(desk).await?)
}
