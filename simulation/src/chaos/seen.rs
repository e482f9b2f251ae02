//! What is seen of a program and a plant, and what is found wrong with it.

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

/// What the plant is like.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Scene {
    /// What can be written, by the place of the device and the address.
    pub(super) objects: BTreeMap<(usize, Address), Vec<u8>>,
    pub(super) positions: BTreeMap<usize, f64>,
}

/// What the program does if nothing is done to it.
#[derive(Clone, Debug)]
pub struct Reference {
    /// How it ends.
    pub end: End,
    /// Whether it ends by itself, and not because it was told to.
    pub by_itself: bool,
    /// Whether an axis moves.
    pub moves: bool,
    /// How long it takes.
    pub took: Duration,
    pub(super) before: Scene,
    pub(super) after: Scene,
    pub(super) peaks: BTreeMap<usize, f64>,
    /// The axes that end where they were told to.
    pub(super) positioning: BTreeSet<usize>,
}

/// How much is asked for what was not seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// Required.
    Must,
    /// Recommended.
    Should,
}

/// What is wrong.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// How much it counts.
    pub level: Level,
    /// A sentence.
    pub what: String,
}

impl Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.what)
    }
}
