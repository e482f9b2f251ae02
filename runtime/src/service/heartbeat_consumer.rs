//! Watching the heartbeat of another node (CiA 301, 7.2.8.3.2.2; 1016h).
//!
//! The first heartbeat arms the watch; a boot-up message disarms it until the next heartbeat.

use crate::frame::Frame;
use crate::id::NodeId;
use crate::time::{self, Duration, Instant};
use crate::wire::heartbeat::ErrorControl;
use crate::wire::nmt::NmtState;

/// What is known of a node's heartbeat.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Heartbeat {
    /// None came yet, or the node booted and has sent none since.
    Unknown,
    /// The last one had this state, and the next one is not overdue.
    Alive(NmtState),
    /// The next one is overdue.
    Lost,
}

/// What happened to a heartbeat.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Event {
    /// The node sent its boot-up message.
    BootedUp,
    /// The first heartbeat came, or the first after the loss.
    Started(NmtState),
    /// The node is in another state.
    StateChanged(NmtState),
    /// No heartbeat came in time.
    Lost,
}

/// Watches one node.
#[derive(Clone, Copy, Debug)]
pub struct HeartbeatConsumer {
    node: NodeId,
    time: Duration,
    heartbeat: Heartbeat,
    deadline: Option<Instant>,
}

impl HeartbeatConsumer {
    /// Watches `node`, which must send a heartbeat every `time`. With a time of zero, its state is
    /// followed but it is never lost.
    #[must_use]
    pub const fn new(node: NodeId, time: Duration) -> Self {
        HeartbeatConsumer { node, time, heartbeat: Heartbeat::Unknown, deadline: None }
    }

    /// The node that is watched.
    #[must_use]
    pub const fn node(&self) -> NodeId {
        self.node
    }

    /// The time within which a heartbeat must come.
    #[must_use]
    pub const fn time(&self) -> Duration {
        self.time
    }

    /// What is known of the node.
    #[must_use]
    pub const fn heartbeat(&self) -> Heartbeat {
        self.heartbeat
    }

    /// Takes what the node sends under its error control COB-ID.
    pub fn handle_frame(&mut self, now: Instant, frame: &Frame) -> Option<Event> {
        if frame.id() != ErrorControl::cob_id(self.node) || frame.is_remote() {
            return None;
        }
        let message = ErrorControl::parse(frame.data())?;
        if message == ErrorControl::heartbeat(NmtState::Initialising) {
            self.heartbeat = Heartbeat::Unknown;
            self.deadline = None;
            return Some(Event::BootedUp);
        }
        let before = core::mem::replace(&mut self.heartbeat, Heartbeat::Alive(message.state));
        self.deadline = time::after(now, self.time);
        match before {
            Heartbeat::Alive(state) if state == message.state => None,
            Heartbeat::Alive(_) => Some(Event::StateChanged(message.state)),
            Heartbeat::Unknown | Heartbeat::Lost => Some(Event::Started(message.state)),
        }
    }

    /// The heartbeat is lost when its time has passed.
    pub fn handle_timeout(&mut self, now: Instant) -> Option<Event> {
        if !time::expire(&mut self.deadline, now) {
            return None;
        }
        self.heartbeat = Heartbeat::Lost;
        Some(Event::Lost)
    }

    /// When the heartbeat is lost.
    #[must_use]
    pub const fn poll_timeout(&self) -> Option<Instant> {
        self.deadline
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::id::CobId;

    fn at(ms: u64) -> Instant {
        Instant::ZERO + Duration::from_millis(ms)
    }

    fn feed(consumer: &mut HeartbeatConsumer, ms: u64, byte: u8) -> Option<Event> {
        consumer.handle_frame(at(ms), &Frame::from_array(CobId::standard(0x705).unwrap(), [byte]))
    }

    #[test]
    fn the_first_heartbeat_arms_the_watch() {
        let mut consumer = HeartbeatConsumer::new(NodeId::literal(5), Duration::from_millis(100));
        assert_eq!((consumer.poll_timeout(), consumer.handle_timeout(at(1000))), (None, None));
        assert_eq!(feed(&mut consumer, 1000, 0x00), Some(Event::BootedUp));
        assert_eq!(consumer.poll_timeout(), None);
        assert_eq!(feed(&mut consumer, 1010, 0x7F), Some(Event::Started(NmtState::PreOperational)));
        assert_eq!(consumer.poll_timeout(), Some(at(1110)));
        assert_eq!(feed(&mut consumer, 1100, 0x7F), None);
        assert_eq!(feed(&mut consumer, 1190, 0x05), Some(Event::StateChanged(NmtState::Operational)));
        assert_eq!((consumer.handle_timeout(at(1289)), consumer.handle_timeout(at(1290))), (None, Some(Event::Lost)));
        assert_eq!((consumer.heartbeat(), consumer.poll_timeout()), (Heartbeat::Lost, None));
        assert_eq!(feed(&mut consumer, 1400, 0x05), Some(Event::Started(NmtState::Operational)));
    }

    #[test]
    fn a_boot_up_message_disarms_the_watch() {
        let mut consumer = HeartbeatConsumer::new(NodeId::literal(5), Duration::from_millis(100));
        feed(&mut consumer, 0, 0x05);
        assert_eq!(feed(&mut consumer, 50, 0x00), Some(Event::BootedUp));
        assert_eq!((consumer.poll_timeout(), consumer.handle_timeout(at(1000))), (None, None));
        assert_eq!(consumer.heartbeat(), Heartbeat::Unknown);
    }

    #[test]
    fn other_nodes_remote_frames_and_nonsense_are_no_heartbeat() {
        let mut consumer = HeartbeatConsumer::new(NodeId::literal(5), Duration::from_millis(100));
        assert_eq!(feed(&mut consumer, 0, 0x06), None);
        let other = Frame::from_array(CobId::standard(0x706).unwrap(), [5]);
        assert_eq!(consumer.handle_frame(at(0), &other), None);
        assert_eq!(consumer.handle_frame(at(0), &ErrorControl::request(NodeId::literal(5))), None);
        assert_eq!(consumer.heartbeat(), Heartbeat::Unknown);
    }
}
