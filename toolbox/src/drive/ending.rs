//! How orders end.

use std::fmt;

use lexican_driver::{Cause, HomingOutcome, Outcome, VelocityOutcome};
use lexican_runtime::profile::cia402::State;

/// How an order has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// The order is carried out: the drive is enabled, at its target, at its reference point, or at a standstill.
    Reached,
    /// A fault has been reset.
    Reset(Cause),
    /// It stopped at a limit.
    Limit,
    /// Its load has blocked it.
    Blocked,
    /// It stands still without having carried out the order: its shaft is blocked, or another manager has stopped it.
    /// The order may still be in force.
    Stalled,
    /// Another manager has given another order.
    ForeignOrder,
    /// A fault has stopped it.
    Fault(Cause),
    /// Something else has ended it: a quick stop, a lost supply. With the state that the drive is in.
    Interrupted(State),
    /// It has not found its reference point.
    NotHomed,
    /// The time is up, and the drive is still moving.
    TimedOut,
}

impl Ending {
    /// One word, for programs.
    #[must_use]
    pub const fn word(&self) -> &'static str {
        match self {
            Ending::Reached => "reached",
            Ending::Reset(_) => "reset",
            Ending::Limit => "limit",
            Ending::Blocked => "blocked",
            Ending::Stalled => "stalled",
            Ending::ForeignOrder => "foreign-order",
            Ending::Fault(_) => "fault",
            Ending::Interrupted(_) => "interrupted",
            Ending::NotHomed => "not-homed",
            Ending::TimedOut => "timed-out",
        }
    }

    /// Whether the order has been carried out.
    #[must_use]
    pub const fn is_success(&self) -> bool {
        matches!(self, Ending::Reached | Ending::Reset(_))
    }

    /// What to do about it.
    #[must_use]
    pub const fn remedy(&self) -> Option<&'static str> {
        match self {
            Ending::Reached | Ending::Reset(_) => None,
            Ending::Limit => Some("move it back inside its limits, or change them (607Dh)"),
            Ending::Blocked => Some("see what holds its shaft; then give the order again"),
            Ending::Stalled => Some("see what holds its shaft, or which other manager has stopped it"),
            Ending::ForeignOrder => {
                Some("stop the other manager, such as the machine's controller, before you move the drive")
            }
            Ending::Fault(_) => Some("remove its cause, then reset the fault"),
            Ending::Interrupted(_) => {
                Some("look for a quick stop, a safety function, or a supply that failed; then enable it")
            }
            Ending::NotHomed => Some("see whether it passes its switch, and whether the homing method (6098h) fits it"),
            Ending::TimedOut => Some("allow it more time, or see what slows it down"),
        }
    }
}

impl fmt::Display for Ending {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Ending::Reached => f.write_str("reached"),
            Ending::Reset(cause) => write!(f, "the fault has been reset: {cause}"),
            Ending::Limit => f.write_str("stopped by a limit"),
            Ending::Blocked => f.write_str("stopped by its load: the shaft is blocked"),
            Ending::Stalled => f.write_str("it stands, and has not done what was ordered"),
            Ending::ForeignOrder => f.write_str("another manager has given it another order"),
            Ending::Fault(cause) => write!(f, "stopped by a fault: {cause}"),
            Ending::Interrupted(state) => write!(f, "interrupted: it is in {state} now"),
            Ending::NotHomed => f.write_str("no reference point found"),
            Ending::TimedOut => f.write_str("not finished in time"),
        }
    }
}

impl From<Outcome> for Ending {
    fn from(outcome: Outcome) -> Self {
        match outcome {
            Outcome::Reached { .. } => Ending::Reached,
            Outcome::Limit { .. } => Ending::Limit,
            Outcome::TorqueDeactivated { .. } => Ending::Blocked,
            Outcome::Overridden { .. } => Ending::ForeignOrder,
            Outcome::Fault(cause) => Ending::Fault(cause),
            Outcome::Interrupted { state, .. } => Ending::Interrupted(state),
            Outcome::TimedOut { .. } => Ending::TimedOut,
        }
    }
}

impl From<VelocityOutcome> for Ending {
    fn from(outcome: VelocityOutcome) -> Self {
        match outcome {
            VelocityOutcome::Reached { .. } => Ending::Reached,
            VelocityOutcome::Overridden { .. } => Ending::ForeignOrder,
            VelocityOutcome::Fault(cause) => Ending::Fault(cause),
            VelocityOutcome::Interrupted { state } => Ending::Interrupted(state),
            VelocityOutcome::TimedOut { .. } => Ending::TimedOut,
        }
    }
}

impl From<HomingOutcome> for Ending {
    fn from(outcome: HomingOutcome) -> Self {
        match outcome {
            HomingOutcome::Attained { .. } => Ending::Reached,
            HomingOutcome::Failed { .. } => Ending::NotHomed,
            HomingOutcome::Fault(cause) => Ending::Fault(cause),
            HomingOutcome::Interrupted { state, .. } => Ending::Interrupted(state),
            HomingOutcome::TimedOut { .. } => Ending::TimedOut,
        }
    }
}
