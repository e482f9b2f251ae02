//! Interpolated position mode and the cyclic synchronous modes: a set-point with each SYNC.

use lexican_runtime::object::Address;
use lexican_runtime::profile::cia402::{Mode, control};
use lexican_runtime::{AbortCode, Duration, Instant};

use super::model::Servo;
use super::objects::*;
use super::parameters::{Parameters, period};
use super::parts::{Cycle, Cyclic, Limit, MICROSECOND, TINY};
use crate::storage::Storage;
use crate::trajectory::{State, Trajectory};

impl Servo {
    /// To call when an RPDO with a set-point of a cyclic mode has come. From then on, one is expected with each SYNC.
    pub fn set_point(&mut self) {
        self.cyclic.fresh = Some(true);
    }

    /// To call when SYNC has come, and its RPDOs are in the dictionary. [`Servo::update`] has been called before.
    pub fn sync(&mut self, now: Instant, od: &mut dyn Storage) {
        self.update(now, od);
        if self.inputs.ignores_sync || !self.is_cyclic() {
            return;
        }
        let parameters = self.parameters(od);
        let measured = self.cyclic.last_sync.map(|last| now - last).filter(|span| *span >= MICROSECOND);
        let Some(period) = self.cycle_period(&parameters).or(measured) else {
            self.cyclic.last_sync = Some(now);
            return;
        };
        let late = self.cyclic.fresh == Some(false);
        self.cyclic.fresh = self.cyclic.fresh.map(|_| false);
        self.cyclic.missed = if late { self.cyclic.missed + 1 } else { 0 };
        (self.cyclic.last_sync, self.cyclic.period) = (Some(now), period);
        if self.cyclic.missed > self.model.missed_cycles {
            self.raise(self.model.codes.cycle_missed, od);
        } else if !late {
            self.take_cycle(period, od);
        }
        self.update(now, od);
    }

    /// The time between two set-points; `None` if no object says it.
    fn cycle_period(&self, parameters: &Parameters<'_>) -> Option<Duration> {
        if self.model.cycle_step.is_some() { self.cycle.period } else { parameters.cycle() }
    }

    /// Makes 60C2h take effect, unless one of its entries is still to be written.
    pub(super) fn take_cycle_period(&mut self, od: &dyn Storage) {
        if self.model.cycle_step.is_some() && matches!(self.cycle.written, [true, true] | [false, false]) {
            self.cycle = Cycle { written: [false; 2], period: self.parameters(od).cycle() };
        }
    }

    /// Notes that a client has written an entry of 60C2h.
    pub(super) fn note_cycle_entry(&mut self, address: Address) {
        for (written, entry) in self.cycle.written.iter_mut().zip([CYCLE_UNITS, CYCLE_EXPONENT]) {
            *written |= entry == address;
        }
    }

    /// Checks a value of 60C2h: the second of its entries to be written decides the period.
    pub(crate) fn check_cycle(&self, od: &dyn Storage, address: Address, value: i64) -> Result<(), AbortCode> {
        let entries = [CYCLE_UNITS, CYCLE_EXPONENT];
        let Some(at) = entries.iter().position(|entry| *entry == address) else { return Ok(()) };
        let Some(step) = self.model.cycle_step.filter(|_| self.cycle.written[1 - at]) else { return Ok(()) };
        let parameters = self.parameters(od);
        let [units, exponent] = entries.map(|entry| if entry == address { value } else { parameters.number(entry) });
        let fits = period(units, exponent).is_some_and(|period| period.as_micros() % step.as_micros() == 0);
        if fits { Ok(()) } else { Err(AbortCode::INVALID_VALUE) }
    }

    /// Whether each SYNC takes a set-point.
    fn is_cyclic(&self) -> bool {
        let mode = match self.mode {
            Some(Mode::InterpolatedPosition) => self.cyclic.interpolates,
            mode => mode.is_some_and(Mode::is_cyclic),
        };
        mode && self.is_obeying() && !self.is_halted()
    }

    /// Status word, bit 12: the axis follows its set-points.
    pub(super) fn follows_cycle(&self) -> bool {
        self.is_cyclic()
    }

    /// Forgets the last SYNC while no set-points are taken, so that none counts as missed.
    pub(super) fn rest_cycle(&mut self) {
        if !self.is_cyclic() {
            (self.cyclic.last_sync, self.cyclic.missed) = (None, 0);
        }
    }

    /// The time after which the next SYNC counts as missed.
    pub(super) fn cycle_deadline(&self) -> Option<Instant> {
        let last = self.cyclic.last_sync.filter(|_| self.is_cyclic() && !self.cyclic.period.is_zero())?;
        // Half a cycle is added, since SYNC may be a little late.
        let cycles = 2 * self.model.missed_cycles + 3;
        Some(last + Duration::from_micros(self.cyclic.period.times(cycles).as_micros() / 2))
    }

    fn take_cycle(&mut self, period: Duration, od: &dyn Storage) {
        let parameters = self.parameters(od);
        let state = self.shaft(self.now);
        let seconds = period.as_secs_f64();
        match self.mode {
            Some(Mode::CyclicVelocity) => {
                let ordered = parameters.float(TARGET_VELOCITY) + parameters.float(VELOCITY_OFFSET);
                let velocity = ordered * parameters.velocity_sign() * parameters.velocity_scale();
                self.change_speed(velocity, seconds, &parameters, od);
            }
            Some(Mode::CyclicTorque) => {
                let ordered = parameters.float(TARGET_TORQUE) + parameters.float(TORQUE_OFFSET);
                let torque = self.limited_torque(ordered, &parameters);
                self.change_speed(torque * self.model.speed_per_torque, seconds, &parameters, od);
                if torque != ordered {
                    self.limit = Limit::Now;
                }
            }
            _ => {
                let address = if self.mode == Some(Mode::InterpolatedPosition) { SET_POINT_1 } else { TARGET_POSITION };
                let ordered = (parameters.float(address) + self.position_offset(&parameters))
                    * parameters.position_sign()
                    + self.zero;
                let target = self.within_limits(ordered, &parameters);
                let step = target - state.position;
                if parameters.following_window().is_some_and(|window| step.abs() > window) {
                    return self.raise(self.model.codes.following_error, od);
                }
                let velocity = (step / seconds).clamp(-parameters.top_speed(), parameters.top_speed());
                self.limit = if target == ordered { Limit::None } else { Limit::Now };
                let way = if velocity.abs() < TINY {
                    Trajectory::rest(self.now, state.position)
                } else {
                    Trajectory::steady(self.now, State { velocity, ..state })
                };
                self.begin(way, velocity.signum(), od);
            }
        }
    }

    fn position_offset(&self, parameters: &Parameters<'_>) -> f64 {
        if self.mode == Some(Mode::CyclicPosition) { parameters.float(POSITION_OFFSET) } else { 0.0 }
    }

    /// Changes to another velocity within one cycle.
    fn change_speed(&mut self, ordered: f64, seconds: f64, parameters: &Parameters<'_>, od: &dyn Storage) {
        let velocity = ordered.clamp(-parameters.top_speed(), parameters.top_speed());
        let state = self.shaft(self.now);
        self.limit = if velocity == ordered { Limit::None } else { Limit::Now };
        let acceleration = ((velocity - state.velocity).abs() / seconds).max(TINY);
        self.begin(Trajectory::ramp(self.now, state, velocity, acceleration), velocity.signum(), od);
    }

    /// Follows bit 4 of the control word, which enables interpolation.
    pub(super) fn follow_interpolation(&mut self, od: &dyn Storage) {
        let enabled = self.control & control::NEW_SET_POINT != 0;
        if self.cyclic.interpolates && !enabled {
            self.brake(self.parameters(od).slow_down());
        }
        if self.cyclic.interpolates != enabled {
            self.cyclic = Cyclic { interpolates: enabled, ..Cyclic::default() };
        }
    }
}
