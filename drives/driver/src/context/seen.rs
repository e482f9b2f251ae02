//! What was last seen of a drive, and when.

use lexican_runtime::Measured;
use lexican_runtime::profile::cia402::State;

/// What operations have last seen of a drive, each with its time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Seen {
    /// The state of its state machine; `None` also if the status word matches no state.
    pub state: Option<Measured<State>>,
    /// The number of its operating mode (6061h).
    pub mode: Option<Measured<i8>>,
    /// The actual position (6064h).
    pub position: Option<Measured<i32>>,
    /// The actual velocity (606Ch).
    pub velocity: Option<Measured<i32>>,
}
