//! What a servo remembers of each of its tasks.

use lexican_runtime::profile::cia402::State;
use lexican_runtime::wire::emcy::ErrorRegister;
use lexican_runtime::{Duration, Instant};

use crate::trajectory::Profile;

/// What follows once the axis stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Ending {
    /// The drive changes its state.
    Enter(State),
    /// It stays in QUICK STOP ACTIVE.
    Stay,
}

/// An emergency to send.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Emergency {
    /// The code; 0000h when an error is over.
    pub code: u16,
    /// The error register as the errors make it that are left when one is over.
    pub remaining: ErrorRegister,
    /// Whether the code goes into the history (1003h): those of faults do, those of warnings do not.
    pub recorded: bool,
}

/// Whether something limits the motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Limit {
    None,
    /// From the beginning.
    Now,
    /// Once the axis stands there.
    AtEnd,
}

/// Where to travel, with the ramps that held when it was ordered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SetPoint {
    /// Where the shaft is to be.
    pub(super) target: f64,
    pub(super) profile: Profile,
    /// The software limits have changed the target.
    pub(super) limited: bool,
}

#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Points {
    /// The set-point under way, or the last one.
    pub(super) active: Option<SetPoint>,
    /// Whether it is under way.
    pub(super) travels: bool,
    pub(super) buffered: Option<SetPoint>,
    /// When to pass from the one under way to the next without a stop.
    pub(super) change: Option<Instant>,
    /// Status word, bit 12.
    pub(super) acknowledged: bool,
}

impl Points {
    pub(super) fn clear(&mut self) {
        *self = Points { acknowledged: self.acknowledged, ..Points::default() };
    }

    /// Whether nothing is left to travel.
    pub(super) fn are_done(&self) -> bool {
        !self.travels && self.buffered.is_none()
    }
}

/// How far homing is.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Homing {
    /// Under way.
    pub(super) running: bool,
    /// Status word, bit 12.
    pub(super) attained: bool,
    /// Status word, bit 13.
    pub(super) failed: bool,
    /// Where the home position is, and 607Ch as it was at the start.
    pub(super) home: (f64, f64),
}

#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Cyclic {
    /// When SYNC came last in this mode.
    pub(super) last_sync: Option<Instant>,
    pub(super) period: Duration,
    /// Whether a set-point has come since then; none before the first one by RPDO, because those by SDO are not counted.
    pub(super) fresh: Option<bool>,
    /// How many cycles had none.
    pub(super) missed: u32,
    /// Interpolation is enabled (status word, bit 12).
    pub(super) interpolates: bool,
}

/// The period of 60C2h where it takes effect once both of its entries have been written.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Cycle {
    /// Which of units and exponent have been written since it took effect.
    pub(super) written: [bool; 2],
    pub(super) period: Option<Duration>,
}

/// What a probe has seen.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Probe {
    pub(super) function: u8,
    pub(super) level: bool,
    /// How far the index pulses have been counted.
    pub(super) pulses: Option<f64>,
    pub(super) stored: [bool; 2],
}

/// What the last look has found.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Last {
    /// 60FDh.
    pub(super) inputs: u32,
    /// How far the index pulses have been counted.
    pub(super) pulses: Option<f64>,
    /// Whether one was passed since the look before.
    pub(super) passed_index: bool,
}

/// Since when the conditions of the status word hold.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Watch {
    pub(super) since: [Option<Instant>; CONDITIONS],
    /// Which hold for long enough.
    pub(super) held: [bool; CONDITIONS],
}

/// How many conditions are watched.
pub(super) const CONDITIONS: usize = 5;

/// Far below what can be seen.
pub(super) const TINY: f64 = 1e-6;

/// How long a step of the following is at least, so that time goes on.
pub(super) const MICROSECOND: Duration = Duration::from_micros(1);
