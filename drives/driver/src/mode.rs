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
    /// Turn with a torque.
    Torque,
    /// Find the reference point.
    Homing,
    /// Follow interpolated positions (60C1h).
    InterpolatedPosition,
    /// Follow a position per cycle (607Ah).
    CyclicPosition,
    /// Follow a velocity per cycle (60FFh).
    CyclicVelocity,
    /// Follow a torque per cycle (6071h).
    CyclicTorque,
}

impl Mode {
    /// All of them.
    pub const ALL: [Mode; 8] = [
        Mode::Positioning,
        Mode::Velocity,
        Mode::Torque,
        Mode::Homing,
        Mode::InterpolatedPosition,
        Mode::CyclicPosition,
        Mode::CyclicVelocity,
        Mode::CyclicTorque,
    ];

    /// What CiA 402 calls it. Its number is the description's.
    #[must_use]
    pub const fn in_profile(self) -> cia402::Mode {
        match self {
            Mode::Positioning => cia402::Mode::ProfilePosition,
            Mode::Velocity => cia402::Mode::ProfileVelocity,
            Mode::Torque => cia402::Mode::ProfileTorque,
            Mode::Homing => cia402::Mode::Homing,
            Mode::InterpolatedPosition => cia402::Mode::InterpolatedPosition,
            Mode::CyclicPosition => cia402::Mode::CyclicPosition,
            Mode::CyclicVelocity => cia402::Mode::CyclicVelocity,
            Mode::CyclicTorque => cia402::Mode::CyclicTorque,
        }
    }
}

impl fmt::Display for Mode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Mode::Positioning => "positioning",
            Mode::Velocity => "velocity",
            Mode::Torque => "torque",
            Mode::Homing => "homing",
            Mode::InterpolatedPosition => "interpolated position",
            Mode::CyclicPosition => "cyclic position",
            Mode::CyclicVelocity => "cyclic velocity",
            Mode::CyclicTorque => "cyclic torque",
        })
    }
}
