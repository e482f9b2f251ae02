//! What is known of a drive at a time.

use lexican_driver::DriveContext;
use lexican_runtime::Instant;
use lexican_runtime::profile::cia402::State;

/// What is known of a drive at a time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Look {
    /// When, at the earliest: when the oldest of what follows was measured.
    pub at: Instant,
    /// The state of its state machine; `None` for a status word that has none.
    pub state: Option<State>,
    /// Where it is, as 6064h has it.
    pub position: Option<i32>,
    /// How fast it is, as 606Ch has it.
    pub velocity: Option<i32>,
}

impl Look {
    /// What the driver has seen last.
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

    /// Whether the drive is seen as it was, only later.
    pub(super) fn shows_the_same(&self, later: &Look) -> bool {
        Look { at: later.at, ..*self } == *later
    }
}
