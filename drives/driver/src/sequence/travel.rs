//! Positioning mode: travels and their interruption.

use lexican_runtime::object::DataType;
use lexican_runtime::profile::cia402::State;
use lexican_runtime::{Duration, Instant};

use super::identify::pdo_parameter;
use super::observe::{cause, is_fault, known, moves, reports_under_way, state_of, under_way, window};
use super::power::{disable, reach};
use super::refusal::{Order, refuse};
use super::standstill::{at_rest, come_to_rest, come_to_stand, stand_still, stuck};
use crate::context::{Awaited, DriveContext, Motion, Pause, Travel};
use crate::description::{Number, Release};
use crate::error::{Capability, Error, Missing, Refusal};
use crate::outcome::Outcome;

/// Up to this transmission type, a receive PDO waits for SYNC (CiA 301, 7.5.2.35).
const LAST_SYNCHRONOUS: i64 = 240;

/// A report of a travel under way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// When the status word came.
    pub at: Instant,
    /// In units of 6064h.
    pub position: i32,
    /// The status word itself (6041h).
    pub status_word: u16,
}

/// Travels to a position, and waits for the end.
pub async fn travel(
    drive: &DriveContext,
    target: i32,
    within: Duration,
    progress: &mut (dyn FnMut(Progress) + Send),
) -> Result<Outcome, Error> {
    start_travel(drive, target).await?;
    finish(drive, within, progress).await
}

/// Starts a travel to a position; returns once the drive has taken the order.
///
/// Errors: [`Error::Refused`] before anything moves; [`Error::NotTaken`] if the drive still does not take the order,
/// which is then withdrawn, and the drive stands. If the drive took it late, the travel is interrupted and reported as
/// [`Missing::NoTravel`].
pub async fn start_travel(drive: &DriveContext, target: i32) -> Result<(), Error> {
    order_travel(drive, target).await?;
    confirm_start(drive).await
}

/// Orders a travel, without waiting for the acknowledgement.
pub(super) async fn order_travel(drive: &DriveContext, target: i32) -> Result<(), Error> {
    let description = drive.description();
    description.objects.target_position.check(target.into())?;
    refuse(drive, Order::Travel { target }).await?;
    let acknowledged = description.status.acknowledged;
    // Both the order and its acknowledgement are edges: both bits have to be cleared first.
    drive.control(description.resting()).await?;
    let Awaited { status_word, came } = drive.await_status(|word| word & acknowledged == 0).await?;
    // Waiting may have taken a while, and outside OPERATION ENABLED the order would enable the drive.
    if !came || state_of(status_word)? != State::OperationEnabled {
        refuse(drive, Order::Travel { target }).await?;
        return Err(Error::NotTaken { status_word });
    }
    hand_over(drive, Order::Travel { target }, 0, target).await
}

/// Hands a set-point over, with these control bits in addition to New set-point.
pub(super) async fn hand_over(drive: &DriveContext, order: Order, bits: u16, target: i32) -> Result<(), Error> {
    let description = drive.description();
    drive.lock().order(match order {
        Order::Add { target } => Motion::Travelling(Travel { queued: true, ..Travel::to(target) }),
        _ => Motion::travel(Some(target)),
    });
    drive.unsettle();
    drive.control_position(description.moving() | description.control.new_setpoint | bits, target).await
}

/// Waits until the drive has taken the ordered travel: at once, or after SYNC if it was prepared.
///
/// Errors: [`Error::Refused`] if no travel has been ordered, and those of [`start_travel`].
pub async fn confirm_start(drive: &DriveContext) -> Result<(), Error> {
    let Motion::Travelling(Travel { target: Some(target), .. }) = drive.lock().motion else {
        return Err(Error::Refused(Refusal(vec![Missing::Travel])));
    };
    confirm(drive, Order::Travel { target }).await
}

/// Waits until the drive has acknowledged a set-point, and clears New set-point.
pub(super) async fn confirm(drive: &DriveContext, order: Order) -> Result<(), Error> {
    let description = drive.description();
    let acknowledged = description.status.acknowledged;
    let Awaited { status_word, came } = drive.await_status(|word| word & acknowledged != 0).await?;
    if !came {
        withdraw(drive).await?;
        refuse(drive, order).await?;
        return Err(Error::NotTaken { status_word });
    }
    drive.lock().held = None;
    // The drive has acknowledged; its other bits may lag behind.
    drive.unsettle();
    if description.release == Release::WhenAcknowledged {
        drive.control(description.moving()).await?;
    }
    Ok(())
}

/// Waits until the travel under way ends in any way. An interruption is not an end.
pub async fn finish(
    drive: &DriveContext,
    within: Duration,
    progress: &mut (dyn FnMut(Progress) + Send),
) -> Result<Outcome, Error> {
    let until = drive.now() + within;
    let mut status_word = drive.status().await?;
    loop {
        let position = drive.position().await?;
        progress(Progress { at: drive.now(), position, status_word });
        if let Some(outcome) = end_of_travel(drive, status_word).await? {
            return Ok(outcome);
        }
        if drive.now() >= until {
            return Ok(Outcome::TimedOut { position });
        }
        status_word = drive.next_status().await?;
    }
}

/// How the travel has ended; `None` while it has not.
pub(super) async fn end_of_travel(drive: &DriveContext, status_word: u16) -> Result<Option<Outcome>, Error> {
    let bits = drive.description().status;
    let state = state_of(status_word)?;
    if state == State::OperationEnabled && under_way(drive, status_word).await? {
        let Some(torque) = drive.description().torque_deactivation else { return Ok(None) };
        let stands = drive.has_settled() && !moves(drive, status_word).await?;
        let deactivated = stands && drive.get(torque.state).await? as u32 & torque.active != 0;
        let position = drive.position().await?;
        return Ok(deactivated.then_some(Outcome::TorqueDeactivated { position }));
    }
    if is_fault(state) {
        at_rest(drive);
        return Ok(Some(Outcome::Fault(cause(drive).await?)));
    }
    // Clears New set-point, unless that was done already.
    if state == State::OperationEnabled && drive.description().release == Release::WhenOver {
        drive.control(drive.description().resting()).await?;
    }
    // Only a travel ends here: inching and velocity mode go on.
    let motion = drive.lock().motion;
    if matches!(motion, Motion::Travelling(_)) || state != State::OperationEnabled || !moves(drive, status_word).await?
    {
        at_rest(drive);
    }
    let mut position = drive.position().await?;
    let reached = state == State::OperationEnabled && status_word & bits.target_reached != 0;
    let mut overridden = reached && is_overridden(drive, motion, position).await?;
    if overridden {
        // A drive behind another interface may update its status bits before its position.
        drive.pass(drive.description().times.settling).await?;
        position = drive.position().await?;
        overridden = is_overridden(drive, motion, position).await?;
    }
    Ok(Some(if state != State::OperationEnabled {
        // After a quick stop, a drive that stands sets Target reached (CiA 402-2).
        Outcome::Interrupted { state, position }
    } else if status_word & bits.target_reached != 0 {
        if overridden { Outcome::Overridden { position } } else { Outcome::Reached { position } }
    } else if status_word & bits.internal_limit != 0 {
        Outcome::Limit { position }
    } else {
        Outcome::Interrupted { state, position }
    }))
}

/// Whether the drive has reached another target than the one ordered, because another manager has ordered something
/// else.
async fn is_overridden(drive: &DriveContext, motion: Motion, position: i32) -> Result<bool, Error> {
    let (ordered, tolerance) = match motion {
        Motion::Travelling(Travel { target: Some(target), .. }) => (target, window(drive).await?),
        // The start position was measured, too, with the same tolerance.
        Motion::Stepping { target } => (target, window(drive).await?.map(|window| 2 * window + 1)),
        _ => return Ok(false),
    };
    match tolerance {
        Some(tolerance) => Ok((i64::from(position) - i64::from(ordered)).abs() > tolerance),
        None if matches!(motion, Motion::Travelling(_)) && position != ordered => {
            let target = known(drive.get(drive.description().objects.target_position).await)?;
            Ok(target.is_some_and(|target| target != i64::from(ordered)))
        }
        None => Ok(false),
    }
}

/// Interrupts the travel under way with its programmed deceleration; returns once the drive stands.
///
/// Errors: [`Error::Refused`] when no travel is under way.
pub async fn interrupt(drive: &DriveContext) -> Result<(), Error> {
    require_travel(drive).await?;
    let description = drive.description();
    {
        let mut shared = drive.lock();
        shared.motion = shared.motion.with_pause(Pause::Interrupted);
    }
    stand_still(drive, description.moving() | description.held() | description.control.stop).await
}

/// Resumes an interrupted travel, also after torque deactivation.
///
/// Errors: [`Error::Refused`] when no travel is under way; [`Error::NotTaken`] when the drive does not move on.
pub async fn resume(drive: &DriveContext) -> Result<(), Error> {
    require_travel(drive).await?;
    let description = drive.description();
    let word = description.moving() | description.held();
    let has_edge = match drive.lock().motion.pause() {
        Some(Pause::Interrupted) => true,
        // Stop has cleared New set-point, and their edges must not come together.
        Some(Pause::Stopped) => description.held() == 0,
        // The drive has stopped by itself, or has not resumed at the last edge.
        Some(Pause::None | Pause::Unheeded) | None => false,
    };
    if !has_edge {
        drive.control(word | description.control.stop).await?;
    }
    let mut resumption = Resumption { drive, seen: false };
    {
        let mut shared = drive.lock();
        let motion = shared.motion.with_pause(Pause::None);
        shared.order(motion);
    }
    drive.unsettle();
    drive.control(word).await?;
    let until = drive.reacts_by();
    loop {
        let status_word = drive.status().await?;
        let over = !reports_under_way(drive, status_word).await?;
        // A drive that does not report travels shows by the bit for "over" that it stands, so it is no longer over once
        // the bit is clear.
        let seen = over == description.status.positioning.is_some();
        if seen || drive.velocity().await? != 0 || (over && drive.now() >= until) {
            resumption.seen = true;
            return Ok(());
        }
        if drive.now() >= until {
            return Err(Error::NotTaken { status_word });
        }
        drive.next_status().await?;
    }
}

/// Drops the rest of the travel under way, interrupted or not: stops the drive and releases its motor, which makes
/// every drive drop its travel. Before it moves again, it has to be [enabled](super::enable).
///
/// Errors: [`Error::Refused`] when no travel is under way.
pub async fn drop_travel(drive: &DriveContext) -> Result<(), Error> {
    require_travel(drive).await?;
    disable(drive).await
}

/// A travel that was ordered to resume. Until it is seen to, it counts as interrupted, so that standstill is not taken
/// for its end.
struct Resumption<'a> {
    drive: &'a DriveContext,
    seen: bool,
}

impl Drop for Resumption<'_> {
    fn drop(&mut self) {
        if !self.seen {
            let mut shared = self.drive.lock();
            shared.motion = shared.motion.with_pause(Pause::Unheeded);
        }
    }
}

/// Takes back an order that the drive has not taken. The order may still be on its way, behind the control word that
/// takes it back: so the drive has to stand for a whole reaction time.
pub(super) async fn withdraw(drive: &DriveContext) -> Result<(), Error> {
    let times = drive.description().times;
    let end = drive.now() + times.braking;
    // In any other state the drive takes no order, and the control word would enable it.
    while state_of(drive.status().await?)? == State::OperationEnabled {
        come_to_rest(drive).await?;
        drive.pass(times.reaction).await?;
        match come_to_stand(drive, drive.now()).await? {
            None => break,
            Some(velocity) if drive.now() >= end => return Err(stuck(drive, velocity)),
            Some(_) => {}
        }
    }
    // An order that was taken late and does not show would resume with the next one. Outside OPERATION ENABLED the
    // drive drops it.
    if !drive.reports_travels() && state_of(drive.status().await?)? == State::OperationEnabled {
        reach(drive, State::SwitchedOn).await?;
    }
    if !waits_for_sync(drive).await? {
        drive.lock().held = None;
    }
    at_rest(drive);
    Ok(())
}

/// Whether the drive holds a target, and the control word beside it, until SYNC.
pub(super) async fn waits_for_sync(drive: &DriveContext) -> Result<bool, Error> {
    let Ok(transmission) = target_transmission(drive) else { return Ok(false) };
    Ok(known(drive.get(transmission).await)?.is_some_and(|kind| kind <= LAST_SYNCHRONOUS))
}

/// The transmission type of the PDO that carries a target and a control word.
pub(super) fn target_transmission(drive: &DriveContext) -> Result<Number, Error> {
    let base = drive.need(drive.description().outputs.start_by_sync(), Capability::StartBySync)?.base;
    Ok(pdo_parameter(0x1400, 0x200, base, 0x02, DataType::Unsigned8))
}

async fn require_travel(drive: &DriveContext) -> Result<(), Error> {
    let status_word = drive.status().await?;
    let missing = match state_of(status_word)? {
        State::OperationEnabled if under_way(drive, status_word).await? => return Ok(()),
        State::OperationEnabled => Missing::Travel,
        state if is_fault(state) => Missing::NoFault(cause(drive).await?),
        state => Missing::Enabled(state),
    };
    Err(Error::Refused(Refusal(vec![missing])))
}
