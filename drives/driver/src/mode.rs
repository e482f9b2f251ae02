//! The operating modes that the driver knows.

use std::fmt;

use lexican_runtime::profile::cia402;

/// An operating mode (6060h).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Mode {
    /// Travel to positions, and inching.
    Positioning,
    /// Run at a velocity.
    Velocity,
}

impl Mode {
    /// What CiA 402 calls it. Its number is the description's.
    #[must_use]
    pub const fn in_profile(self) -> cia402::Mode {
        match self {
            Mode::Positioning => cia402::Mode::ProfilePosition,
            Mode::Velocity => cia402::Mode::ProfileVelocity,
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
