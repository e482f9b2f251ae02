//! What is observed of a program and a plant, and what is found wrong with it.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::{self, Display};

use lexican_runtime::Duration;
use lexican_runtime::object::Address;

/// How a program has ended.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct End {
    /// Its exit code; `None` if a signal has ended it.
    pub code: Option<i32>,
    /// The last line that it has printed.
    pub last_line: String,
}

/// The state of the plant at one moment.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Scene {
    /// The values of writable entries, by the index of the device and the address.
    pub(super) objects: BTreeMap<(usize, Address), Vec<u8>>,
    pub(super) positions: BTreeMap<usize, f64>,
}

/// What the program does if it is not disturbed.
#[derive(Clone, Debug)]
pub struct Reference {
    /// How it ends.
    pub end: End,
    /// Whether it ends without being told to.
    pub by_itself: bool,
    /// Whether an axis moves.
    pub moves: bool,
    /// How long it takes.
    pub took: Duration,
    pub(super) before: Scene,
    pub(super) after: Scene,
    pub(super) peaks: BTreeMap<usize, f64>,
    /// The axes in a mode of positions, which end where they were told to.
    pub(super) positioning: BTreeSet<usize>,
}

/// How strong the requirement is that a finding violates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// Required.
    Must,
    /// Recommended.
    Should,
}

/// A requirement that is not met.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// How strong the requirement is.
    pub level: Level,
    /// What is wrong, as a sentence.
    pub what: String,
}

impl Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.what)
    }
}
