//! Modes of operation (6060h, 6061h): CiA 402-2, 8.3.

/// A mode of operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "the names say what it is")]
pub enum Mode {
    ProfilePosition,
    /// Velocity mode of frequency converters.
    Velocity,
    ProfileVelocity,
    ProfileTorque,
    Homing,
    InterpolatedPosition,
    /// Cyclic synchronous position mode.
    CyclicPosition,
    /// Cyclic synchronous velocity mode.
    CyclicVelocity,
    /// Cyclic synchronous torque mode.
    CyclicTorque,
}

/// Which number means which mode in a device.
#[derive(Clone, Copy, Debug)]
pub struct Modes(pub &'static [(i8, Mode)]);

impl Modes {
    /// The numbers of CiA 402.
    pub const CIA_402: Modes = Modes(&[
        (1, Mode::ProfilePosition),
        (2, Mode::Velocity),
        (3, Mode::ProfileVelocity),
        (4, Mode::ProfileTorque),
        (6, Mode::Homing),
        (7, Mode::InterpolatedPosition),
        (8, Mode::CyclicPosition),
        (9, Mode::CyclicVelocity),
        (10, Mode::CyclicTorque),
    ]);

    /// The number of a mode; `None` when the device does not have it.
    #[must_use]
    pub fn code(&self, mode: Mode) -> Option<i8> {
        self.0.iter().find(|(_, other)| *other == mode).map(|(code, _)| *code)
    }

    /// The mode of a number; `None` when the device does not have it.
    #[must_use]
    pub fn mode(&self, code: i8) -> Option<Mode> {
        self.0.iter().find(|(other, _)| *other == code).map(|(_, mode)| *mode)
    }
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
