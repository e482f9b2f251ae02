//! CiA 402: modes of operation (6060h, 6061h; CiA 402-2, 8.3), and the objects in PDOs of drives.

macro_rules! modes {
    ($($(#[$doc:meta])* $mode:ident = $number:literal, $name:literal, $object:literal;)*) => {
        /// A mode of operation.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        #[allow(missing_docs, reason = "the names say what it is")]
        pub enum Mode { $($(#[$doc])* $mode,)* }

        impl Mode {
            /// The name in CiA 402, without "mode".
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self { $(Mode::$mode => $name,)* }
            }

            /// The object that the mode requires: its target, or the homing method.
            #[must_use]
            pub const fn object(self) -> u16 {
                match self { $(Mode::$mode => $object,)* }
            }

            /// The values of 6060h and 6061h with their names.
            pub const VALUES: &[(i128, &str)] = &[(0, "none"), $(($number, $name)),*];

            /// The bits of 6502h: the lowest, the highest, the name.
            pub const SUPPORTED: &[(u8, u8, &str)] =
                &[$(($number - 1, $number - 1, $name),)* (16, 31, "manufacturer specific")];
        }

        impl Modes {
            /// The numbers in CiA 402, ascending.
            pub const CIA_402: Modes = Modes(&[$(($number, Mode::$mode)),*]);
        }
    };
}

modes! {
    ProfilePosition = 1, "profile position", 0x607A;
    /// Velocity mode of frequency converters.
    Velocity = 2, "velocity", 0x6042;
    ProfileVelocity = 3, "profile velocity", 0x60FF;
    ProfileTorque = 4, "torque profile", 0x6071;
    Homing = 6, "homing", 0x6098;
    InterpolatedPosition = 7, "interpolated position", 0x60C1;
    /// Cyclic synchronous position mode.
    CyclicPosition = 8, "cyclic synchronous position", 0x607A;
    /// Cyclic synchronous velocity mode.
    CyclicVelocity = 9, "cyclic synchronous velocity", 0x60FF;
    /// Cyclic synchronous torque mode.
    CyclicTorque = 10, "cyclic synchronous torque", 0x6071;
}

impl Mode {
    /// Whether the drive takes a set-point with each SYNC, as the cyclic synchronous modes do.
    #[must_use]
    pub const fn is_cyclic(self) -> bool {
        matches!(self, Mode::CyclicPosition | Mode::CyclicVelocity | Mode::CyclicTorque)
    }

    /// Whether the target is a torque (6071h).
    #[must_use]
    pub const fn is_torque(self) -> bool {
        self.object() == 0x6071
    }
}

/// The numbers of the modes in a device, which may differ from CiA 402.
#[derive(Clone, Copy, Debug)]
pub struct Modes(pub &'static [(i8, Mode)]);

impl Modes {
    /// The number of a mode; `None` if the device lacks it.
    #[must_use]
    pub fn code(&self, mode: Mode) -> Option<i8> {
        self.0.iter().find(|(_, other)| *other == mode).map(|(code, _)| *code)
    }

    /// The mode with a number; `None` if the device lacks it.
    #[must_use]
    pub fn mode(&self, code: i8) -> Option<Mode> {
        self.0.iter().find(|(other, _)| *other == code).map(|(_, mode)| *mode)
    }
}

/// A part of a drive's PDO.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Signal {
    /// 6040h.
    ControlWord,
    /// 6041h.
    StatusWord,
    /// 607Ah.
    TargetPosition,
    /// 60FFh.
    TargetVelocity,
    /// This many bytes of other objects: a driver sends zeros, and ignores what it receives.
    Other(u8),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_is_a_mode_and_back() {
        for &(code, mode) in Modes::CIA_402.0 {
            assert_eq!((Modes::CIA_402.mode(code), Modes::CIA_402.code(mode)), (Some(mode), Some(code)));
        }
        let simple = Modes(&[(1, Mode::ProfilePosition), (2, Mode::ProfileVelocity)]);
        assert_eq!((simple.mode(2), simple.code(Mode::Homing)), (Some(Mode::ProfileVelocity), None));
    }
}
