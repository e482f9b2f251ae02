//! What the servo reports: status word and measured values.

use lexican_runtime::object::Address;
use lexican_runtime::profile::cia402::{Mode, State, status};
use lexican_runtime::wire::emcy::ErrorRegister;

use super::model::Servo;
use super::objects::*;
use super::parts::{Homing, Limit, TINY};
use super::power::register_of;
use crate::storage::Storage;

impl Servo {
    fn status_word(&self, od: &dyn Storage) -> u16 {
        let flag = |set: bool, bit: u16| if set { bit } else { 0 };
        let open = self.model.left_open.iter().filter(|(state, _)| *state == self.state);
        self.state.status_bits() & open.fold(u16::MAX, |bits, (_, open)| bits & !open)
            | flag(self.inputs.supply, status::VOLTAGE_ENABLED)
            | flag(!self.warnings.is_empty(), status::WARNING)
            | status::REMOTE
            | flag(self.is_limited(), status::INTERNAL_LIMIT)
            | self.mode_bits(od)
            | (self.model.status_bits)(self, od)
    }

    fn is_limited(&self) -> bool {
        match self.limit {
            Limit::None => false,
            Limit::Now => true,
            Limit::AtEnd => !self.is_moving(self.now),
        }
    }

    /// Bits 10, 12 and 13.
    fn mode_bits(&self, od: &dyn Storage) -> u16 {
        let stands = !self.is_moving(self.now);
        let bits = |reached: bool, bit_12: bool, bit_13: bool| {
            u16::from(reached) << 10 | u16::from(bit_12) << 12 | u16::from(bit_13) << 13
        };
        if self.state == State::QuickStopActive {
            return bits(stands, false, false);
        }
        if !self.is_obeying() {
            return bits(false, self.mode == Some(Mode::Homing) && self.homing.attained, false);
        }
        let halted = self.is_halted();
        match self.mode {
            Some(Mode::ProfilePosition) => {
                let shaft = self.shaft(self.now).position;
                let rest = self.model.rest_is_reached;
                let at_target = self.points.active.map_or(rest, |point| (point.target - shaft).abs() < 0.5);
                let reached = if halted { stands } else { self.points.are_done() && at_target && self.has_arrived() };
                bits(reached, self.points.acknowledged, self.lags())
            }
            Some(Mode::ProfileVelocity) => {
                let parameters = self.parameters(od);
                let most = parameters.float(MAX_SLIPPAGE) * parameters.velocity_scale();
                let slips = self.held.is_some() && self.demanded().velocity.abs() > most;
                bits(if halted { stands } else { self.is_at_speed() }, self.is_slow(), slips)
            }
            Some(Mode::ProfileTorque) => {
                let target = self.running.map_or(0.0, |running| running[0]);
                let reached = (self.torque() - target).abs() < TINY;
                bits(if halted { stands } else { reached }, false, false)
            }
            Some(Mode::Homing) => {
                let Homing { running, attained, failed, .. } = self.homing;
                bits(stands && !running && (self.model.rest_is_reached || attained || failed), attained, failed)
            }
            Some(Mode::InterpolatedPosition) => {
                bits(stands && (halted || self.model.rest_is_reached), self.cyclic.interpolates, self.lags())
            }
            Some(Mode::CyclicPosition) => bits(halted && stands, self.follows_cycle(), self.lags()),
            Some(Mode::CyclicVelocity | Mode::CyclicTorque) => bits(halted && stands, self.follows_cycle(), false),
            Some(Mode::Velocity) | None => bits(false, false, false),
        }
    }

    /// The torque of the motor, in 0.1 % of its rated torque.
    fn torque(&self) -> f64 {
        match self.mode {
            Some(mode) if mode.is_torque() && self.is_obeying() => {
                self.demanded().velocity / self.model.speed_per_torque
            }
            _ if self.held.is_some() && self.has_torque() => 1000.0,
            _ => 0.0,
        }
    }

    /// Writes all measured values into the dictionary.
    pub(super) fn publish(&self, od: &mut dyn Storage) {
        let parameters = self.parameters(od);
        let (shaft, demand) = (self.shaft(self.now), self.demanded());
        let velocity = |velocity: f64| velocity / parameters.velocity_scale() * parameters.velocity_sign();
        let [position, wanted] = [shaft, demand].map(|state| self.shown(state.position, &parameters));
        let increments = parameters.increments();
        let [internal, wanted_internal] = [position, wanted].map(|position| (position * increments).round());
        let [speed, wanted_speed] = [shaft, demand].map(|state| velocity(state.velocity).round());
        let torque = self.torque().round();
        let values = [
            f64::from(self.status_word(od)),
            f64::from(self.mode_code),
            f64::from(self.faults.last().copied().unwrap_or_default()),
            position,
            internal,
            wanted,
            wanted_internal,
            wanted - position,
            speed,
            speed,
            wanted_speed,
            torque,
            torque,
            torque,
            f64::from(self.inputs.machine.bits(shaft) | self.inputs.digital),
        ];
        for (address, value) in MEASURED.into_iter().zip(values) {
            od.set_raw(address, value as i64 as u64);
        }
        (self.model.publish)(self, self.now, od);
    }

    /// The error register (1001h) that the servo's faults and warnings make.
    #[must_use]
    pub fn error_register(&self) -> ErrorRegister {
        let codes = self.faults.iter().copied().chain(self.warnings.iter());
        codes.fold(ErrorRegister::NONE, |register, code| register | register_of(code))
    }
}

/// Whether the servo overwrites an object with a measured value.
#[must_use]
pub fn measures(object: Address) -> bool {
    MEASURED.contains(&object) || PROBED.contains(&object) || object == PROBE_STATUS
}
