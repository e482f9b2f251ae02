//! Velocity mode.

use lexican_runtime::Duration;
use lexican_runtime::profile::cia402::State;

use super::observe::{cause, is_fault, is_halted, known, state_of};
use super::refusal::{Order, refuse};
use super::standstill::at_rest;
use crate::context::{DriveContext, Motion};
use crate::description::Number;
use crate::error::{Capability, Error};
use crate::mode::Mode;
use crate::outcome::VelocityOutcome;

/// Runs at a velocity, in the unit of 60FFh and with its sign as the direction; waits until it is reached.
pub async fn run_at(drive: &DriveContext, velocity: i32, within: Duration) -> Result<VelocityOutcome, Error> {
    refuse(drive, Order::Run { velocity }).await?;
    let description = drive.description();
    let velocities = drive.need(description.velocity, Capability::Mode(Mode::Velocity))?;
    velocities.target.check(velocity.into())?;
    if drive.lock().motion != Motion::Running || drive.velocity().await? == 0 {
        // Running begins with a falling edge of Stop, also if the drive has stopped by itself; until the new velocity
        // is written, Stop holds the drive.
        drive.control(description.stopping()).await?;
    }
    let until = drive.now() + within;
    if !give(drive, velocities.target, velocity).await? {
        return Ok(VelocityOutcome::Overridden { velocity: drive.velocity().await? });
    }
    let mut status_word = drive.status().await?;
    loop {
        match state_of(status_word)? {
            State::OperationEnabled => {}
            state if is_fault(state) => {
                at_rest(drive);
                return Ok(VelocityOutcome::Fault(cause(drive).await?));
            }
            state => {
                at_rest(drive);
                return Ok(VelocityOutcome::Interrupted { state });
            }
        }
        let reported = drive.holds(velocities.reached, status_word).await?;
        let reached = drive.settled(!reported) && reported;
        let actual = drive.velocity().await?;
        if (reached || actual == 0) && drive.has_settled() && is_overridden(drive, velocities.target, velocity).await? {
            return Ok(VelocityOutcome::Overridden { velocity: actual });
        }
        // The window around a low velocity includes standstill, and the other direction.
        if reached && (velocity == 0 || actual.signum() == velocity.signum()) {
            return Ok(VelocityOutcome::Reached { velocity: actual });
        }
        if drive.now() >= until {
            return Ok(VelocityOutcome::TimedOut { velocity: actual });
        }
        status_word = drive.next_status().await?;
    }
}

/// Orders a velocity, again if the order gets lost; returns `false` if another manager's velocity is in the drive then.
async fn give(drive: &DriveContext, target: Number, velocity: i32) -> Result<bool, Error> {
    let before = known(drive.get(target).await)?;
    let until = drive.reacts_by();
    loop {
        drive.lock().order(Motion::Running);
        drive.unsettle();
        drive.control_velocity(drive.description().moving(), velocity).await?;
        match known(drive.get(target).await)? {
            Some(shown) if shown == i64::from(velocity) => return Ok(true),
            None => return Ok(true),
            shown if shown != before => return Ok(false),
            Some(_) => {}
        }
        let status_word = drive.next_status().await?;
        // In any other state, sending the order again would enable the drive.
        if state_of(status_word)? != State::OperationEnabled {
            return Ok(true);
        }
        if drive.now() >= until {
            return Err(Error::NotTaken { status_word });
        }
    }
}

/// Whether another manager has stopped the drive, or has ordered another velocity.
async fn is_overridden(drive: &DriveContext, target: Number, ordered: i32) -> Result<bool, Error> {
    let target = known(drive.get(target).await)?;
    Ok(target.is_some_and(|target| target != i64::from(ordered)) || is_halted(drive).await?)
}
