//! Which frames of a log are wanted.

use lexican_runtime::{Duration, Instant};

use super::Record;
use crate::bus::cob_ids::CobIds;

/// Which frames of a log are wanted: those that meet all conditions given here.
#[derive(Clone, Debug, Default)]
pub struct Selection {
    /// Only these identifiers.
    pub only: Option<CobIds>,
    /// None of these identifiers.
    pub except: Option<CobIds>,
    /// Only this interface.
    pub interface: Option<String>,
    /// Not before so much time since the log's first frame.
    pub after: Option<Duration>,
    /// Before so much time since the log's first frame.
    pub before: Option<Duration>,
}

impl Selection {
    /// Whether a frame of a log that begins at `start` is wanted.
    #[must_use]
    pub fn contains(&self, record: &Record, start: Instant) -> bool {
        let (id, passed) = (record.frame.id(), record.at.since(start));
        self.only.as_ref().is_none_or(|ids| ids.contains(id))
            && !self.except.as_ref().is_some_and(|ids| ids.contains(id))
            && self.interface.as_ref().is_none_or(|interface| **interface == *record.interface)
            && self.after.is_none_or(|after| passed >= after)
            && self.before.is_none_or(|before| passed < before)
    }
}
