//! Velocity mode.

use lexican_runtime::Duration;
use lexican_runtime::profile::cia402::State;

use super::observe::{cause, is_fault, state_of};
use super::refusal::{Order, refuse};
use super::rest::at_rest;
use crate::desk::Desk;
use crate::error::{Capability, Error, VelocityOutcome};
use crate::mode::Mode;

/// Runs at a velocity, as 60FFh has it, whose sign is the direction; waits until it is reached.
///
/// # Errors
///
/// [`Error::Unsupported`], [`Error::Refused`] or [`Error::OutOfRange`] before anything moves.
pub async fn run_at(desk: &Desk, velocity: i32, within: Duration) -> Result<VelocityOutcome, Error> {
    refuse(desk, Order::Run { velocity }).await?;
    let description = desk.description();
    let velocities = desk.need(description.velocity, Capability::Mode(Mode::Velocity))?;
    velocities.target.check(velocity.into())?;
    let running = desk.lock().running;
    if !running || desk.velocity().await? == 0 {
        // Running begins with a falling edge of Stop, also for a drive that has stopped by itself; and until the new
        // velocity is there, none is to be run at.
        desk.control(description.stopping()).await?;
    }
    {
        let mut shared = desk.lock();
        shared.running = true;
        shared.moving = true;
        shared.travelling = false;
        shared.stepping = false;
    }
    desk.unsettle();
    desk.control_velocity(description.moving(), velocity).await?;
    let until = desk.now() + within;
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
        let told = desk.holds(velocities.reached, status_word).await?;
        let reached = desk.settled(!told) && told;
        if reached || desk.now() >= until {
            let velocity = desk.velocity().await?;
            return Ok(if reached {
                VelocityOutcome::Reached { velocity }
            } else {
                VelocityOutcome::TimedOut { velocity }
            });
        }
        status_word = desk.next_status().await?;
    }
}
