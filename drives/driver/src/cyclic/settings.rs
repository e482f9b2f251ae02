//! How axes are set up, and how a path is followed.

use lexican_runtime::{CobId, Duration};

use crate::mode::Mode;
use crate::protection::Supervision;

/// How an axis is set up.
#[derive(Clone, Copy, Debug)]
pub struct AxisSettings {
    /// [`Mode::CyclicPosition`], [`Mode::InterpolatedPosition`], or [`Mode::CyclicVelocity`], whose set-points are
    /// velocities. Not [`Mode::CyclicTorque`], since a torque of 0 does not stop an axis.
    pub mode: Mode,
    /// The time between two SYNCs, the same for all axes of a [`Follower`](super::Follower).
    pub period: Duration,
    /// The largest change of the set-point from one cycle to the next, in units of the set-point: what the axis can
    /// follow. A larger step is refused before it is sent.
    pub max_step: u32,
    /// The largest distance of the axis from its last four set-points, in units of position. Allow for its lag at full
    /// speed, and a few steps for lost frames.
    pub following_error: u32,
    /// The axis counts as standing if it moves by no more than this in 20 ms, in units of position.
    pub standing: u32,
    /// The bits of the status word that are set while the axis follows: bit 12 (CiA 402-2, table for mode 7 and
    /// following). 0 for a drive without such a bit.
    pub follows: u16,
    /// The receive PDO, 1 to 4, that is to carry control word and set-point.
    pub rpdo: u8,
    /// The transmit PDO, 1 to 4, that is to carry status word and position.
    pub tpdo: u8,
    /// How soon the drive is to notice that its follower is gone, if it can notice that. With `None` it then goes on
    /// with its last set-points, unless it stops because SYNC is missing.
    pub protection: Option<Supervision>,
}

impl AxisSettings {
    /// RPDO 2 and TPDO 3; a following error of twenty steps; standing within a tenth of a step; protected as by
    /// [`Supervision::default`].
    #[must_use]
    pub const fn new(mode: Mode, period: Duration, max_step: u32) -> Self {
        AxisSettings {
            mode,
            period,
            max_step,
            following_error: max_step.saturating_mul(20),
            standing: max_step / 10 + 1,
            follows: 1 << 12,
            rpdo: 2,
            tpdo: 3,
            protection: Some(Supervision::USUAL),
        }
    }

    /// Whether set-points are positions.
    pub(super) const fn follows_positions(&self) -> bool {
        matches!(self.mode, Mode::CyclicPosition | Mode::InterpolatedPosition)
    }
}

/// How a path is followed.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Where SYNC comes from.
    pub sync: SyncSource,
    /// What may be missing.
    pub tolerance: Tolerance,
    /// How all axes are stopped.
    pub stop: Stop,
    /// How long the axes may take to come to rest.
    pub settle: Duration,
}

/// Where SYNC comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SyncSource {
    /// The follower sends it, with a counter up to `overflow` (1019h), or without one if that is 0.
    Produced {
        /// As in 1005h.
        id: CobId,
        /// 0, or 2 to 240.
        overflow: u8,
    },
    /// Another node sends it, with the period of the axes. If that node stops while the axes are being stopped, the
    /// follower sends it.
    Followed {
        /// As in 1005h.
        id: CobId,
    },
}

/// How many may be missing in a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tolerance {
    /// Cycles of the follower.
    pub cycles: u32,
    /// PDOs of an axis.
    pub pdos: u32,
    /// Set-points of the program.
    pub set_points: u32,
}

/// How all axes are stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// Along the path, ever more slowly, until it ends after this time.
    Ramp(Duration),
    /// By the quick stop of each axis.
    Quick,
}

impl Default for Settings {
    /// SYNC produced as 80h without a counter; one cycle, two PDOs and two set-points may be missing; a ramp of 200 ms;
    /// 500 ms to settle.
    fn default() -> Self {
        Settings {
            sync: SyncSource::Produced { id: CobId::SYNC, overflow: 0 },
            tolerance: Tolerance { cycles: 1, pdos: 2, set_points: 2 },
            stop: Stop::Ramp(Duration::from_millis(200)),
            settle: Duration::from_millis(500),
        }
    }
}
