//! Selects frames of a log.

use lexican_runtime::{Duration, Instant};

use super::Record;
use crate::bus::cob_ids::CobIds;

/// Selects frames of a log: those that meet all conditions.
#[derive(Clone, Debug, Default)]
pub struct Selection {
    /// Only these identifiers.
    pub only: Option<CobIds>,
    /// None of these identifiers.
    pub except: Option<CobIds>,
    /// Only this interface.
    pub interface: Option<String>,
    /// From this time after the first frame of the log.
    pub after: Option<Duration>,
    /// Until this time after the first frame of the log.
    pub before: Option<Duration>,
}

impl Selection {
    /// Whether a frame is selected; `start` is the time of the log's first frame.
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
