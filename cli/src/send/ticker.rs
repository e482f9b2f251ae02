//! Sends frames at regular times.

use std::collections::VecDeque;

use lexican_runtime::host::StateMachine;
use lexican_runtime::{Duration, Frame, Instant};

/// Sends frames periodically, the first ones at once. Every received frame is an event.
pub(super) struct Ticker<F> {
    /// Makes the frames for a tick, given its number from 0 on and its due time since the beginning.
    make: F,
    began: Instant,
    /// Zero to send once.
    period: Duration,
    left: u64,
    ticks: u64,
    next: Option<Instant>,
    unsent: VecDeque<Frame>,
    /// The number of frames sent.
    pub(super) sent: u64,
    /// The greatest delay of a tick.
    pub(super) latest: Duration,
    /// The number of ticks left out because the next one was due already.
    pub(super) skipped: u64,
}

impl<F: FnMut(u64, Duration) -> Vec<Frame>> Ticker<F> {
    pub(super) fn new(now: Instant, every: Option<Duration>, count: Option<u64>, make: F) -> Self {
        let period = every.unwrap_or(Duration::ZERO);
        let left = if period.is_zero() { 1 } else { count.unwrap_or(u64::MAX) };
        let (unsent, latest) = (VecDeque::new(), Duration::ZERO);
        Ticker { make, began: now, period, left, ticks: 0, next: Some(now), unsent, sent: 0, latest, skipped: 0 }
    }

    /// Whether everything has been sent.
    pub(super) fn is_over(&self) -> bool {
        self.next.is_none() && self.unsent.is_empty()
    }
}

impl<F: FnMut(u64, Duration) -> Vec<Frame>> StateMachine for Ticker<F> {
    type Event = Frame;

    fn handle_frame(&mut self, _: Instant, frame: &Frame) -> Option<Frame> {
        Some(*frame)
    }

    fn handle_timeout(&mut self, now: Instant) -> Option<Frame> {
        let due = self.next.filter(|next| *next <= now)?;
        self.latest = self.latest.max(now.since(due));
        self.unsent.extend((self.make)(self.ticks, due.since(self.began)));
        self.ticks += 1;
        self.left -= 1;
        let mut next = due + self.period;
        // After a delay, do not send a burst of missed SYNCs.
        while !self.period.is_zero() && next <= now {
            next += self.period;
            self.skipped += 1;
        }
        self.next = (self.left > 0).then_some(next);
        None
    }

    fn poll_transmit(&mut self, _: Instant) -> Option<Frame> {
        let frame = self.unsent.pop_front()?;
        self.sent += 1;
        Some(frame)
    }

    fn poll_timeout(&self) -> Option<Instant> {
        self.next
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lexican_runtime::CobId;

    /// The frames sent at these times, in ms.
    fn run(ticker: &mut Ticker<impl FnMut(u64, Duration) -> Vec<Frame>>, times: &[u64]) -> Vec<String> {
        let mut sent = Vec::new();
        for &ms in times {
            let now = Instant::ZERO + Duration::from_millis(ms);
            ticker.handle_timeout(now);
            sent.extend(std::iter::from_fn(|| ticker.poll_transmit(now)).map(|frame| format!("{ms} {frame}")));
        }
        sent
    }

    fn numbered(tick: u64, _: Duration) -> Vec<Frame> {
        vec![Frame::from_array(CobId::SYNC, [tick as u8 + 1])]
    }

    #[test]
    fn the_first_frame_is_sent_at_once_and_the_others_in_the_period() {
        let every = Some(Duration::from_millis(10));
        let mut ticker = Ticker::new(Instant::ZERO, every, Some(3), numbered);
        assert_eq!(run(&mut ticker, &[0, 5, 10, 19, 20, 30]), ["0 080#01", "10 080#02", "20 080#03"]);
        assert!(ticker.is_over());
        let mut once = Ticker::new(Instant::ZERO, None, None, numbered);
        assert_eq!((run(&mut once, &[0, 1]), once.is_over()), (vec!["0 080#01".to_owned()], true));
    }

    #[test]
    fn what_is_late_is_sent_once_and_counted() {
        let every = Some(Duration::from_millis(10));
        let mut ticker = Ticker::new(Instant::ZERO, every, None, numbered);
        assert_eq!(run(&mut ticker, &[0, 47, 50]), ["0 080#01", "47 080#02", "50 080#03"]);
        assert_eq!((ticker.skipped, ticker.latest, ticker.is_over()), (3, Duration::from_millis(37), false));
    }
}
