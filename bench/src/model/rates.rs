//! Counts frames and bits of each COB-ID in the last second.

use std::collections::BTreeMap;

use lexican_runtime::host::wire_bits;
use lexican_runtime::{CobId, Duration, Frame, Instant};

/// The counting interval.
const SECOND: Duration = Duration::from_secs(1);

/// Counters by COB-ID.
#[derive(Default)]
pub(crate) struct Rates {
    began: Instant,
    ids: BTreeMap<CobId, [Count; 2]>,
}

/// The frames in an interval.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Count {
    pub(crate) frames: u32,
    /// Their bits on the wire.
    pub(crate) bits: u32,
}

impl Rates {
    /// Counts a frame.
    pub(crate) fn observe(&mut self, at: Instant, frame: &Frame) {
        self.advance(at);
        let [now, _] = self.ids.entry(frame.id()).or_default();
        now.frames += 1;
        now.bits += wire_bits(frame);
    }

    /// Lets time pass.
    pub(crate) fn advance(&mut self, now: Instant) {
        let seconds = now.since(self.began).as_micros() / SECOND.as_micros();
        if seconds == 0 {
            return;
        }
        for count in self.ids.values_mut() {
            *count = [Count::default(), if seconds == 1 { count[0] } else { Count::default() }];
        }
        self.began += Duration::from_micros(seconds * SECOND.as_micros());
    }

    /// The count of a COB-ID in the last complete second.
    pub(crate) fn of(&self, id: CobId) -> Count {
        self.ids.get(&id).map(|[_, last]| *last).unwrap_or_default()
    }

    /// All COB-IDs heard.
    pub(crate) fn ids(&self) -> impl Iterator<Item = CobId> {
        self.ids.keys().copied()
    }

    /// All bits in the last complete second.
    pub(crate) fn bits(&self) -> u64 {
        self.ids.values().map(|[_, last]| u64::from(last.bits)).sum()
    }
}
