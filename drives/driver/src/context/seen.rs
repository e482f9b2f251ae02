//! What was last seen of a drive, however long ago.

use lexican_runtime::profile::cia402::State;

/// What is known of a drive.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Seen {
    /// The state of its state machine.
    pub state: Option<State>,
    /// The number of its operating mode (6061h).
    pub mode: Option<i8>,
    /// Where it is (6064h).
    pub position: Option<i32>,
    /// How fast it is (606Ch).
    pub velocity: Option<i32>,
}
