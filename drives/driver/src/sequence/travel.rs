//! Positioning mode: travels, and their interruption.

use lexican_runtime::profile::cia402::State;
use lexican_runtime::{Duration, Instant};

use super::observe::{cause, is_fault, known, moves, reports_under_way, state_of, under_way, window};
use super::power::reach;
use super::refusal::{Order, refuse};
use super::rest::{at_rest, come_to_rest, come_to_stand, stand_still, stuck};
use crate::description::Release;
use crate::desk::{Awaited, Desk, Motion, Pause, Travel};
use crate::error::{Error, Missing, Outcome, Refusal};

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

/// Travels to a position, and waits for the end.
///
/// # Errors
///
/// Those of [`start_travel`] and [`finish`].
pub async fn travel(
    desk: &Desk,
    target: i32,
    within: Duration,
    progress: &mut (dyn FnMut(Progress) + Send),
) -> Result<Outcome, Error> {
    start_travel(desk, target).await?;
    finish(desk, within, progress).await
}

/// Starts to travel to a position; returns once the drive has taken the order.
///
/// # Errors
///
/// [`Error::Refused`] before anything moves; [`Error::NotTaken`] when the drive does not take the order
/// nevertheless: it is then withdrawn, and the drive stands. An order that it took late is interrupted, and reported as
/// [`Missing::NoTravel`].
pub async fn start_travel(desk: &Desk, target: i32) -> Result<(), Error> {
    let description = desk.description();
    description.objects.target_position.check(target.into())?;
    refuse(desk, Order::Travel { target }).await?;
    let acknowledged = description.status.acknowledged;
    // The order is an edge, and so is its acknowledgement: both bits have to fall first.
    desk.control(description.resting()).await?;
    let Awaited { status_word, came } = desk.await_status(|word| word & acknowledged == 0).await?;
    // That may take a while; and outside OPERATION ENABLED the order would enable the drive first.
    if !came || state_of(status_word)? != State::OperationEnabled {
        refuse(desk, Order::Travel { target }).await?;
        return Err(Error::NotTaken { status_word });
    }
    desk.lock().order(Motion::travel(Some(target)));
    desk.unsettle();
    desk.control_position(description.moving() | description.control.new_setpoint, target).await?;
    let Awaited { status_word, came } = desk.await_status(|word| word & acknowledged != 0).await?;
    if !came {
        withdraw(desk).await?;
        refuse(desk, Order::Travel { target }).await?;
        return Err(Error::NotTaken { status_word });
    }
    // The drive has acknowledged; its other bits may lag behind.
    desk.unsettle();
    if description.release == Release::WhenAcknowledged {
        desk.control(description.moving()).await?;
    }
    Ok(())
}

/// Waits until the travel under way is over, by any end. One that is interrupted is not over.
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
        let position = desk.position().await?;
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
pub(super) async fn end_of_travel(desk: &Desk, status_word: u16) -> Result<Option<Outcome>, Error> {
    let bits = desk.description().status;
    let state = state_of(status_word)?;
    if state == State::OperationEnabled && under_way(desk, status_word).await? {
        let Some(torque) = desk.description().torque_deactivation else { return Ok(None) };
        let stands = desk.has_settled() && !moves(desk, status_word).await?;
        let deactivated = stands && desk.get(torque.state).await? as u32 & torque.active != 0;
        let position = desk.position().await?;
        return Ok(deactivated.then_some(Outcome::TorqueDeactivated { position }));
    }
    if is_fault(state) {
        at_rest(desk);
        return Ok(Some(Outcome::Fault(cause(desk).await?)));
    }
    // Clears New Setpoint, unless it has been.
    if state == State::OperationEnabled && desk.description().release == Release::WhenOver {
        desk.control(desk.description().resting()).await?;
    }
    // Nothing else ends with a travel: neither inching nor velocity mode.
    let motion = desk.lock().motion;
    if matches!(motion, Motion::Travelling(_)) || state != State::OperationEnabled || !moves(desk, status_word).await? {
        at_rest(desk);
    }
    let position = desk.position().await?;
    Ok(Some(if state != State::OperationEnabled {
        // A drive that stands after a quick stop sets the bit of a target that is reached (CiA 402-2).
        Outcome::Interrupted { state, position }
    } else if status_word & bits.target_reached != 0 {
        if is_overridden(desk, motion, position).await? {
            Outcome::Overridden { position }
        } else {
            Outcome::Reached { position }
        }
    } else if status_word & bits.internal_limit != 0 {
        Outcome::Limit { position }
    } else {
        Outcome::Interrupted { state, position }
    }))
}

/// Whether the drive has reached another target than the one that has been ordered: another manager has ordered
/// something else meanwhile.
async fn is_overridden(desk: &Desk, motion: Motion, position: i32) -> Result<bool, Error> {
    let (ordered, tolerance) = match motion {
        Motion::Travelling(Travel { target: Some(target), .. }) => (target, window(desk).await?),
        // Where it began was measured, too.
        Motion::Stepping { target } => (target, window(desk).await?.map(|window| 2 * window + 1)),
        _ => return Ok(false),
    };
    match tolerance {
        Some(tolerance) => Ok((i64::from(position) - i64::from(ordered)).abs() > tolerance),
        None if matches!(motion, Motion::Travelling(_)) && position != ordered => {
            let target = known(desk.get(desk.description().objects.target_position).await)?;
            Ok(target.is_some_and(|target| target != ordered.into()))
        }
        None => Ok(false),
    }
}

/// Interrupts the travel under way with its programmed deceleration; returns once the drive stands.
///
/// # Errors
///
/// [`Error::Refused`] when no travel is under way.
pub async fn interrupt(desk: &Desk) -> Result<(), Error> {
    require_travel(desk).await?;
    let description = desk.description();
    {
        let mut shared = desk.lock();
        shared.motion = shared.motion.with_pause(Pause::Interrupted);
    }
    stand_still(desk, description.moving() | description.held() | description.control.stop).await
}

/// Goes on with an interrupted travel, also after torque deactivation.
///
/// # Errors
///
/// [`Error::Refused`] when no travel is under way; [`Error::NotTaken`] when the drive does not move on.
pub async fn resume(desk: &Desk) -> Result<(), Error> {
    require_travel(desk).await?;
    let description = desk.description();
    let word = description.moving() | description.held();
    let has_edge = match desk.lock().motion.pause() {
        Some(Pause::Interrupted) => true,
        // Stop has cleared New Setpoint, whose edge must not come with that of Stop.
        Some(Pause::Stopped) => description.held() == 0,
        // The drive has stopped by itself, or has not gone on at the last edge.
        Some(Pause::None | Pause::Unheeded) | None => false,
    };
    if !has_edge {
        desk.control(word | description.control.stop).await?;
    }
    let mut resumption = Resumption { desk, seen: false };
    {
        let mut shared = desk.lock();
        let motion = shared.motion.with_pause(Pause::None);
        shared.order(motion);
    }
    desk.unsettle();
    desk.control(word).await?;
    let until = desk.now() + description.times.reaction;
    loop {
        let status_word = desk.status().await?;
        let over = !reports_under_way(desk, status_word).await?;
        // If the drive does not say so, the bit that says "over" said "it stands" a moment ago.
        let seen = over == description.status.positioning.is_some();
        if seen || desk.velocity().await? != 0 || (over && desk.now() >= until) {
            resumption.seen = true;
            return Ok(());
        }
        if desk.now() >= until {
            return Err(Error::NotTaken { status_word });
        }
        desk.next_status().await?;
    }
}

/// A travel that is ordered to go on. Unless it is seen to, it counts as interrupted, and standstill is not its end.
struct Resumption<'a> {
    desk: &'a Desk,
    seen: bool,
}

impl Drop for Resumption<'_> {
    fn drop(&mut self) {
        if !self.seen {
            let mut shared = self.desk.lock();
            shared.motion = shared.motion.with_pause(Pause::Unheeded);
        }
    }
}

/// Takes back an order that the drive has not taken. The order may still be on its way, behind the word that
/// takes it back: so the drive has to stand for as long as a command may take.
pub(super) async fn withdraw(desk: &Desk) -> Result<(), Error> {
    let times = desk.description().times;
    let end = desk.now() + times.braking;
    // In any other state it takes no order, and the word would enable it.
    while state_of(desk.status().await?)? == State::OperationEnabled {
        come_to_rest(desk).await?;
        desk.pass(times.reaction).await?;
        match come_to_stand(desk, desk.now()).await? {
            None => break,
            Some(velocity) if desk.now() >= end => return Err(stuck(desk, velocity)),
            Some(_) => {}
        }
    }
    // An order that was taken late, and does not show, would go on with the next one. Outside OPERATION ENABLED the
    // drive forgets it.
    if !desk.reports_travels() && state_of(desk.status().await?)? == State::OperationEnabled {
        reach(desk, State::SwitchedOn).await?;
    }
    at_rest(desk);
    Ok(())
}

async fn require_travel(desk: &Desk) -> Result<(), Error> {
    let status_word = desk.status().await?;
    let missing = match state_of(status_word)? {
        State::OperationEnabled if under_way(desk, status_word).await? => return Ok(()),
        State::OperationEnabled => Missing::Travel,
        state if is_fault(state) => Missing::NoFault(cause(desk).await?),
        state => Missing::Enabled(state),
    };
    Err(Error::Refused(Refusal(vec![missing])))
}
