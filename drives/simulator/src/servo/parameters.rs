//! The values of the dictionary, and the defaults for what is missing.

use std::cell::OnceCell;

use lexican_runtime::Duration;
use lexican_runtime::object::Address;

use super::model::{Scales, ServoModel, ratio};
use super::objects::*;
use super::parts::TINY;
use crate::storage::Storage;
use crate::trajectory::Profile;

/// Values that a new servo gets for objects without a default in the data sheet, so that it can move.
pub const DEFAULTS: &[(Address, i64)] = &[
    // A servo drive.
    (DEVICE_TYPE, 0x0002_0192),
    (QUICK_STOP_OPTION, 2),
    (SHUTDOWN_OPTION, 0),
    (DISABLE_OPTION, 1),
    (HALT_OPTION, 1),
    (FAULT_OPTION, 2),
    (ABORT_CONNECTION, 1),
    (MAX_TORQUE, 1000),
    (PROFILE_VELOCITY, 1000),
    (PROFILE_ACCELERATION, 10_000),
    (PROFILE_DECELERATION, 10_000),
    (QUICK_STOP_DECELERATION, 100_000),
    (TORQUE_SLOPE, 1000),
    (HOMING_FAST, 1000),
    (HOMING_SLOW, 100),
    (HOMING_ACCELERATION, 10_000),
    (CYCLE_UNITS, 1),
    (CYCLE_EXPONENT, -3),
];

/// Values of the dictionary with the model as fallback.
pub(super) struct Parameters<'a> {
    pub(super) od: &'a dyn Storage,
    pub(super) model: &'static ServoModel,
    /// Calculated on demand, since often no velocity is needed.
    scales: OnceCell<Scales>,
}

impl<'a> Parameters<'a> {
    pub(super) fn new(od: &'a dyn Storage, model: &'static ServoModel) -> Self {
        Parameters { od, model, scales: OnceCell::new() }
    }

    /// The value of an object; if it is missing, that of the model or of [`DEFAULTS`], or else 0.
    pub(super) fn number(&self, address: Address) -> i64 {
        let mut rows = self.model.missing.iter().chain(DEFAULTS);
        let missing = || rows.find(|(at, _)| *at == address).map_or(0, |(_, value)| *value);
        self.od.number(address).unwrap_or_else(missing)
    }

    pub(super) fn float(&self, address: Address) -> f64 {
        self.number(address) as f64
    }

    pub(super) fn milliseconds(&self, address: Address) -> Duration {
        Duration::from_millis(self.number(address).unsigned_abs())
    }

    /// The value of the first of these objects that exists.
    fn first(&self, addresses: &[Address]) -> Option<f64> {
        addresses.iter().find_map(|address| self.od.number(*address)).map(|value| value as f64)
    }

    fn scales(&self) -> Scales {
        *self.scales.get_or_init(|| (self.model.scales)(self.od))
    }

    pub(super) fn velocity_scale(&self) -> f64 {
        self.scales().velocity
    }

    /// Increments of the encoder (608Fh) per position unit, by gear and feed (6091h, 6092h); 1 without them.
    pub(super) fn increments(&self) -> f64 {
        let ratio = |numerator, denominator| ratio(self.od, numerator, denominator);
        let encoder = ratio(ENCODER_INCREMENTS, ENCODER_REVOLUTIONS);
        let feed = ratio(FEED, FEED_REVOLUTIONS);
        let gear = ratio(GEAR_MOTOR, GEAR_SHAFT).unwrap_or(1.0);
        encoder.zip(feed).map_or(1.0, |(encoder, feed)| encoder * gear / feed)
    }

    /// An acceleration in position units/s²: that of the first object that exists, up to its maximum (60C5h, 60C6h).
    fn acceleration(&self, addresses: &[Address], maximum: Address) -> f64 {
        let positive = |value: &f64| *value > 0.0;
        let last = addresses.last().map_or(0.0, |last| self.float(*last));
        let ramp = Some(self.first(addresses).unwrap_or(last)).filter(positive);
        let maximum = self.od.number(maximum).map(|value| value as f64).filter(positive);
        let limit = maximum.map_or(f64::INFINITY, |value| value * self.scales().acceleration);
        ramp.map_or(self.model.strongest, |value| value * self.scales().acceleration).min(limit)
    }

    /// The highest velocity (607Fh, 6080h), in position units/s.
    pub(super) fn top_speed(&self) -> f64 {
        // Both are taken in the servo's unit of velocity, although CiA 402 has 6080h in revolutions per minute.
        let positive = |address| self.od.number(address).filter(|value| *value > 0);
        let limits = [positive(MAX_PROFILE_VELOCITY), positive(MAX_MOTOR_SPEED)];
        limits.into_iter().flatten().map(|value| value as f64 * self.scales().velocity).fold(f64::INFINITY, f64::min)
    }

    /// The profile of the profile modes: 6081h, 6083h and 6084h.
    pub(super) fn profile(&self) -> Profile {
        Profile {
            speed: (self.float(PROFILE_VELOCITY).abs() * self.scales().velocity).min(self.top_speed()),
            acceleration: self.acceleration(&[PROFILE_ACCELERATION], MAX_ACCELERATION),
            deceleration: self.slow_down(),
        }
    }

    /// 6084h; without it, 6083h (CiA 402-2, profile position mode).
    pub(super) fn slow_down(&self) -> f64 {
        self.acceleration(&[PROFILE_DECELERATION, PROFILE_ACCELERATION], MAX_DECELERATION)
    }

    pub(super) fn quick_stop(&self) -> f64 {
        self.acceleration(&[QUICK_STOP_DECELERATION], MAX_DECELERATION)
    }

    /// The profile of homing with one of the speeds of 6099h.
    pub(super) fn homing(&self, speed: Address) -> Profile {
        let acceleration = self.acceleration(&[HOMING_ACCELERATION], MAX_ACCELERATION);
        Profile { speed: self.float(speed).abs() * self.scales().velocity, acceleration, deceleration: acceleration }
    }

    /// 1, or -1 if 607Eh inverts positions.
    pub(super) fn position_sign(&self) -> f64 {
        if self.number(POLARITY) & 0x80 == 0 { 1.0 } else { -1.0 }
    }

    /// 1, or -1 if 607Eh inverts velocities.
    pub(super) fn velocity_sign(&self) -> f64 {
        if self.number(POLARITY) & 0x40 == 0 { 1.0 } else { -1.0 }
    }

    /// A pair of limits; `None` if they are equal or reversed, which means no limits (607Bh, 607Dh).
    pub(super) fn range(&self, low: Address, high: Address) -> Option<(f64, f64)> {
        let (low, high) = (self.od.number(low)?, self.od.number(high)?);
        (low < high).then_some((low as f64, high as f64))
    }

    /// The following error window (6065h); `None` if it is not monitored.
    pub(super) fn following_window(&self) -> Option<f64> {
        let window = self.od.number(FOLLOWING_WINDOW)?;
        (window > 0 && window != u32::MAX.into()).then_some(window as f64)
    }

    /// The time between two set-points: 60C2h, or else 1006h; `None` if neither has it.
    pub(super) fn cycle(&self) -> Option<Duration> {
        let own = self.od.number(CYCLE_UNITS).and_then(|units| period(units, self.number(CYCLE_EXPONENT)));
        let sync = self.od.number(SYNC_PERIOD).map(i64::unsigned_abs).filter(|us| *us > 0);
        own.or(sync.map(Duration::from_micros))
    }
}

/// The period of units and exponent in 60C2h; `None` below a microsecond.
pub(super) fn period(units: i64, exponent: i64) -> Option<Duration> {
    // Rounded, because 10^-3 is no binary fraction.
    let us = units.max(0) as f64 * 10_f64.powi(exponent.clamp(-9, 3) as i32) * 1e6;
    Some((us + TINY) as u64).filter(|us| *us > 0).map(Duration::from_micros)
}
