//! The typed driver: what the drive can do, in its own words.
//!
//! ```text
//! Drive               a thin blocking shell over a link; `tokio::Drive` is the asynchronous one
//!   Session           the four verbs: frames and deadlines in, frames and deadlines out
//!     sequence::...   what to do, step by step, written once as async functions
//!       Desk          where sequences and session meet
//!         Description what is particular to this drive, as data
//! ```

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
