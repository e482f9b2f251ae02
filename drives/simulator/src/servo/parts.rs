//! The state of a servo's parts.

use lexican_runtime::profile::cia402::State;
use lexican_runtime::wire::emcy::ErrorRegister;
use lexican_runtime::{Duration, Instant};

use crate::trajectory::Profile;

/// What happens once the axis stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Ending {
    /// The drive changes its state.
    Enter(State),
    /// The drive stays in QUICK STOP ACTIVE.
    Stay,
}

/// An emergency to send.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Emergency {
    /// The code; 0000h when an error is over.
    pub code: u16,
    /// When an error is over: the error register that the remaining errors make.
    pub remaining: ErrorRegister,
    /// Whether the code goes into the history (1003h): codes of faults do, codes of warnings do not.
    pub recorded: bool,
}

/// Whether something limits the motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Limit {
    None,
    /// From the beginning of the motion.
    Now,
    /// Once the axis stands at its end.
    AtEnd,
}

/// Where to travel, with the profile that held when it was ordered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SetPoint {
    /// The position of the shaft.
    pub(super) target: f64,
    pub(super) profile: Profile,
    /// Whether the software limits have changed the target.
    pub(super) limited: bool,
}

#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Points {
    /// The set-point under way, or the last one.
    pub(super) active: Option<SetPoint>,
    /// Whether `active` is under way.
    pub(super) travels: bool,
    pub(super) buffered: Option<SetPoint>,
    /// When to change over to the next set-point without a stop.
    pub(super) change: Option<Instant>,
    /// Status word, bit 12.
    pub(super) acknowledged: bool,
}

impl Points {
    pub(super) fn clear(&mut self) {
        *self = Points { acknowledged: self.acknowledged, ..Points::default() };
    }

    /// Whether no travel is left.
    pub(super) fn are_done(&self) -> bool {
        !self.travels && self.buffered.is_none()
    }
}

#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Homing {
    pub(super) running: bool,
    /// Status word, bit 12.
    pub(super) attained: bool,
    /// Status word, bit 13.
    pub(super) failed: bool,
    /// The home position of the shaft, and 607Ch as it was when homing began.
    pub(super) home: (f64, f64),
}

#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Cyclic {
    /// When SYNC last came in this mode.
    pub(super) last_sync: Option<Instant>,
    pub(super) period: Duration,
    /// Whether a set-point has come since the last SYNC; `None` before the first one by RPDO, since those by SDO are
    /// not expected in every cycle.
    pub(super) fresh: Option<bool>,
    /// How many cycles in a row had no set-point.
    pub(super) missed: u32,
    /// Whether interpolation is enabled (status word, bit 12).
    pub(super) interpolates: bool,
}

/// The period of 60C2h in a drive where it takes effect only once both entries have been written.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Cycle {
    /// Whether units and exponent have been written since the period took effect.
    pub(super) written: [bool; 2],
    pub(super) period: Option<Duration>,
}

/// The state of a touch probe.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Probe {
    pub(super) function: u8,
    pub(super) level: bool,
    /// The last index pulse at or below the shaft.
    pub(super) pulses: Option<f64>,
    pub(super) stored: [bool; 2],
}

/// What the last update found.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Last {
    /// 60FDh.
    pub(super) inputs: u32,
    /// The last index pulse at or below the shaft.
    pub(super) pulses: Option<f64>,
    /// Whether an index pulse was passed since the previous update.
    pub(super) passed_index: bool,
}

/// Since when each condition of the status word holds.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Watch {
    pub(super) since: [Option<Instant>; CONDITIONS],
    /// Whether it has held for long enough.
    pub(super) held: [bool; CONDITIONS],
}

/// How many conditions are watched.
pub(super) const CONDITIONS: usize = 5;

/// A tolerance far below an increment.
pub(super) const TINY: f64 = 1e-6;

/// The shortest time between two set-points, to avoid a division by 0.
pub(super) const MICROSECOND: Duration = Duration::from_micros(1);
