//! The parameters of chapter 6 as numbers, converted for the motion.

use super::address;
use super::eeprom::NonVolatile;
use super::motion::{FULL_ACCELERATION, INCREMENTS_PER_REVOLUTION, Limits, Loop, REVOLUTION_PER_MINUTE};
use super::trajectory::Profile;
use crate::model::Model;
pub use crate::state::Mode;
use lexican_driver::Direction;
use simulator::Storage;

/// The parameters in the units of their objects, each with its number in the manual.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Parameters {
    /// 4: acceleration of positioning, in percent.
    pub a_pos: u8,
    /// 5: velocity of positioning, in rev/min.
    pub v_pos: u8,
    /// 6: acceleration in velocity mode, in percent.
    pub a_rot: u8,
    /// 8: acceleration of inching, in percent.
    pub a_inch: u8,
    /// 9: velocity of inching, in rev/min.
    pub v_inch: u8,
    /// 10: window around the target, in units of position, or in rev/min in velocity mode.
    pub window: u16,
    /// 11: numerator of an external gear.
    pub numerator: u16,
    /// 12: denominator of an external gear.
    pub denominator: u16,
    /// 13: spindle pitch in 1/100 mm; 0 when positions are increments.
    pub spindle_pitch: u16,
    /// 14: the position after calibration.
    pub calibration_value: i32,
    /// 15 and 16, in any order.
    pub limits: [i32; 2],
    /// 17: width of inching operation 1.
    pub delta_inch: i32,
    /// 18: whether the sense of rotation is 'e'.
    pub counts_down: bool,
    /// 19: 0 direct, 1 loop +, 2 loop -.
    pub positioning_type: u8,
    /// 20: the operating mode.
    pub mode: Mode,
    /// 24 in positioning mode: 607Ah.
    pub target_position: i32,
    /// 24 in velocity mode: 60FFh, in rev/min.
    pub target_velocity: i32,
    /// 25: how inching operation 2 stops: 0 with full deceleration, 1 with that of inching.
    pub inching_stop: u8,
    /// 26: 0 holds the position, 1 shorts the windings, 2 releases the motor.
    pub in_position_mode: u8,
    /// 27: loop length in increments.
    pub loop_length: u16,
    /// 29: threshold of torque deactivation in percent; 125 for none.
    pub torque_deactivation: u8,
    /// 30: velocity of inching operation 2, in percent of v-Inch.
    pub inching_2_offset: u8,
    /// 31: deceleration of positioning in percent; 101 to use a-Pos.
    pub d_pos: u8,
}

impl Parameters {
    /// Reads the parameters from the objects of a drive. If an object is missing, the parameter comes from `kept`, or
    /// has its usual value.
    pub(super) fn read(model: &Model, storage: &dyn Storage, kept: &NonVolatile) -> Self {
        let usual = Parameters::default();
        macro_rules! number {
            ($address:ident, $usual:expr) => {
                storage.number(address::$address).map_or($usual, |number| number as _)
            };
        }
        Parameters {
            a_pos: number!(A_POS, usual.a_pos),
            v_pos: number!(V_POS, usual.v_pos),
            a_rot: number!(A_ROT, usual.a_rot),
            a_inch: number!(A_INCH, usual.a_inch),
            v_inch: number!(V_INCH, usual.v_inch),
            window: number!(WINDOW, usual.window),
            numerator: number!(GEAR_NUMERATOR, usual.numerator),
            denominator: number!(GEAR_DENOMINATOR, usual.denominator),
            spindle_pitch: number!(SPINDLE_PITCH, usual.spindle_pitch),
            calibration_value: number!(CALIBRATION_VALUE, usual.calibration_value),
            limits: [number!(LIMIT_2, usual.limits[0]), number!(LIMIT_1, usual.limits[1])],
            delta_inch: number!(DELTA_INCH, usual.delta_inch),
            counts_down: storage.number(address::SENSE_OF_ROTATION) == Some(1),
            positioning_type: number!(POSITIONING_TYPE, usual.positioning_type),
            mode: if storage.number(address::MODE) == Some(2) { Mode::Velocity } else { Mode::Positioning },
            target_position: number!(TARGET_POSITION, usual.target_position),
            target_velocity: number!(TARGET_VELOCITY, usual.target_velocity),
            inching_stop: number!(INCHING_STOP, kept.inching_stop),
            in_position_mode: number!(IN_POSITION_MODE, usual.in_position_mode),
            loop_length: number!(LOOP_LENGTH, model.loop_length),
            torque_deactivation: number!(TORQUE_DEACTIVATION, usual.torque_deactivation),
            inching_2_offset: number!(INCHING_2_OFFSET, usual.inching_2_offset),
            d_pos: number!(D_POS, usual.d_pos),
        }
    }

    /// The profile of positioning.
    #[must_use]
    pub fn positioning(&self) -> Profile {
        let deceleration = if self.d_pos > 100 { self.a_pos } else { self.d_pos };
        Profile { speed: speed(self.v_pos), acceleration: percent(self.a_pos), deceleration: percent(deceleration) }
    }

    /// The profile of inching operation 1.
    #[must_use]
    pub fn step(&self) -> Profile {
        let acceleration = percent(self.a_inch);
        Profile { speed: speed(self.v_inch), acceleration, deceleration: acceleration }
    }

    /// The profile of inching operation 2.
    #[must_use]
    pub fn inching(&self) -> Profile {
        let speed = speed(self.v_inch) * f64::from(self.inching_2_offset.max(1)) / 100.0;
        let deceleration = if self.inching_stop == 0 { FULL_ACCELERATION } else { percent(self.a_inch) };
        Profile { speed, acceleration: percent(self.a_inch), deceleration }
    }

    /// The acceleration of velocity mode, in increments/s².
    #[must_use]
    pub fn rotation(&self) -> f64 {
        percent(self.a_rot)
    }

    /// The target velocity, in increments/s.
    #[must_use]
    pub fn velocity(&self) -> f64 {
        f64::from(self.target_velocity) * REVOLUTION_PER_MINUTE
    }

    /// The loop; `None` for direct positioning.
    #[must_use]
    pub fn by_loop(&self) -> Option<Loop> {
        let approach = match self.positioning_type {
            1 => Direction::Positive,
            2 => Direction::Negative,
            _ => return None,
        };
        Some(Loop { approach, length: f64::from(self.loop_length) / self.increments_per_shaft_increment() })
    }

    /// The limits in units of position, ascending; `None` if both are equal, which disables monitoring.
    #[must_use]
    pub fn position_limits(&self) -> Option<(i32, i32)> {
        let [a, b] = self.limits;
        (a != b).then(|| (a.min(b), a.max(b)))
    }

    /// The limits in increments of the shaft.
    #[must_use]
    pub fn shaft_limits(&self) -> Option<Limits> {
        let (low, high) = self.position_limits()?;
        Some(Limits { low: self.shaft(low), high: self.shaft(high) })
    }

    /// The value of 6064h for a shaft position in increments.
    #[must_use]
    pub fn position(&self, shaft: f64) -> i32 {
        // Saturating, since the manual does not say at which position the absolute encoder wraps around.
        (shaft * self.units_per_shaft_increment()).round() as i32
    }

    /// The shaft position in increments for a value of 6064h.
    #[must_use]
    pub fn shaft(&self, position: i32) -> f64 {
        f64::from(position) / self.units_per_shaft_increment()
    }

    fn units_per_shaft_increment(&self) -> f64 {
        let pitch = match self.spindle_pitch {
            0 => 1.0,
            pitch => f64::from(pitch) / INCREMENTS_PER_REVOLUTION,
        };
        self.increments_per_shaft_increment() * pitch
    }

    /// A 5:1 reduction (numerator 5, denominator 1): the output turns once for five turns of the drive's shaft.
    fn increments_per_shaft_increment(&self) -> f64 {
        f64::from(self.denominator.max(1)) / f64::from(self.numerator.max(1))
    }
}

/// Factory settings.
impl Default for Parameters {
    fn default() -> Self {
        Parameters {
            a_pos: 50,
            v_pos: 30,
            a_rot: 50,
            a_inch: 50,
            v_inch: 30,
            window: 10,
            numerator: 1,
            denominator: 1,
            spindle_pitch: 0,
            calibration_value: 0,
            limits: [-1_000_000, 1_000_000],
            delta_inch: 1600,
            counts_down: false,
            positioning_type: 0,
            mode: Mode::Positioning,
            target_position: 0,
            target_velocity: 0,
            inching_stop: 0,
            in_position_mode: 0,
            loop_length: 800,
            torque_deactivation: 125,
            inching_2_offset: 100,
            d_pos: 101,
        }
    }
}

// With 0 a motion would never end. The objects do not allow 0, but a table might.
fn percent(percent: u8) -> f64 {
    FULL_ACCELERATION * f64::from(percent.max(1)) / 100.0
}

fn speed(revolutions_per_minute: u8) -> f64 {
    f64::from(revolutions_per_minute.max(1)) * REVOLUTION_PER_MINUTE
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(numerator: u16, denominator: u16, spindle_pitch: u16, revolutions: f64, position: i32) {
        let parameters = Parameters { numerator, denominator, spindle_pitch, ..Parameters::default() };
        let shaft = revolutions * INCREMENTS_PER_REVOLUTION;
        assert_eq!(parameters.position(shaft), position);
        assert!((parameters.shaft(position) - shaft).abs() < 1e-6);
    }

    #[test]
    fn positions_count_increments_or_hundredths_of_a_millimetre() {
        check(1, 1, 0, 1.0, 1600);
        check(5, 1, 0, 5.0, 1600);
        check(378, 100, 0, 3.78, 1600);
        // A pitch of 2 mm: 200.
        check(1, 1, 200, 1.0, 200);
        check(5, 1, 200, -10.0, -400);
    }

    #[test]
    fn a_deceleration_of_101_is_that_of_the_acceleration() {
        let with = |d_pos| Parameters { a_pos: 25, d_pos, ..Parameters::default() }.positioning().deceleration;
        assert_eq!((with(101), with(100), with(1)), (1600.0, 6400.0, 64.0));
    }

    #[test]
    fn the_loop_is_counted_behind_the_gear() {
        let parameters = Parameters { numerator: 5, positioning_type: 2, spindle_pitch: 200, ..Parameters::default() };
        let by_loop = parameters.by_loop().unwrap();
        assert_eq!((by_loop.length, by_loop.approach), (4000.0, Direction::Negative));
        assert_eq!(Parameters::default().by_loop(), None);
    }

    #[test]
    fn inching_stops_fully_or_as_programmed() {
        let with = |inching_stop| Parameters { inching_stop, ..Parameters::default() }.inching().deceleration;
        assert_eq!((with(0), with(1)), (6400.0, 3200.0));
        let slow = Parameters { inching_2_offset: 10, ..Parameters::default() };
        assert!((slow.inching().speed - 3.0 * REVOLUTION_PER_MINUTE).abs() < 1e-9);
    }
}
