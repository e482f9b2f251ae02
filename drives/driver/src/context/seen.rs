//! What was last seen of a drive, and when.

use lexican_runtime::Measured;
use lexican_runtime::profile::cia402::State;

/// What is known of a drive, each part since when.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Seen {
    /// The state of its state machine; `None` too for a status word that has none.
    pub state: Option<Measured<State>>,
    /// The number of its operating mode (6061h).
    pub mode: Option<Measured<i8>>,
    /// Where it is (6064h).
    pub position: Option<Measured<i32>>,
    /// How fast it is (606Ch).
    pub velocity: Option<Measured<i32>>,
}
