//! Positioning mode: travels, interruptions, inching.

use lexican_runtime::{Duration, Instant};

use super::power::{at_rest, cause, state_of};
use super::refusal::{Order, refuse};
use crate::Direction;
use crate::driver::desk::Desk;
use crate::driver::error::{Error, Missing, Outcome, Refusal};
use crate::od;
use crate::state::{Command, State};

/// How far a travel has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// When this was so.
    pub at: Instant,
    /// The position, as 6064h has it.
    pub position: i32,
    /// The status word.
    pub status_word: u16,
}

/// Starts to travel to a position; returns once the drive has taken the order.
///
/// # Errors
///
/// [`Error::Refused`] before anything is sent; [`Error::NotTaken`] when the drive does not take the order
/// nevertheless: it is then withdrawn, and the drive stands. An order that it took late is interrupted, and told as
/// [`Missing::NoTravel`].
pub async fn start_travel(desk: &Desk, target: i32) -> Result<(), Error> {
    od::TARGET_POSITION.check(od::Position(target))?;
    refuse(desk, Order::Travel { target }).await?;
    let (control, status) = (desk.description().control, desk.description().status);
    // The order is an edge, and so is its acknowledgement: both bits have to fall first.
    desk.control(idle(desk));
    if let Err(word) = desk.await_status(|word| word & status.acknowledged == 0).await? {
        return Err(Error::NotTaken { status_word: word });
    }
    desk.lock().moving = true;
    desk.control_position(enabled() | control.new_setpoint, target);
    match desk.await_status(|word| word & status.acknowledged != 0).await? {
        Ok(_) => Ok(()),
        Err(word) => {
            withdraw(desk).await?;
            refuse(desk, Order::Travel { target }).await?;
            Err(Error::NotTaken { status_word: word })
        }
    }
}

/// Waits until the travel under way is over, whatever its end. One that is interrupted is not over.
///
/// # Errors
///
/// As [`Desk::read`].
pub async fn finish(
    desk: &Desk,
    within: Duration,
    progress: &mut (dyn FnMut(Progress) + Send),
) -> Result<Outcome, Error> {
    let until = desk.now() + within;
    let mut status_word = desk.status().await?;
    loop {
        let position = desk.read(od::POSITION_ACTUAL_VALUE).await?.0;
        progress(Progress { at: desk.now(), position, status_word });
        if let Some(outcome) = end_of_travel(desk, status_word).await? {
            return Ok(outcome);
        }
        if desk.now() >= until {
            return Ok(Outcome::TimedOut { position });
        }
        status_word = desk.next_status().await?;
    }
}

/// How the travel has ended; `None` while it has not.
async fn end_of_travel(desk: &Desk, status_word: u16) -> Result<Option<Outcome>, Error> {
    let bits = desk.description().status;
    let state = state_of(status_word)?;
    if state == State::OperationEnabled && status_word & bits.positioning != 0 {
        let stands = status_word & bits.moving == 0 && !desk.lock().paused;
        let deactivated = stands && desk.read(od::TORQUE_DEACTIVATION_STATE).await?.active();
        let position = desk.read(od::POSITION_ACTUAL_VALUE).await?.0;
        return Ok(deactivated.then_some(Outcome::TorqueDeactivated { position }));
    }
    if state == State::Fault {
        at_rest(desk);
        return Ok(Some(Outcome::Fault(cause(desk).await?)));
    }
    // Clears New Setpoint, as table 25 does after each travel.
    if state == State::OperationEnabled {
        desk.control(idle(desk));
    }
    at_rest(desk);
    let position = desk.read(od::POSITION_ACTUAL_VALUE).await?.0;
    Ok(Some(if status_word & bits.target_reached != 0 {
        Outcome::Reached { position }
    } else if status_word & bits.internal_limit != 0 {
        Outcome::Limit { position }
    } else {
        Outcome::Interrupted { state, position }
    }))
}

/// Interrupts the travel under way with its programmed deceleration; returns once the drive stands.
///
/// # Errors
///
/// [`Error::Refused`] when no travel is under way.
pub async fn interrupt(desk: &Desk) -> Result<(), Error> {
    require_travel(desk).await?;
    let control = desk.description().control;
    desk.lock().paused = true;
    stand_still(desk, enabled() | control.new_setpoint | control.stop).await
}

/// Goes on with an interrupted travel, also after torque deactivation.
///
/// # Errors
///
/// [`Error::Refused`] when no travel is under way; [`Error::NotTaken`] when the drive does not move on.
pub async fn resume(desk: &Desk) -> Result<(), Error> {
    require_travel(desk).await?;
    let control = desk.description().control;
    let word = enabled() | control.new_setpoint;
    if !desk.lock().paused {
        // The drive has stopped by itself: the edge that resumes has to be made.
        desk.control(word | control.stop);
    }
    {
        let mut shared = desk.lock();
        shared.paused = false;
        shared.moving = true;
    }
    desk.control(word);
    let until = desk.now() + desk.description().reaction;
    loop {
        let status_word = desk.status().await?;
        let over = status_word & desk.description().status.positioning == 0;
        if over || desk.read(od::VELOCITY_ACTUAL_VALUE).await?.0 != 0 {
            return Ok(());
        }
        if desk.now() >= until {
            desk.lock().paused = true;
            return Err(Error::NotTaken { status_word });
        }
        desk.next_status().await?;
    }
}

/// Inching operation 1: travels once by 2415h, and waits for the end.
///
/// # Errors
///
/// [`Error::Refused`] before anything is sent; [`Error::NotTaken`] when the drive does not move.
pub async fn step(desk: &Desk, within: Duration) -> Result<Outcome, Error> {
    let width = desk.read(od::DELTA_JOG).await?.0;
    let direction = if width < 0 { Direction::Negative } else { Direction::Positive };
    if width == 0 {
        refuse(desk, Order::Inch(direction)).await?;
        return Ok(Outcome::Reached { position: desk.read(od::POSITION_ACTUAL_VALUE).await?.0 });
    }
    begin_inching(desk, direction, desk.description().control.step).await?;
    let until = desk.now() + within;
    loop {
        let status_word = desk.status().await?;
        let bits = desk.description().status;
        let over = status_word & bits.moving == 0 || state_of(status_word)? != State::OperationEnabled;
        if over && let Some(outcome) = end_of_travel(desk, status_word).await? {
            return Ok(outcome);
        }
        if desk.now() >= until {
            return Ok(Outcome::TimedOut { position: desk.read(od::POSITION_ACTUAL_VALUE).await?.0 });
        }
        desk.next_status().await?;
    }
}

/// Inching operation 2: moves until [`stop_inching`], or until a limit is passed.
///
/// # Errors
///
/// [`Error::Refused`] before anything is sent; [`Error::NotTaken`] when the drive does not move.
pub async fn inch(desk: &Desk, direction: Direction) -> Result<(), Error> {
    let control = desk.description().control;
    let bit = match direction {
        Direction::Positive => control.inch_positive,
        Direction::Negative => control.inch_negative,
    };
    begin_inching(desk, direction, bit).await
}

async fn begin_inching(desk: &Desk, direction: Direction, bit: u16) -> Result<(), Error> {
    refuse(desk, Order::Inch(direction)).await?;
    let from = desk.read(od::POSITION_ACTUAL_VALUE).await?.0;
    // The order is an edge, and Stop forbids it.
    desk.control(enabled());
    desk.lock().moving = true;
    desk.control(enabled() | bit);
    let until = desk.now() + desk.description().reaction;
    desk.pass(desk.description().inching_begins).await?;
    loop {
        let status_word = desk.status().await?;
        // Inching is not acknowledged: the movement is all that shows, or the fault that it has led to.
        let begun = status_word & desk.description().status.moving != 0;
        if begun || state_of(status_word)? != State::OperationEnabled {
            return Ok(());
        }
        if desk.read(od::POSITION_ACTUAL_VALUE).await?.0 != from {
            return Ok(());
        }
        if desk.now() >= until {
            withdraw(desk).await?;
            return Err(Error::NotTaken { status_word });
        }
        desk.next_status().await?;
    }
}

/// Ends inching operation 2, and says where the drive stands.
///
/// # Errors
///
/// As [`Desk::read`].
pub async fn stop_inching(desk: &Desk) -> Result<i32, Error> {
    stand_still(desk, enabled()).await?;
    desk.control(idle(desk));
    at_rest(desk);
    Ok(desk.read(od::POSITION_ACTUAL_VALUE).await?.0)
}

/// Stops whatever moves, in either mode, with its programmed deceleration.
pub(super) async fn come_to_rest(desk: &Desk) -> Result<(), Error> {
    stand_still(desk, idle(desk)).await
}

/// Sends a word that stops the drive, until it stands. The word means the same when it comes again, so that
/// one that gets lost is sent again; and braking may take a minute with the gentlest deceleration.
async fn stand_still(desk: &Desk, word: u16) -> Result<(), Error> {
    let description = desk.description();
    let end = desk.now() + description.braking;
    loop {
        desk.control(word);
        match come_to_stand(desk, desk.now() + description.reaction).await? {
            0 => return Ok(()),
            velocity if desk.now() >= end => return Err(Error::NotStopped { velocity }),
            _ => {}
        }
    }
}

/// Waits until the drive stands, no longer than `until`; the last velocity in rev/min.
pub(super) async fn come_to_stand(desk: &Desk, until: Instant) -> Result<i32, Error> {
    loop {
        // Read after the command was sent, so that it has had its effect.
        let velocity = desk.read(od::VELOCITY_ACTUAL_VALUE).await?.0;
        if velocity == 0 || desk.now() >= until {
            return Ok(velocity);
        }
        desk.next_status().await?;
    }
}

/// Takes back an order that the drive has not taken. The order may still be on its way, behind the word that
/// takes it back: so the drive has to stand for as long as a command may take.
async fn withdraw(desk: &Desk) -> Result<(), Error> {
    let end = desk.now() + desk.description().braking;
    // In any other state it takes no order, and the word would enable it.
    while state_of(desk.status().await?)? == State::OperationEnabled {
        come_to_rest(desk).await?;
        desk.pass(desk.description().reaction).await?;
        match desk.read(od::VELOCITY_ACTUAL_VALUE).await?.0 {
            0 => break,
            velocity if desk.now() >= end => return Err(Error::NotStopped { velocity }),
            _ => {}
        }
    }
    at_rest(desk);
    Ok(())
}

async fn require_travel(desk: &Desk) -> Result<(), Error> {
    let status_word = desk.status().await?;
    if status_word & desk.description().status.positioning == 0 {
        return Err(Error::Refused(Refusal(vec![Missing::Travel])));
    }
    Ok(())
}

/// OPERATION ENABLED, and nothing is to move.
fn idle(desk: &Desk) -> u16 {
    desk.description().word(Command::EnableOperation)
}

/// OPERATION ENABLED, and something may move.
fn enabled() -> u16 {
    Command::EnableOperation.apply(0)
}
