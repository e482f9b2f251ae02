//! How a manager monitors a node: by its heartbeat, or by guarding.

use crate::frame::Frame;
use crate::id::NodeId;
use crate::service::heartbeat_consumer::HeartbeatConsumer;
use crate::service::node_guard::{Event, NodeGuard};
use crate::time::{Duration, Instant};

#[derive(Clone, Copy, Debug)]
pub(super) enum Watch {
    Heartbeat(HeartbeatConsumer),
    Guarding(NodeGuard),
}

impl Watch {
    pub(super) const fn heartbeat(node: NodeId, time: Duration) -> Self {
        Watch::Heartbeat(HeartbeatConsumer::new(node, time))
    }

    pub(super) fn guarding(node: NodeId, guard_time: Duration, life_time_factor: u8) -> Self {
        Watch::Guarding(NodeGuard::new(node, guard_time, life_time_factor))
    }

    /// Begins guarding.
    pub(super) fn start(&mut self, now: Instant) {
        if let Watch::Guarding(guard) = self {
            guard.start(now);
        }
    }

    pub(super) fn handle_frame(&mut self, now: Instant, frame: &Frame) -> Option<Event> {
        match self {
            Watch::Heartbeat(consumer) => consumer.handle_frame(now, frame).map(Event::from),
            Watch::Guarding(guard) => guard.handle_frame(now, frame),
        }
    }

    pub(super) fn handle_timeout(&mut self, now: Instant) -> Option<Event> {
        match self {
            Watch::Heartbeat(consumer) => consumer.handle_timeout(now).map(Event::from),
            Watch::Guarding(guard) => guard.handle_timeout(now),
        }
    }

    /// Whether [`Watch::poll_transmit`] has a frame.
    pub(super) const fn has_outgoing(&self) -> bool {
        matches!(self, Watch::Guarding(guard) if guard.has_outgoing())
    }

    pub(super) fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        match self {
            Watch::Heartbeat(_) => None,
            Watch::Guarding(guard) => guard.poll_transmit(now),
        }
    }

    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        match self {
            Watch::Heartbeat(consumer) => consumer.poll_timeout(),
            Watch::Guarding(guard) => guard.poll_timeout(),
        }
    }
}
