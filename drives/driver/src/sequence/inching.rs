//! Inching operation: single steps, and moving while told to.

use lexican_runtime::Duration;
use lexican_runtime::profile::cia402::State;

use super::power::{at_rest, state_of};
use super::refusal::{Order, refuse};
use super::travel::{come_to_rest, end_of_travel, moves, withdraw};
use crate::description::Inching;
use crate::desk::Desk;
use crate::direction::Direction;
use crate::error::{Capability, Error, Outcome};

/// A step of the width that the drive is set to, and waits for the end.
///
/// # Errors
///
/// [`Error::Unsupported`] before anything is sent; [`Error::Refused`] before anything moves; [`Error::NotTaken`] when
/// the drive does not move.
pub async fn step(desk: &Desk, within: Duration) -> Result<Outcome, Error> {
    let inching = desk.need(desk.description().inching, Capability::Inching)?;
    let width = desk.get(inching.width).await?;
    let direction = if width < 0 { Direction::Negative } else { Direction::Positive };
    if width == 0 {
        refuse(desk, Order::Inch(direction)).await?;
        return Ok(Outcome::Reached { position: desk.position().await? });
    }
    begin(desk, direction, inching, inching.step).await?;
    let until = desk.now() + within;
    loop {
        let status_word = desk.status().await?;
        let over = !moves(desk, status_word).await? || state_of(status_word)? != State::OperationEnabled;
        if over && let Some(outcome) = end_of_travel(desk, reason(desk).await?).await? {
            return Ok(outcome);
        }
        if desk.now() >= until {
            return Ok(Outcome::TimedOut { position: desk.position().await? });
        }
        desk.next_status().await?;
    }
}

/// The status word, once it tells why the drive stands: that may be a moment after it has come to stand.
async fn reason(desk: &Desk) -> Result<u16, Error> {
    let bits = desk.description().status;
    let told = |word| {
        word & (bits.target_reached | bits.internal_limit) != 0
            || State::from_status_word(word) != Some(State::OperationEnabled)
    };
    match desk.await_status(told).await? {
        Ok(word) | Err(word) => Ok(word),
    }
}

/// Moves until [`stop_inching`], or until a limit is passed.
///
/// # Errors
///
/// [`Error::Unsupported`] before anything is sent; [`Error::Refused`] before anything moves; [`Error::NotTaken`] when
/// the drive does not move.
pub async fn inch(desk: &Desk, direction: Direction) -> Result<(), Error> {
    let inching = desk.need(desk.description().inching, Capability::Inching)?;
    let bit = match direction {
        Direction::Positive => inching.positive,
        Direction::Negative => inching.negative,
    };
    begin(desk, direction, inching, bit).await
}

async fn begin(desk: &Desk, direction: Direction, inching: Inching, bit: u16) -> Result<(), Error> {
    refuse(desk, Order::Inch(direction)).await?;
    let from = desk.position().await?;
    let word = desk.description().moving();
    // The order is an edge, and Stop forbids it.
    desk.control(word).await?;
    desk.lock().moving = true;
    desk.unsettle();
    desk.control(word | bit).await?;
    let until = desk.now() + desk.description().times.reaction;
    desk.pass(inching.begins).await?;
    loop {
        let status_word = desk.status().await?;
        // Inching is not acknowledged: the movement is all that shows, or the fault that it has led to.
        if moves(desk, status_word).await? || state_of(status_word)? != State::OperationEnabled {
            return Ok(());
        }
        if desk.position().await? != from {
            return Ok(());
        }
        if desk.now() >= until {
            withdraw(desk).await?;
            return Err(Error::NotTaken { status_word });
        }
        desk.next_status().await?;
    }
}

/// Ends inching, and says where the drive stands.
///
/// # Errors
///
/// [`Error::Unsupported`] before anything is sent; as [`Desk::read`].
pub async fn stop_inching(desk: &Desk) -> Result<i32, Error> {
    desk.need(desk.description().inching, Capability::Inching)?;
    // Not without Stop: its falling edge would go on with an interrupted travel, or run at the last velocity.
    come_to_rest(desk).await?;
    at_rest(desk);
    desk.position().await
}
