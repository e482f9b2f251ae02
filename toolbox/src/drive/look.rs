//! A snapshot of a drive.

use lexican_driver::DriveContext;
use lexican_runtime::Instant;
use lexican_runtime::profile::cia402::State;

/// A snapshot of a drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Look {
    /// When the oldest of the values was measured.
    pub at: Instant,
    /// The state of CiA 402; `None` if the status word encodes none.
    pub state: Option<State>,
    /// The position (6064h), in the drive's counts.
    pub position: Option<i32>,
    /// The velocity (606Ch), in the drive's counts.
    pub velocity: Option<i32>,
}

impl Look {
    /// The last values that the driver has seen.
    #[must_use]
    pub fn at(drive: &DriveContext) -> Self {
        let seen = drive.seen();
        let times = [seen.state.map(|it| it.at), seen.position.map(|it| it.at), seen.velocity.map(|it| it.at)];
        Look {
            at: times.into_iter().flatten().min().unwrap_or_else(|| drive.now()),
            state: seen.state.map(|it| it.value),
            position: seen.position.map(|it| it.value),
            velocity: seen.velocity.map(|it| it.value),
        }
    }

    /// Whether a later snapshot shows the same values.
    pub(super) fn shows_the_same(&self, later: &Look) -> bool {
        Look { at: later.at, ..*self } == *later
    }
}
