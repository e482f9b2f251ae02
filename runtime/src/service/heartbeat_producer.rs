//! The heartbeat of a device (CiA 301, 7.2.8.3.2.2; 1017h).

use crate::frame::Frame;
use crate::id::NodeId;
use crate::time::{self, Duration, Instant};
use crate::wire::heartbeat::ErrorControl;
use crate::wire::nmt::NmtState;

/// Sends the NMT state in a fixed period.
#[derive(Clone, Copy, Debug)]
pub struct HeartbeatProducer {
    node: NodeId,
    period: Duration,
    next: Option<Instant>,
    due: bool,
}

impl HeartbeatProducer {
    /// Silent, until it is given a period.
    #[must_use]
    pub const fn new(node: NodeId) -> Self {
        HeartbeatProducer { node, period: Duration::ZERO, next: None, due: false }
    }

    /// The period; zero when there is no heartbeat.
    #[must_use]
    pub const fn period(&self) -> Duration {
        self.period
    }

    /// Takes a new period, zero for none. The first heartbeat comes `first` from now: zero when a
    /// manager sets the period, a whole period when the boot-up message stood for the first one.
    pub fn configure(&mut self, now: Instant, period: Duration, first: Duration) {
        self.period = period;
        self.due = false;
        self.next = if period.is_zero() { None } else { Some(now + first) };
    }

    /// A heartbeat is due when its time has come; this is never an event.
    pub fn handle_timeout(&mut self, now: Instant) {
        self.due |= time::tick(&mut self.next, self.period, now);
    }

    /// The heartbeat, when one is due.
    pub fn poll_transmit(&mut self, _now: Instant, state: NmtState) -> Option<Frame> {
        if state == NmtState::Initialising || !core::mem::take(&mut self.due) {
            return None;
        }
        Some(ErrorControl::heartbeat(state).frame(self.node))
    }

    /// When the next heartbeat is due.
    #[must_use]
    pub const fn poll_timeout(&self) -> Option<Instant> {
        self.next
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(ms: u64) -> Instant {
        Instant::ZERO + Duration::from_millis(ms)
    }

    fn sent(producer: &mut HeartbeatProducer, now: Instant) -> Option<std::string::String> {
        producer.handle_timeout(now);
        producer.poll_transmit(now, NmtState::Operational).map(|frame| std::format!("{frame}"))
    }

    #[test]
    fn heartbeats_keep_their_period_when_served_late() {
        let mut producer = HeartbeatProducer::new(NodeId::literal(5));
        producer.configure(at(0), Duration::from_millis(100), Duration::ZERO);
        assert_eq!(sent(&mut producer, at(0)).as_deref(), Some("705#05"));
        assert_eq!(producer.poll_timeout(), Some(at(100)));
        assert_eq!(sent(&mut producer, at(99)), None);
        assert_eq!(sent(&mut producer, at(130)).as_deref(), Some("705#05"));
        assert_eq!(producer.poll_timeout(), Some(at(200)));
        // Late by several periods: one heartbeat, not a burst.
        assert!(sent(&mut producer, at(777)).is_some());
        assert_eq!((sent(&mut producer, at(777)), producer.poll_timeout()), (None, Some(at(877))));
    }
}
