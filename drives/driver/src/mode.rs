//! The operating modes that the driver knows.

use std::fmt;

use lexican_runtime::profile::cia402;

macro_rules! modes {
    ($($(#[$doc:meta])* $mode:ident = $in_profile:ident, $name:literal;)*) => {
        /// An operating mode (6060h).
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum Mode { $($(#[$doc])* $mode,)* }

        impl Mode {
            /// All of them.
            pub const ALL: &[Mode] = &[$(Mode::$mode),*];

            /// The mode of CiA 402. Its number is in the description.
            #[must_use]
            pub const fn in_profile(self) -> cia402::Mode {
                match self { $(Mode::$mode => cia402::Mode::$in_profile,)* }
            }
        }

        impl fmt::Display for Mode {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(match self { $(Mode::$mode => $name,)* })
            }
        }
    };
}

modes! {
    /// Travel to positions, and inching.
    Positioning = ProfilePosition, "positioning";
    /// Run at a velocity.
    Velocity = ProfileVelocity, "velocity";
    /// Turn with a torque.
    Torque = ProfileTorque, "torque";
    /// Find the reference point.
    Homing = Homing, "homing";
    /// Follow interpolated positions (60C1h).
    InterpolatedPosition = InterpolatedPosition, "interpolated position";
    /// Follow a position per cycle (607Ah).
    CyclicPosition = CyclicPosition, "cyclic position";
    /// Follow a velocity per cycle (60FFh).
    CyclicVelocity = CyclicVelocity, "cyclic velocity";
    /// Follow a torque per cycle (6071h).
    CyclicTorque = CyclicTorque, "cyclic torque";
}
