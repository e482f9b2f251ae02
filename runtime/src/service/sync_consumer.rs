//! Receiving SYNC (CiA 301, 7.2.5; 1005h, 1007h, 1019h).

use crate::frame::Frame;
use crate::id::CobId;
use crate::time::{self, Duration, Instant};
use crate::wire::sync::Sync;

/// A SYNC came.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Event {
    /// What it carries.
    pub sync: Sync,
    /// It has another length than 1019h demands, and the one before had not.
    pub length_error: bool,
}

/// Receives SYNC, and keeps the window in which synchronous PDOs may be sent.
#[derive(Clone, Copy, Debug)]
pub struct SyncConsumer {
    id: Option<CobId>,
    counts: bool,
    window: Duration,
    window_end: Option<Instant>,
    length_error: bool,
}

impl SyncConsumer {
    /// Receives SYNC with the COB-ID 080h, without counter and window.
    #[must_use]
    pub const fn new() -> Self {
        SyncConsumer {
            id: Some(CobId::SYNC),
            counts: false,
            window: Duration::ZERO,
            window_end: None,
            length_error: false,
        }
    }

    /// Receives `id`, `None` for no SYNC; with an `overflow` other than 0 it expects a counter; `window` is the time after SYNC
    /// in which synchronous PDOs may be sent, zero for any time.
    pub fn configure(&mut self, id: Option<CobId>, overflow: u8, window: Duration) {
        let counts = overflow != 0;
        // Another SYNC, or one of another length, has not had an error yet.
        self.length_error &= id == self.id && counts == self.counts;
        (self.id, self.counts, self.window) = (id, counts, window);
    }

    /// The COB-ID, if it receives SYNC.
    #[must_use]
    pub const fn id(&self) -> Option<CobId> {
        self.id
    }

    /// Whether the last SYNC had the wrong length.
    #[must_use]
    pub const fn has_length_error(&self) -> bool {
        self.length_error
    }

    /// Takes a SYNC. One of the wrong length counts too, so that a device keeps in step with the others.
    pub fn handle_frame(&mut self, now: Instant, frame: &Frame) -> Option<Event> {
        if Some(frame.id()) != self.id || frame.is_remote() {
            return None;
        }
        let sync = Sync::parse(frame.data()).unwrap_or(Sync { counter: frame.data().first().copied() });
        let wrong = usize::from(frame.dlc()) != usize::from(self.counts);
        let before = core::mem::replace(&mut self.length_error, wrong);
        self.open_window(now);
        let counter = sync.counter.filter(|_| self.counts);
        Some(Event { sync: Sync { counter }, length_error: wrong && !before })
    }

    /// A SYNC was received, or sent by the device itself.
    pub fn open_window(&mut self, now: Instant) {
        self.window_end = time::after(now, self.window);
    }

    /// Whether the window has closed just now: what was not sent yet must not be sent any more.
    pub fn handle_timeout(&mut self, now: Instant) -> bool {
        time::expire(&mut self.window_end, now)
    }

    /// When the window closes.
    #[must_use]
    pub const fn poll_timeout(&self) -> Option<Instant> {
        self.window_end
    }
}

impl Default for SyncConsumer {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(overflow: u8, data: &[u8], counter: Option<u8>, length_error: bool) {
        let mut consumer = SyncConsumer::new();
        consumer.configure(Some(CobId::SYNC), overflow, Duration::ZERO);
        let frame = Frame::new(CobId::SYNC, data).unwrap();
        let event = Event { sync: Sync { counter }, length_error };
        assert_eq!(consumer.handle_frame(Instant::ZERO, &frame), Some(event));
        // An error that stays is reported once.
        let event = Event { length_error: false, ..event };
        assert_eq!(consumer.handle_frame(Instant::ZERO, &frame), Some(event));
    }

    #[test]
    fn the_counter_is_taken_when_it_is_expected() {
        check(0, &[], None, false);
        check(10, &[7], Some(7), false);
        check(10, &[], None, true);
        check(0, &[7], None, true);
        check(10, &[7, 0, 0], Some(7), true);
    }

    #[test]
    fn a_wrong_length_is_forgotten_with_what_was_expected() {
        let mut consumer = SyncConsumer::new();
        consumer.handle_frame(Instant::ZERO, &Frame::from_array(CobId::SYNC, [1])).unwrap();
        consumer.configure(Some(CobId::SYNC), 0, Duration::from_millis(1));
        assert!(consumer.has_length_error());
        consumer.configure(Some(CobId::SYNC), 10, Duration::ZERO);
        assert!(!consumer.has_length_error());
    }

    #[test]
    fn the_window_closes_after_its_time() {
        let mut consumer = SyncConsumer::new();
        consumer.configure(Some(CobId::SYNC), 0, Duration::from_micros(500));
        assert_eq!(consumer.poll_timeout(), None);
        consumer.handle_frame(Instant::ZERO, &Frame::from_array(CobId::SYNC, [])).unwrap();
        let end = Instant::from_micros(500);
        assert_eq!(consumer.poll_timeout(), Some(end));
        assert!(!consumer.handle_timeout(Instant::from_micros(499)));
        assert!(consumer.handle_timeout(end) && !consumer.handle_timeout(end));
    }
}
