//! Velocity mode, and the stop for both modes.

use lexican_runtime::Duration;
use lexican_runtime::profile::cia402::State;

use super::power::{at_rest, cause, is_fault, state_of};
use super::refusal::{Order, refuse};
use super::travel::{come_to_rest, stopped};
use crate::description::Number;
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

/// The velocity that a drive runs at without another order, as soon as it is enabled in velocity mode, or comes into
/// that mode enabled: it has to be 0 by then. None where Stop is set while nothing is to move: there it takes an edge.
pub(super) fn unasked(desk: &Desk) -> Option<Number> {
    let control = desk.description().control;
    desk.description().velocity.filter(|_| control.idle & control.stop == 0).map(|velocities| velocities.target)
}

/// Stops whatever moves with its programmed deceleration, a step by quick stop; returns once the drive stands.
///
/// # Errors
///
/// [`Error::NotStopped`]; as [`Desk::read`].
pub async fn stop(desk: &Desk) -> Result<(), Error> {
    come_to_rest(desk).await?;
    stopped(desk);
    Ok(())
}
