//! Node guarding on the side of the guarded device, and life guarding, by which it notices that the requests have
//! stopped (CiA 301, 7.2.8.3.2.1; 100Ch and 100Dh).

use crate::frame::Frame;
use crate::id::NodeId;
use crate::time::{self, Duration, Instant};
use crate::wire::heartbeat::ErrorControl;
use crate::wire::nmt::NmtState;

/// What life guarding noticed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Event {
    /// No guarding request came within the life time.
    Lost,
    /// After the loss, a request came again.
    Restored,
}

/// Answers guarding requests with an alternating toggle bit.
#[derive(Clone, Copy, Debug)]
pub struct Guarding {
    node: NodeId,
    life_time: Duration,
    toggle: bool,
    asked: bool,
    deadline: Option<Instant>,
    lost: bool,
}

impl Guarding {
    /// Answers requests; life guarding is off until it is given a life time.
    #[must_use]
    pub const fn new(node: NodeId) -> Self {
        Guarding { node, life_time: Duration::ZERO, toggle: false, asked: false, deadline: None, lost: false }
    }

    /// The life time: guard time x life time factor, zero for no life guarding. A running watch goes on
    /// with it from the next request.
    pub fn configure(&mut self, guard_time: Duration, life_time_factor: u8) {
        self.life_time = guard_time.times(u32::from(life_time_factor));
        if self.life_time.is_zero() {
            self.deadline = None;
            self.lost = false;
        }
    }

    /// Whether requests have stayed away for longer than the life time.
    #[must_use]
    pub const fn is_lost(&self) -> bool {
        self.lost
    }

    /// Takes a guarding request. The first one starts life guarding.
    pub fn handle_frame(&mut self, now: Instant, frame: &Frame) -> Option<Event> {
        if frame.id() != ErrorControl::cob_id(self.node) || !frame.is_remote() {
            return None;
        }
        self.asked = true;
        self.deadline = time::after(now, self.life_time);
        core::mem::take(&mut self.lost).then_some(Event::Restored)
    }

    /// Guarding is lost when the life time has passed.
    pub fn handle_timeout(&mut self, now: Instant) -> Option<Event> {
        if !time::expire(&mut self.deadline, now) {
            return None;
        }
        self.lost = true;
        Some(Event::Lost)
    }

    /// The answer to a request; the toggle bit of the first one is 0.
    pub fn poll_transmit(&mut self, _now: Instant, state: NmtState) -> Option<Frame> {
        if state == NmtState::Initialising || !core::mem::take(&mut self.asked) {
            return None;
        }
        let answer = ErrorControl { state, toggle: self.toggle };
        self.toggle = !self.toggle;
        Some(answer.frame(self.node))
    }

    /// When guarding is lost.
    #[must_use]
    pub const fn poll_timeout(&self) -> Option<Instant> {
        self.deadline
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NODE: NodeId = NodeId::literal(5);

    fn at(ms: u64) -> Instant {
        Instant::ZERO + Duration::from_millis(ms)
    }

    #[test]
    fn a_data_frame_is_no_request() {
        let mut guarding = Guarding::new(NODE);
        guarding.handle_frame(at(0), &ErrorControl::heartbeat(NmtState::Operational).frame(NODE));
        assert_eq!(guarding.poll_transmit(at(0), NmtState::Operational), None);
    }
}
