//! Node guarding as the manager does it: asks a node for its state in a fixed period, and watches the
//! toggle bit of the answers (CiA 301, 7.2.8.3.2.1).

use crate::frame::Frame;
use crate::id::NodeId;
use crate::time::{self, Duration, Instant, earliest};
use crate::wire::heartbeat::ErrorControl;
use crate::wire::nmt::NmtState;

use super::heartbeat_consumer;

/// What guarding noticed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Event {
    /// The node sent its boot-up message.
    BootedUp,
    /// The first answer came, or the first after the loss.
    Started(NmtState),
    /// The node is in another state.
    StateChanged(NmtState),
    /// An answer had the same toggle bit as the one before: the node repeats itself, or an answer got lost.
    ToggleError,
    /// No answer came within the life time.
    Lost,
}

/// What a heartbeat says, as if it were an answer.
impl From<heartbeat_consumer::Event> for Event {
    fn from(event: heartbeat_consumer::Event) -> Self {
        match event {
            heartbeat_consumer::Event::BootedUp => Event::BootedUp,
            heartbeat_consumer::Event::Started(state) => Event::Started(state),
            heartbeat_consumer::Event::StateChanged(state) => Event::StateChanged(state),
            heartbeat_consumer::Event::Lost => Event::Lost,
        }
    }
}

/// Guards one node.
#[derive(Clone, Copy, Debug)]
pub struct NodeGuard {
    node: NodeId,
    guard_time: Duration,
    life_time: Duration,
    state: Option<NmtState>,
    toggle: Option<bool>,
    next: Option<Instant>,
    deadline: Option<Instant>,
    ask: bool,
    lost: bool,
}

impl NodeGuard {
    /// Asks `node` every `guard_time`; it is lost when it does not answer for `life_time_factor` times that.
    #[must_use]
    pub fn new(node: NodeId, guard_time: Duration, life_time_factor: u8) -> Self {
        NodeGuard {
            node,
            guard_time,
            life_time: guard_time.times(u32::from(life_time_factor)),
            state: None,
            toggle: None,
            next: None,
            deadline: None,
            ask: false,
            lost: false,
        }
    }

    /// Begins: the first request is due now. Does nothing if the guard time is zero.
    pub fn start(&mut self, now: Instant) {
        if !self.guard_time.is_zero() {
            self.next = Some(now);
        }
    }

    /// The node that is guarded.
    #[must_use]
    pub const fn node(&self) -> NodeId {
        self.node
    }

    /// The node's state; `None` before its first answer and while it is lost.
    #[must_use]
    pub const fn state(&self) -> Option<NmtState> {
        self.state
    }

    /// Takes an answer.
    pub fn handle_frame(&mut self, now: Instant, frame: &Frame) -> Option<Event> {
        if frame.id() != ErrorControl::cob_id(self.node) || frame.is_remote() {
            return None;
        }
        let answer = ErrorControl::parse(frame.data())?;
        if answer == ErrorControl::heartbeat(NmtState::Initialising) {
            // The toggle bit begins anew.
            self.toggle = None;
            self.state = None;
            return Some(Event::BootedUp);
        }
        if self.toggle.replace(answer.toggle) == Some(answer.toggle) {
            return Some(Event::ToggleError);
        }
        self.lost = false;
        self.deadline = time::after(now, self.life_time);
        match self.state.replace(answer.state) {
            Some(state) if state == answer.state => None,
            Some(_) => Some(Event::StateChanged(answer.state)),
            None => Some(Event::Started(answer.state)),
        }
    }

    /// The next request is due, or the node is lost.
    pub fn handle_timeout(&mut self, now: Instant) -> Option<Event> {
        if time::tick(&mut self.next, self.guard_time, now) {
            self.ask = true;
            // A node that never answers is lost too.
            if !self.lost && self.deadline.is_none() {
                self.deadline = time::after(now, self.life_time);
            }
        }
        if !time::expire(&mut self.deadline, now) {
            return None;
        }
        self.lost = true;
        self.state = None;
        Some(Event::Lost)
    }

    /// Whether [`NodeGuard::poll_transmit`] has a request.
    pub(crate) const fn has_outgoing(&self) -> bool {
        self.ask
    }

    /// The request, when one is due.
    pub fn poll_transmit(&mut self, _now: Instant) -> Option<Frame> {
        core::mem::take(&mut self.ask).then(|| ErrorControl::request(self.node))
    }

    /// When the next request is due or the node is lost.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        earliest([self.next, self.deadline])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::id::CobId;

    const NODE: NodeId = NodeId::literal(5);

    fn at(ms: u64) -> Instant {
        Instant::ZERO + Duration::from_millis(ms)
    }

    fn guard() -> NodeGuard {
        let mut guard = NodeGuard::new(NODE, Duration::from_millis(100), 3);
        guard.start(at(0));
        guard
    }

    fn answer(guard: &mut NodeGuard, ms: u64, byte: u8) -> Option<Event> {
        guard.handle_frame(at(ms), &Frame::from_array(CobId::standard(0x705).unwrap(), [byte]))
    }

    #[test]
    fn requests_are_sent_in_the_guard_time() {
        let mut guard = guard();
        let mut sent = std::vec::Vec::new();
        for ms in 0..=250 {
            guard.handle_timeout(at(ms));
            sent.extend(guard.poll_transmit(at(ms)).map(|frame| std::format!("{ms} {frame}")));
        }
        assert_eq!(sent, ["0 705#R1", "100 705#R1", "200 705#R1"]);
    }

    #[test]
    fn answers_tell_the_state_and_must_toggle() {
        let mut guard = guard();
        assert_eq!(answer(&mut guard, 1, 0x7F), Some(Event::Started(NmtState::PreOperational)));
        assert_eq!(answer(&mut guard, 101, 0xFF), None);
        assert_eq!(answer(&mut guard, 201, 0x05), Some(Event::StateChanged(NmtState::Operational)));
        assert_eq!(answer(&mut guard, 301, 0x05), Some(Event::ToggleError));
        assert_eq!(answer(&mut guard, 401, 0x85), None);
        assert_eq!(answer(&mut guard, 402, 0x00), Some(Event::BootedUp));
        assert_eq!(answer(&mut guard, 403, 0x7F), Some(Event::Started(NmtState::PreOperational)));
    }

    #[test]
    fn a_silent_node_is_lost_once_and_may_come_back() {
        let mut guard = guard();
        let mut lost = std::vec::Vec::new();
        for ms in 0..=1000 {
            lost.extend(guard.handle_timeout(at(ms)).map(|event| (ms, event)));
        }
        assert_eq!(lost, [(300, Event::Lost)]);
        assert_eq!(answer(&mut guard, 1001, 0x05), Some(Event::Started(NmtState::Operational)));
        assert_eq!((guard.handle_timeout(at(1300)), guard.handle_timeout(at(1301))), (None, Some(Event::Lost)));
    }
}
