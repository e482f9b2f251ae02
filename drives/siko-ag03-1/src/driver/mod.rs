//! The typed driver: what the drive can do, in its own words.
//!
//! ```text
//! Drive               a thin blocking shell over a link; `tokio::Drive` is the asynchronous one
//!   Session           the four verbs: frames and deadlines in, frames and deadlines out
//!     sequence::...   what to do, step by step, written once as async functions
//!       Desk          where sequences and session meet
//!         Description what is particular to this drive, as data
//! ```
//!
//! # What stops the drive when the application does not
//!
//! A `Drive` that is dropped, also by a panic that unwinds, sends a stop if the drive may be moving. That is all
//! that the driver can do: **nothing here supervises the process that it runs in.** After SIGKILL, `abort`, a
//! crash of the machine or a cable that breaks, nobody sends that stop: a travel goes on to its target, and
//! inching and velocity mode go on until something else ends them.
//!
//! The drive itself can watch over its manager, by life guarding (7.2.11), which is off unless it is armed:
//! write [`GUARD_TIME`](crate::od::GUARD_TIME) (100Ch, ms) and [`LIFE_TIME_FACTOR`](crate::od::LIFE_TIME_FACTOR)
//! (100Dh), and request the node's state (a remote frame on 700h + node-ID) at least once per guard time. Once the
//! first request has come, and then none for guard time times factor, the drive goes to SWITCH ON DISABLED, where its motor has no
//! torque. Life guarding and heartbeats exclude each other (1017h must be 0). The driver sends no such requests:
//! they must come from the process that is to be watched over. None of this replaces an emergency stop.

mod blocking;
mod description;
mod desk;
mod error;
pub mod sequence;
mod session;
#[cfg(feature = "tokio")]
pub mod tokio;
mod units;

use std::fmt;

pub use blocking::Drive;
pub use description::{AG03_1, ControlBits, Description, StatusBits, SystemBits};
pub use desk::Desk;
pub use error::{Error, Missing, Outcome, Refusal, VelocityOutcome};
pub use session::Session;
pub use units::Units;

use crate::od::OperatingMode;

/// An operating mode (6060h).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Mode {
    /// Travel to positions, and inching.
    Positioning,
    /// Run at a velocity.
    Velocity,
}

impl Mode {
    /// The mode of an object's value; `None` when the drive has no such mode.
    #[must_use]
    pub fn of(object: OperatingMode) -> Option<Self> {
        match object {
            OperatingMode::PROFILE_POSITION => Some(Mode::Positioning),
            OperatingMode::PROFILE_VELOCITY => Some(Mode::Velocity),
            _ => None,
        }
    }

    /// The value of 6060h.
    #[must_use]
    pub const fn object(self) -> OperatingMode {
        match self {
            Mode::Positioning => OperatingMode::PROFILE_POSITION,
            Mode::Velocity => OperatingMode::PROFILE_VELOCITY,
        }
    }
}

impl fmt::Display for Mode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Mode::Positioning => "positioning",
            Mode::Velocity => "velocity",
        })
    }
}
