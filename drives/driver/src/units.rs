//! Positions in the units of people: revolutions and millimetres, by gear ratio and spindle pitch.

/// What one count of a position is worth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Units {
    /// Increments per revolution, without a spindle.
    pub increments: u32,
    /// In 1/100 mm per revolution; 0 when positions are increments.
    pub spindle_pitch_10um: u32,
    /// Numerator of the external gear.
    pub numerator: u32,
    /// Its denominator.
    pub denominator: u32,
}

impl Units {
    /// Revolutions behind the external gear.
    #[must_use]
    pub fn revolutions(&self, position: i32) -> f64 {
        f64::from(position) / self.per_revolution()
    }

    /// Revolutions of the drive's own shaft, before the external gear.
    #[must_use]
    pub fn shaft_revolutions(&self, position: i32) -> f64 {
        self.revolutions(position) * f64::from(self.numerator) / f64::from(self.denominator)
    }

    /// Millimetres; `None` without a spindle pitch.
    #[must_use]
    pub fn millimetres(&self, position: i32) -> Option<f64> {
        (self.spindle_pitch_10um != 0).then(|| f64::from(position) / 100.0)
    }

    /// The nearest position to these revolutions behind the gear; `None` if it is out of range.
    #[must_use]
    pub fn position_of_revolutions(&self, revolutions: f64) -> Option<i32> {
        to_position(revolutions * self.per_revolution())
    }

    /// The nearest position to these millimetres; `None` without a spindle pitch or if it is out of range.
    #[must_use]
    pub fn position_of_millimetres(&self, millimetres: f64) -> Option<i32> {
        if self.spindle_pitch_10um == 0 { None } else { to_position(millimetres * 100.0) }
    }

    fn per_revolution(&self) -> f64 {
        match self.spindle_pitch_10um {
            0 => f64::from(self.increments),
            pitch => f64::from(pitch),
        }
    }
}

fn to_position(counts: f64) -> Option<i32> {
    let rounded = counts.round();
    (rounded >= f64::from(i32::MIN) && rounded <= f64::from(i32::MAX)).then_some(rounded as i32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_a_spindle_positions_are_increments() {
        let units = Units { increments: 1600, spindle_pitch_10um: 0, numerator: 5, denominator: 1 };
        assert_eq!((units.revolutions(1600), units.shaft_revolutions(1600)), (1.0, 5.0));
        assert_eq!(units.position_of_revolutions(-0.5), Some(-800));
        assert_eq!((units.millimetres(1), units.position_of_millimetres(1.0)), (None, None));
    }

    #[test]
    fn with_a_spindle_positions_are_hundredths_of_a_millimetre() {
        let units = Units { increments: 1600, spindle_pitch_10um: 200, numerator: 1, denominator: 1 };
        assert_eq!((units.millimetres(250), units.revolutions(250)), (Some(2.5), 1.25));
        assert_eq!(units.position_of_millimetres(-12.344), Some(-1234));
        assert_eq!(units.position_of_millimetres(f64::NAN), None);
        assert_eq!(units.position_of_revolutions(1e9), None);
    }
}
