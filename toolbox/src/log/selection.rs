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

#[cfg(test)]
mod tests {
    use super::super::{Direction, INTERFACE};
    use super::*;
    use lexican_runtime::{CobId, Frame};

    #[test]
    fn frames_that_fit_everything_are_wanted() {
        let start = Instant::from_micros(5_000_000);
        let record = |id: u16, ms: u64| Record {
            at: start + Duration::from_millis(ms),
            interface: INTERFACE.into(),
            direction: Direction::Received,
            frame: Frame::new(CobId::standard(id).unwrap(), &[]).unwrap(),
        };
        let ids = |text: &str| Some(text.parse::<CobIds>().unwrap());
        let selection = Selection {
            only: ids("80,181-1FF"),
            except: ids("185"),
            interface: Some(INTERFACE.to_owned()),
            after: Some(Duration::from_millis(10)),
            before: Some(Duration::from_millis(20)),
        };
        for (id, ms, wanted) in [
            (0x080, 10, true),
            (0x1FF, 19, true),
            (0x185, 10, false),
            (0x081, 10, false),
            (0x080, 9, false),
            (0x080, 20, false),
        ] {
            assert_eq!(selection.contains(&record(id, ms), start), wanted, "{id:03X} at {ms} ms");
        }
        let other = Selection { interface: Some("can1".to_owned()), ..Selection::default() };
        assert!(!other.contains(&record(0x080, 10), start));
    }
}
