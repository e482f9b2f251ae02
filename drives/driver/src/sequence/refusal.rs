//! Finding out before anything moves why the drive would refuse an order.

use lexican_runtime::profile::cia402::State;

use super::observe::{cause, is_fault, is_inching, known, moves, shown_mode, state_of, under_way};
use crate::context::{DriveContext, Motion, narrow};
use crate::description::{Gear, Orders, Word};
use crate::direction::Direction;
use crate::error::{Capability, Error, Missing, Refusal};
use crate::mode::Mode;

/// An order that is about to be given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// Travel to a position.
    Travel {
        /// The target.
        target: i32,
    },
    /// Travel to another position after the previous one.
    Add {
        /// The target; `None` if it is a distance.
        target: Option<i32>,
    },
    /// Move by inching, in this direction.
    Inch(Direction),
    /// Run at a velocity.
    Run {
        /// In the unit of 60FFh.
        velocity: i32,
    },
    /// Turn with a torque.
    Turn,
}

///
/// Errors: [`Error::Refused`] with every condition that is not met.
pub async fn refuse(drive: &DriveContext, order: Order) -> Result<(), Error> {
    drive.need(order.is_supported(drive).then_some(()), order.capability())?;
    let description = drive.description();
    let mut missing = Vec::new();
    let number = shown_mode(drive).await?;
    match description.mode_of(number) {
        Some(mode) if mode == order.mode() => {}
        Some(mode) => missing.push(Missing::Mode(mode)),
        None => missing.push(Missing::UnknownMode(number)),
    }
    let status_word = drive.status().await?;
    let system = system_for(drive, order.set()).await?;
    missing.extend(not_enabled(drive, status_word).await?);
    missing.extend(conditions(drive, order.set(), status_word, system));
    missing.extend(unfinished(drive, order.set(), status_word).await?.filter(|it| !missing.contains(it)));
    tell_interruptions(drive, status_word, &mut missing).await?;
    match order {
        Order::Travel { target } => {
            missing.extend(target_beyond_limits(drive, target).await?);
            missing.extend(no_profile_velocity(drive).await?);
        }
        Order::Add { target } => {
            missing.extend(no_profile_velocity(drive).await?);
            missing.extend(drive.lock().motion.is_paused().then_some(Missing::TravelResumed));
            if let Some(target) = target {
                missing.extend(target_beyond_limits(drive, target).await?);
            }
        }
        Order::Inch(_) | Order::Turn => {}
        Order::Run { velocity } => missing.extend(too_fast(drive, velocity).await?),
    }
    refused(missing)
}

/// Checks the description's conditions for these orders.
pub(super) async fn require(drive: &DriveContext, orders: Orders, status_word: u16) -> Result<(), Error> {
    let system = system_for(drive, orders).await?;
    let mut missing: Vec<Missing> = conditions(drive, orders, status_word, system).collect();
    missing.extend(unfinished(drive, orders, status_word).await?.filter(|it| !missing.contains(it)));
    tell_interruptions(drive, status_word, &mut missing).await?;
    refused(missing)
}

/// Names an interruption instead of a travel: a travel that stands already is to be resumed or dropped, not stopped.
async fn tell_interruptions(drive: &DriveContext, status_word: u16, missing: &mut [Missing]) -> Result<(), Error> {
    let Some(found) = missing.iter_mut().find(|it| **it == Missing::NoTravel) else { return Ok(()) };
    let motion = drive.lock().motion;
    let may_be = match motion {
        Motion::Travelling(_) | Motion::Unknown | Motion::Resting => under_way(drive, status_word).await?,
        Motion::Stepping { .. } | Motion::Inching | Motion::Homing | Motion::Running => false,
    };
    if may_be && (motion.is_paused() || drive.has_settled()) && !moves(drive, status_word).await? {
        *found = Missing::TravelResumed;
    }
    Ok(())
}

pub(super) async fn require_enabled(drive: &DriveContext, status_word: u16) -> Result<(), Error> {
    refused(not_enabled(drive, status_word).await?.into_iter().collect())
}

async fn not_enabled(drive: &DriveContext, status_word: u16) -> Result<Option<Missing>, Error> {
    Ok(match state_of(status_word)? {
        State::OperationEnabled => None,
        state if is_fault(state) => Some(Missing::NoFault(cause(drive).await?)),
        state => Some(Missing::Enabled(state)),
    })
}

/// Checks that nothing is under way.
pub(super) async fn require_rest(drive: &DriveContext) -> Result<(), Error> {
    let status_word = drive.status().await?;
    state_of(status_word)?;
    require(drive, Orders::SET_UP, status_word).await
}

impl Order {
    fn mode(self) -> Mode {
        match self {
            Order::Travel { .. } | Order::Add { .. } | Order::Inch(_) => Mode::Positioning,
            Order::Run { .. } => Mode::Velocity,
            Order::Turn => Mode::Torque,
        }
    }

    fn set(self) -> Orders {
        match self {
            Order::Travel { .. } => Orders::TRAVEL,
            Order::Add { .. } => Orders::ADD,
            Order::Inch(Direction::Positive) => Orders::INCH_POSITIVE,
            Order::Inch(Direction::Negative) => Orders::INCH_NEGATIVE,
            Order::Run { .. } | Order::Turn => Orders::RUN,
        }
    }

    fn capability(self) -> Capability {
        match self {
            Order::Inch(_) => Capability::Inching,
            _ => Capability::Mode(self.mode()),
        }
    }

    fn is_supported(self, drive: &DriveContext) -> bool {
        let description = drive.description();
        match self {
            Order::Travel { .. } | Order::Add { .. } => description.code_of(Mode::Positioning).is_some(),
            Order::Inch(_) => description.inching.is_some(),
            Order::Run { .. } => description.velocity.is_some() && description.code_of(Mode::Velocity).is_some(),
            Order::Turn => description.torque.is_some() && description.code_of(Mode::Torque).is_some(),
        }
    }
}

fn refused(missing: Vec<Missing>) -> Result<(), Error> {
    if missing.is_empty() { Ok(()) } else { Err(Error::Refused(Refusal(missing))) }
}

/// The manufacturer's status register if a condition for these orders needs it, or else 0.
async fn system_for(drive: &DriveContext, orders: Orders) -> Result<u32, Error> {
    let rows = drive.description().conditions.iter();
    let mut needing = rows.filter(|row| row.refuses.contains(orders) && row.when.word == Word::System);
    if needing.next().is_some() { drive.system().await } else { Ok(0) }
}

/// The unmet conditions for these orders.
fn conditions(drive: &DriveContext, orders: Orders, status_word: u16, system: u32) -> impl Iterator<Item = Missing> {
    let rows = drive.description().conditions.iter().filter(move |row| row.refuses.contains(orders));
    rows.filter(move |row| {
        row.when.holds(match row.when.word {
            Word::Status => status_word.into(),
            Word::System => system,
        })
    })
    .map(|row| row.missing)
}

/// The motion that the driver has ordered and that is not over. The drive may not report it: it does not report slow
/// inching, nor velocity 0, from which it runs as soon as it gets another velocity.
async fn unfinished(drive: &DriveContext, orders: Orders, status_word: u16) -> Result<Option<Missing>, Error> {
    if !orders.contains(Orders::FROM_REST) || State::from_status_word(status_word) != Some(State::OperationEnabled) {
        return Ok(None);
    }
    let motion = drive.lock().motion;
    let unfinished = motion == Motion::Running
        || !drive.reports_travels() && under_way(drive, status_word).await?
        || motion.may_move() && (moves(drive, status_word).await? || is_inching(drive).await?);
    Ok(unfinished.then_some(Missing::NoTravel))
}

async fn target_beyond_limits(drive: &DriveContext, target: i32) -> Result<Option<Missing>, Error> {
    let Some((low, high)) = limits(drive).await? else { return Ok(None) };
    Ok((!(low..=high).contains(&target)).then_some(Missing::TargetWithinLimits { target, low, high }))
}

/// Refuses to inch towards a limit at which the drive stands, since the drive itself need not report it.
pub(super) async fn refuse_at_limit(drive: &DriveContext, direction: Direction) -> Result<(), Error> {
    let Some((low, high)) = limits(drive).await? else { return Ok(()) };
    let position = drive.position().await?;
    refused(match direction {
        Direction::Positive if position >= high => vec![Missing::ShortOfUpperLimit],
        Direction::Negative if position <= low => vec![Missing::ShortOfLowerLimit],
        _ => Vec::new(),
    })
}

/// The lower and the upper limit of positions (607Dh); `None` if the drive does not have the object, or both are equal.
pub async fn limits(drive: &DriveContext) -> Result<Option<(i32, i32)>, Error> {
    let Some([one, other]) = drive.description().objects.position_limits else { return Ok(None) };
    let Some(one) = known(drive.get(one).await)? else { return Ok(None) };
    let Some(other) = known(drive.get(other).await)? else { return Ok(None) };
    let (a, b) = (narrow(one), narrow(other));
    Ok((a != b).then_some((a.min(b), a.max(b))))
}

async fn no_profile_velocity(drive: &DriveContext) -> Result<Option<Missing>, Error> {
    let Some(profile) = drive.description().profile else { return Ok(None) };
    let stands = known(drive.get(profile.velocity).await)? == Some(0);
    Ok(stands.then_some(Missing::ProfileVelocity(profile.velocity.address())))
}

async fn too_fast(drive: &DriveContext, velocity: i32) -> Result<Option<Missing>, Error> {
    let Some(Gear { object, most, otherwise }) = drive.description().velocity.and_then(|velocity| velocity.gear) else {
        return Ok(None);
    };
    let gear = drive.get(object).await?;
    let most = most.iter().find(|(number, _)| *number == gear).map_or(otherwise, |(_, most)| *most);
    Ok((velocity.unsigned_abs() > most.unsigned_abs()).then_some(Missing::VelocityWithinGear { velocity, most }))
}
