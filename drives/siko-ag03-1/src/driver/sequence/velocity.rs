//! Velocity mode.

use lexican_runtime::Duration;

use super::power::{at_rest, cause, state_of};
use super::refusal::{Order, refuse};
use super::travel::come_to_rest;
use crate::driver::desk::Desk;
use crate::driver::error::{Error, VelocityOutcome};
use crate::od;
use crate::state::{Command, State};

/// Runs at a velocity in rev/min, whose sign is the direction; waits until it is reached.
///
/// # Errors
///
/// [`Error::Refused`] or [`Error::OutOfRange`] before anything is sent.
pub async fn run_at(desk: &Desk, velocity: i32, within: Duration) -> Result<VelocityOutcome, Error> {
    refuse(desk, Order::Run { velocity }).await?;
    od::TARGET_VELOCITY.check(od::Velocity(velocity))?;
    let description = desk.description();
    if !desk.lock().running {
        // Running begins with an edge of Stop.
        desk.control(description.word(Command::EnableOperation));
    }
    desk.control_velocity(Command::EnableOperation.apply(0), velocity);
    {
        let mut shared = desk.lock();
        shared.running = true;
        shared.moving = true;
    }
    let until = desk.now() + within;
    let mut status_word = desk.status().await?;
    loop {
        match state_of(status_word)? {
            State::OperationEnabled => {}
            State::Fault => {
                at_rest(desk);
                return Ok(VelocityOutcome::Fault(cause(desk).await?));
            }
            state => {
                at_rest(desk);
                return Ok(VelocityOutcome::Interrupted { state });
            }
        }
        let reached = status_word & description.status.target_reached != 0;
        if reached || desk.now() >= until {
            let velocity = desk.read(od::VELOCITY_ACTUAL_VALUE).await?.0;
            return Ok(if reached {
                VelocityOutcome::Reached { velocity }
            } else {
                VelocityOutcome::TimedOut { velocity }
            });
        }
        status_word = desk.next_status().await?;
    }
}

/// Stops the drive in velocity mode; returns once it stands.
///
/// # Errors
///
/// As [`Desk::read`].
pub async fn stop(desk: &Desk) -> Result<(), Error> {
    come_to_rest(desk).await?;
    at_rest(desk);
    Ok(())
}
