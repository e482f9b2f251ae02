//! How operations of the driver end. The application judges which end is good.

use std::fmt;

use lexican_runtime::profile::cia402::State;

use crate::fault::Cause;

/// How a travel ended. None of these is an error of the driver: the application judges them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names say what it is")]
pub enum Outcome {
    /// The drive rests within the window around its target.
    Reached {
        /// In units of 6064h.
        position: i32,
    },
    /// The drive stopped because it passed a limit.
    Limit { position: i32 },
    /// The drive stopped because of its load (torque deactivation). The travel can be resumed.
    TorqueDeactivated { position: i32 },
    /// The drive says that it has reached its target, but rests elsewhere: another manager, or another handle of this
    /// drive, has ordered something else.
    Overridden { position: i32 },
    /// A fault stopped the drive.
    Fault(Cause),
    /// Something else ended the travel: a quick stop, another manager, a lost supply.
    Interrupted { state: State, position: i32 },
    /// The travel is not over in time. The drive is still under way.
    TimedOut { position: i32 },
}

/// How setting a velocity ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VelocityOutcome {
    /// The drive runs within the window around its target velocity, in the direction of the order.
    Reached {
        /// As in 606Ch.
        velocity: i32,
    },
    /// Another manager, or another handle of this drive, has stopped it, or has ordered another velocity.
    Overridden {
        /// As in 606Ch.
        velocity: i32,
    },
    /// A fault stopped the drive.
    Fault(Cause),
    /// The drive left OPERATION ENABLED.
    Interrupted {
        /// The state that it went to.
        state: State,
    },
    /// The velocity is not reached in time. The drive still has its order; its shaft may stand, or turn the other way.
    TimedOut {
        /// As in 606Ch.
        velocity: i32,
    },
}

/// How homing ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names say what it is")]
pub enum HomingOutcome {
    /// The drive has its reference point, and stands.
    Attained {
        /// In units of 6064h.
        position: i32,
    },
    /// The drive has not found its reference point, and stands.
    Failed { status_word: u16, position: i32 },
    /// A fault stopped the drive.
    Fault(Cause),
    /// Something else ended it: a stop, a quick stop, another manager, a lost supply.
    Interrupted { state: State, position: i32 },
    /// Homing is not over in time. The drive is still under way.
    TimedOut { position: i32 },
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Outcome::Reached { position } => write!(f, "reached, at {position}"),
            Outcome::Limit { position } => write!(f, "stopped by a limit, at {position}"),
            Outcome::TorqueDeactivated { position } => write!(f, "stopped by its load, at {position}"),
            Outcome::Overridden { position } => write!(f, "overridden by another order, at {position}"),
            Outcome::Fault(cause) => write!(f, "stopped by a fault: {cause}"),
            Outcome::Interrupted { state, position } => write!(f, "interrupted, now in {state}, at {position}"),
            Outcome::TimedOut { position } => write!(f, "not finished in time, at {position}"),
        }
    }
}

impl fmt::Display for VelocityOutcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            VelocityOutcome::Reached { velocity } => write!(f, "runs at {velocity}"),
            VelocityOutcome::Overridden { velocity } => write!(f, "overridden by another order, runs at {velocity}"),
            VelocityOutcome::Fault(cause) => write!(f, "stopped by a fault: {cause}"),
            VelocityOutcome::Interrupted { state } => write!(f, "interrupted, now in {state}"),
            VelocityOutcome::TimedOut { velocity } => write!(f, "not reached in time, runs at {velocity}"),
        }
    }
}

impl fmt::Display for HomingOutcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            HomingOutcome::Attained { position } => write!(f, "homed, at {position}"),
            HomingOutcome::Failed { status_word, position } => {
                write!(f, "no reference point found (status word {status_word:04X}), at {position}")
            }
            HomingOutcome::Fault(cause) => write!(f, "stopped by a fault: {cause}"),
            HomingOutcome::Interrupted { state, position } => write!(f, "interrupted, now in {state}, at {position}"),
            HomingOutcome::TimedOut { position } => write!(f, "not finished in time, at {position}"),
        }
    }
}
