//! Sending SYNC (CiA 301, 7.2.5; 1005h bit 30, 1006h, 1019h).

use crate::frame::Frame;
use crate::id::CobId;
use crate::time::{self, Duration, Instant};
use crate::wire::sync::Sync;

/// Sends SYNC in a fixed period, with a counter if 1019h asks for it.
#[derive(Clone, Copy, Debug)]
pub struct SyncProducer {
    id: CobId,
    period: Duration,
    overflow: u8,
    counter: u8,
    next: Option<Instant>,
    due: bool,
}

impl SyncProducer {
    /// Silent, until it is given a period.
    #[must_use]
    pub const fn new() -> Self {
        SyncProducer { id: CobId::SYNC, period: Duration::ZERO, overflow: 0, counter: 0, next: None, due: false }
    }

    /// Sends SYNC as `id` every `period`, the first one period from now; a period of zero stops it.
    /// With an `overflow` of 2 to 240 the messages count from 1 to it; with 0 they are empty.
    pub fn configure(&mut self, now: Instant, id: CobId, period: Duration, overflow: u8) {
        if period.is_zero() {
            *self = SyncProducer { id, ..SyncProducer::new() };
            return;
        }
        if overflow != self.overflow || self.next.is_none() {
            self.counter = 0;
        }
        if period != self.period {
            self.next = Some(now + period);
        }
        (self.id, self.period, self.overflow) = (id, period, overflow);
    }

    /// Sends no SYNC, not even one that is due, until [`SyncProducer::resume`].
    pub const fn suspend(&mut self) {
        self.counter = 0;
        self.due = false;
        self.next = None;
    }

    /// Begins anew after it was suspended: the first SYNC comes a period from now, and the counter with 1.
    pub fn resume(&mut self, now: Instant) {
        if self.next.is_none() {
            self.next = time::after(now, self.period);
        }
    }

    /// A SYNC is due when its time has come; this is never an event.
    pub fn handle_timeout(&mut self, now: Instant) {
        self.due |= time::tick(&mut self.next, self.period, now);
    }

    /// The SYNC, when one is due.
    pub fn poll_transmit(&mut self, _now: Instant) -> Option<(Sync, Frame)> {
        if !core::mem::take(&mut self.due) {
            return None;
        }
        let sync = Sync { counter: self.count() };
        Some((sync, sync.frame(self.id)))
    }

    fn count(&mut self) -> Option<u8> {
        if self.overflow == 0 {
            return None;
        }
        self.counter = if self.counter >= self.overflow { 1 } else { self.counter + 1 };
        Some(self.counter)
    }

    /// When the next SYNC is due.
    #[must_use]
    pub const fn poll_timeout(&self) -> Option<Instant> {
        self.next
    }
}

impl Default for SyncProducer {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(ms: u64) -> Instant {
        Instant::ZERO + Duration::from_millis(ms)
    }

    fn run(producer: &mut SyncProducer, from_ms: u64, to_ms: u64) -> std::vec::Vec<std::string::String> {
        let mut sent = std::vec::Vec::new();
        for ms in from_ms..=to_ms {
            producer.handle_timeout(at(ms));
            while let Some((_, frame)) = producer.poll_transmit(at(ms)) {
                sent.push(std::format!("{ms} {frame}"));
            }
        }
        sent
    }

    #[test]
    fn the_counter_runs_from_1_to_its_overflow() {
        let mut producer = SyncProducer::new();
        producer.configure(at(0), CobId::SYNC, Duration::from_millis(10), 3);
        assert_eq!(run(&mut producer, 0, 45), ["10 080#01", "20 080#02", "30 080#03", "40 080#01"]);
        producer.suspend();
        assert_eq!((run(&mut producer, 46, 55).len(), producer.poll_timeout()), (0, None));
        producer.resume(at(56));
        producer.resume(at(60));
        assert_eq!(run(&mut producer, 56, 70), ["66 080#01"]);
    }

    #[test]
    fn without_a_counter_it_is_empty_and_without_a_period_silent() {
        let mut producer = SyncProducer::new();
        producer.configure(at(0), CobId::SYNC, Duration::from_millis(10), 0);
        assert_eq!(run(&mut producer, 0, 20), ["10 080#", "20 080#"]);
        producer.configure(at(20), CobId::SYNC, Duration::ZERO, 0);
        assert_eq!((run(&mut producer, 20, 60).len(), producer.poll_timeout()), (0, None));
    }
}
