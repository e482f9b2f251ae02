//! What is known of a drive at a time.

use lexican_driver::DriveContext;
use lexican_runtime::Instant;
use lexican_runtime::profile::cia402::State;

/// What is known of a drive at a time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Look {
    /// When.
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
        Look { at: drive.now(), state: seen.state, position: seen.position, velocity: seen.velocity }
    }
}
