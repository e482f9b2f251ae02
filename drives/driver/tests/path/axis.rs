//! A drive in cyclic synchronous position mode, reduced to what is seen on the bus.

use std::collections::VecDeque;

use lexican_runtime::host::Node;
use lexican_runtime::profile::cia402::{Command, State, Transitions};
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};

/// A misbehaviour of the axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Failing {
    #[default]
    Not,
    /// It does not move.
    Stuck,
    /// It sends no PDO.
    Silent,
    /// Its status word shows that it does not follow.
    Ignoring,
    /// It brakes by itself, and is not enabled again.
    Braking,
}

pub(crate) struct Axis {
    node: NodeId,
    pub(crate) state: State,
    pub(crate) position: i32,
    pub(crate) failing: Failing,
    /// Whether it is in NMT OPERATIONAL.
    operational: bool,
    word: u16,
    target: i32,
    /// Received by RPDO, to take effect at the next SYNC.
    received: Option<(u16, i32)>,
    last_sync: Instant,
    outbox: VecDeque<Frame>,
    /// The largest movement between two SYNCs.
    pub(crate) largest_step: u32,
    /// The largest difference between two consecutive steps.
    pub(crate) largest_jerk: u32,
    last_step: i32,
}

/// How long an enabled axis tolerates missing SYNCs.
const WATCH: Duration = Duration::from_millis(10);

impl Axis {
    pub(crate) fn new(node: NodeId, position: i32) -> Self {
        Axis {
            node,
            state: State::SwitchOnDisabled,
            position,
            failing: Failing::Not,
            operational: true,
            word: 0,
            target: position,
            received: None,
            last_sync: Instant::ZERO,
            outbox: VecDeque::new(),
            largest_step: 0,
            largest_jerk: 0,
            last_step: 0,
        }
    }

    /// Enters FAULT, and sends an emergency.
    pub(crate) fn fail(&mut self, code: u16) {
        self.state = State::Fault;
        let [low, high] = code.to_le_bytes();
        self.outbox.push_back(Frame::from_array(self.id(0x080), [low, high, 1, 0, 0, 0, 0, 0]));
    }

    /// Loses its power, which then comes back.
    pub(crate) fn restart(&mut self) {
        *self = Axis { operational: false, ..Axis::new(self.node, self.position) };
        self.outbox.push_back(Frame::from_array(self.id(0x700), [0]));
    }

    /// It sends a heartbeat with another state: 7Fh is PRE-OPERATIONAL, 04h STOPPED.
    pub(crate) fn leave_operational(&mut self, state: u8) {
        self.operational = false;
        self.outbox.push_back(Frame::from_array(self.id(0x700), [state]));
    }

    fn id(&self, base: u16) -> CobId {
        CobId::of_node(base, self.node)
    }

    fn sync(&mut self, now: Instant) {
        self.last_sync = now;
        self.advance();
        if let Some((word, target)) = self.received.take() {
            let command = Command::parse(self.word, word);
            let brakes = self.failing == Failing::Braking && word & 0x0F == 0x0F;
            if brakes {
                self.state = State::QuickStopActive;
            } else if let Some(arrow) = Transitions::CIA_402.follow(self.state, command) {
                self.state = arrow.to;
            }
            (self.word, self.target) = (word, target);
        }
        if self.failing != Failing::Silent {
            let follows = u16::from(self.failing != Failing::Ignoring) << 12;
            let [low, high] = (self.state.status_bits() | follows).to_le_bytes();
            let [a, b, c, d] = self.position.to_le_bytes();
            self.outbox.push_back(Frame::from_array(self.id(0x380), [low, high, a, b, c, d]));
        }
    }

    /// Reaches the set-point within a period; a quick stop takes no time.
    fn advance(&mut self) {
        let goes = self.state == State::OperationEnabled && self.failing != Failing::Stuck;
        let step = if goes { self.target - self.position } else { 0 };
        self.position += step;
        self.largest_step = self.largest_step.max(step.unsigned_abs());
        self.largest_jerk = self.largest_jerk.max(step.abs_diff(self.last_step));
        self.last_step = step;
    }
}

impl Node for Axis {
    fn handle_frame(&mut self, now: Instant, frame: &Frame) {
        if !self.operational {
            return;
        }
        if frame.id() == CobId::SYNC {
            self.sync(now);
        } else if let (true, &[low, high, a, b, c, d]) = (frame.id() == self.id(0x300), frame.data()) {
            self.received = Some((u16::from_le_bytes([low, high]), i32::from_le_bytes([a, b, c, d])));
        }
    }

    fn handle_timeout(&mut self, now: Instant) {
        if self.poll_timeout().is_some_and(|due| due <= now) {
            // The error of SYNC supervision.
            self.fail(0x8700);
        }
    }

    fn poll_transmit(&mut self, _: Instant) -> Option<Frame> {
        self.outbox.pop_front()
    }

    fn poll_timeout(&self) -> Option<Instant> {
        let watches = matches!(self.state, State::OperationEnabled | State::QuickStopActive);
        watches.then_some(self.last_sync + WATCH)
    }
}
