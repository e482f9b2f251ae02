//! Why the drive would refuse a travel, found out before anything moves (chapter 2.2.1).

use super::power::{cause, state_of};
use crate::Direction;
use crate::driver::Mode;
use crate::driver::desk::Desk;
use crate::driver::error::{Error, Missing, Refusal};
use crate::od;
use crate::state::State;

/// What the drive is about to be told.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// Travel to a position.
    Travel {
        /// The target.
        target: i32,
    },
    /// Move by inching, in this direction.
    Inch(Direction),
    /// Run at a velocity, in rev/min.
    Run {
        /// In rev/min.
        velocity: i32,
    },
}

/// Checks the conditions of chapter 2.2.1, 2.2.1.2 or 2.2.2.
///
/// # Errors
///
/// [`Error::Refused`] with every condition that is not met; as [`Desk::read`].
pub async fn refuse(desk: &Desk, order: Order) -> Result<(), Error> {
    let bits = desk.description().system;
    let mut missing = Vec::new();
    let mode = desk.read(od::MODES_OF_OPERATION).await?;
    match Mode::of(mode) {
        Some(mode) if mode == order.mode() => {}
        Some(mode) => missing.push(Missing::Mode(mode)),
        None => missing.push(Missing::UnknownMode(mode)),
    }
    let state = state_of(desk.status().await?)?;
    let system = desk.read(od::MANUFACTURER_STATUS_REGISTER).await?.0;
    match state {
        State::OperationEnabled => {}
        State::Fault => missing.push(Missing::NoFault(cause(desk).await?)),
        state => missing.push(Missing::Enabled(state)),
    }
    if system & bits.no_supply != 0 {
        missing.push(Missing::Supply);
    }
    match order {
        Order::Travel { target } => {
            missing.extend(travelling(desk, system));
            missing.extend(beyond(desk, system, None));
            missing.extend(target_beyond_limits(desk, target).await?);
        }
        Order::Inch(direction) => {
            missing.extend(travelling(desk, system));
            missing.extend(beyond(desk, system, Some(direction)));
        }
        Order::Run { velocity } => missing.extend(too_fast(desk, velocity).await?),
    }
    if missing.is_empty() { Ok(()) } else { Err(Error::Refused(Refusal(missing))) }
}

impl Order {
    fn mode(self) -> Mode {
        match self {
            Order::Travel { .. } | Order::Inch(_) => Mode::Positioning,
            Order::Run { .. } => Mode::Velocity,
        }
    }
}

/// Inching shows as movement only.
fn travelling(desk: &Desk, system: u16) -> Option<Missing> {
    let bits = desk.description().system;
    (system & (bits.positioning | bits.moving) != 0).then_some(Missing::NoTravel)
}

/// Beyond a limit, inching leads back only, and nothing else leads anywhere.
fn beyond(desk: &Desk, system: u16, inching: Option<Direction>) -> Option<Missing> {
    let bits = desk.description().system;
    if system & bits.above_upper_limit != 0 && inching != Some(Direction::Negative) {
        Some(Missing::BelowUpperLimit)
    } else if system & bits.below_lower_limit != 0 && inching != Some(Direction::Positive) {
        Some(Missing::AboveLowerLimit)
    } else {
        None
    }
}

async fn target_beyond_limits(desk: &Desk, target: i32) -> Result<Option<Missing>, Error> {
    let limits = od::SOFTWARE_POSITION_LIMIT;
    let (a, b) = (desk.read(limits.limit_1()).await?.0, desk.read(limits.limit_2()).await?.0);
    let (low, high) = (a.min(b), a.max(b));
    let within = low == high || (low..=high).contains(&target);
    Ok((!within).then_some(Missing::TargetWithinLimits { target, low, high }))
}

async fn too_fast(desk: &Desk, velocity: i32) -> Result<Option<Missing>, Error> {
    let most: i32 = match desk.read(od::GEAR_REDUCTION).await? {
        od::GearReduction::GEAR_24_1 => 200,
        _ => 100,
    };
    Ok((velocity.unsigned_abs() > most.unsigned_abs()).then_some(Missing::VelocityWithinGear { velocity, most }))
}
