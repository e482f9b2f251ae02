//! The motion that the modes order, and its limits.

use lexican_runtime::profile::cia402::Mode;

use super::model::Servo;
use super::objects::*;
use super::parameters::Parameters;
use super::parts::{Limit, TINY};
use crate::storage::Storage;
use crate::trajectory::{Profile, State, Trajectory};

impl Servo {
    /// Follows the targets that the mode obeys without an edge.
    pub(super) fn take_targets(&mut self, od: &mut dyn Storage) {
        if !self.is_obeying() {
            return;
        }
        match self.mode {
            Some(Mode::ProfilePosition) => self.follow_set_points(od),
            Some(Mode::ProfileVelocity) if !self.is_halted() => self.run(od),
            Some(Mode::ProfileTorque) if !self.is_halted() => self.push(od),
            Some(Mode::InterpolatedPosition) => self.follow_interpolation(od),
            _ => {}
        }
    }

    /// Profile velocity mode: 60FFh with 6083h and 6084h.
    fn run(&mut self, od: &dyn Storage) {
        let parameters = self.parameters(od);
        let ordered = parameters.float(TARGET_VELOCITY) * parameters.velocity_sign() * parameters.velocity_scale();
        let Profile { acceleration, deceleration, .. } = parameters.profile();
        let target = ordered.clamp(-parameters.top_speed(), parameters.top_speed());
        let order = [target, acceleration, deceleration, ordered];
        if self.running == Some(order) {
            return;
        }
        self.running = Some(order);
        self.limit = if target == ordered { Limit::None } else { Limit::Now };
        let state = self.shaft(self.now);
        let profile = Profile { speed: target.abs(), acceleration, deceleration };
        let sign = if target == 0.0 { state.velocity.signum() } else { target.signum() };
        let (low, high) = self.software_limits(&parameters);
        let end = if sign < 0.0 { low } else { high };
        let way = if target.abs() < TINY || !end.is_finite() {
            Trajectory::run(self.now, state, sign, profile)
        } else if (end - state.position) * sign <= 0.0 {
            self.limit = Limit::AtEnd;
            Trajectory::ramp(self.now, state, 0.0, deceleration)
        } else {
            self.limit = Limit::AtEnd;
            Trajectory::through(self.now, state, &[end], profile)
        };
        self.begin(way, sign, od);
    }

    /// Torque mode: 6071h with 6087h. The axis turns in proportion to the torque.
    fn push(&mut self, od: &dyn Storage) {
        let parameters = self.parameters(od);
        let ordered = parameters.float(TARGET_TORQUE) + parameters.float(TORQUE_OFFSET);
        let target = self.limited_torque(ordered, &parameters);
        let slope = self.torque_slope(&parameters);
        let order = [target, slope, slope, ordered];
        if self.running != Some(order) {
            self.running = Some(order);
            self.limit = if target == ordered { Limit::None } else { Limit::Now };
            let way = Trajectory::ramp(self.now, self.shaft(self.now), target * self.model.speed_per_torque, slope);
            self.begin(way, target.signum(), od);
        }
    }

    /// Limits a torque to 6072h and 6073h, if they are not 0: torque is proportional to current.
    pub(super) fn limited_torque(&self, ordered: f64, parameters: &Parameters<'_>) -> f64 {
        let limits = [MAX_TORQUE, MAX_CURRENT].map(|limit| parameters.float(limit));
        let most = limits.into_iter().filter(|limit| *limit > 0.0).fold(f64::INFINITY, f64::min);
        ordered.clamp(-most, most)
    }

    /// Begins a motion in the direction of `sign`. A limit switch ahead ends it.
    pub(super) fn begin(&mut self, way: Trajectory, sign: f64, od: &dyn Storage) {
        self.way = match self.inputs.machine.limit(sign) {
            Some(limit) if way.passes(limit, sign).is_some() => {
                self.limit = Limit::AtEnd;
                way.stopping_behind(limit, sign, self.parameters(od).quick_stop())
            }
            _ => way,
        };
        if self.held.is_some() && self.way.end().is_some_and(|end| end <= self.now) {
            self.held = None;
        }
    }

    /// The software limits (607Dh) as shaft positions; infinite without limits.
    pub(super) fn software_limits(&self, parameters: &Parameters<'_>) -> (f64, f64) {
        let of_start = self.limits.flatten().filter(|_| self.model.limits_from_start);
        let of_now = || parameters.range(LIMIT_MIN, LIMIT_MAX).filter(|_| !self.model.limits_from_start);
        let Some((low, high)) = of_start.or_else(of_now) else {
            return (f64::NEG_INFINITY, f64::INFINITY);
        };
        let sign = parameters.position_sign();
        let (a, b) = (low * sign + self.zero, high * sign + self.zero);
        (a.min(b), a.max(b))
    }

    pub(super) fn within_limits(&self, target: f64, parameters: &Parameters<'_>) -> f64 {
        let (low, high) = self.software_limits(parameters);
        target.clamp(low, high)
    }

    /// The value of 6064h for a position of the shaft.
    pub(super) fn shown(&self, position: f64, parameters: &Parameters<'_>) -> f64 {
        let shown = ((position - self.zero) * parameters.position_sign()).round();
        match parameters.range(RANGE_MIN, RANGE_MAX) {
            Some((low, high)) => low + (shown - low).rem_euclid(high - low + 1.0),
            None => shown,
        }
    }

    /// The demanded position and velocity at the present time.
    pub(super) fn demanded(&self) -> State {
        self.way.at(self.now)
    }
}
