//! What a link has received and sends.

use std::collections::{BTreeSet, VecDeque};

use crate::host::{Incoming, Node};
use crate::{CobId, Frame, Instant};

/// The two queues between a link and the bus.
pub(super) struct Inbox {
    pub(super) incoming: VecDeque<Incoming>,
    pub(super) outgoing: VecDeque<Frame>,
    /// The identifiers that the link receives; all if empty.
    pub(super) wanted: BTreeSet<CobId>,
    /// How many frames may wait until they are read.
    pub(super) capacity: usize,
    pub(super) overruns: u64,
    closed: bool,
}

impl Inbox {
    pub(super) const fn new() -> Self {
        Inbox {
            incoming: VecDeque::new(),
            outgoing: VecDeque::new(),
            wanted: BTreeSet::new(),
            capacity: usize::MAX,
            overruns: 0,
            closed: false,
        }
    }

    /// Rejects all that comes from now on. What is queued to be sent is still sent.
    pub(super) fn close(&mut self) {
        self.closed = true;
        self.incoming.clear();
    }

    pub(super) fn take(&mut self, incoming: Incoming) {
        if !self.closed {
            self.incoming.push_back(incoming);
        }
    }

    fn take_frame(&mut self, frame: Frame) {
        if self.incoming.len() < self.capacity || self.closed {
            return self.take(Incoming::Frame(frame));
        }
        self.overruns += 1;
        match self.incoming.back_mut() {
            Some(Incoming::Gap(frames)) => *frames = frames.saturating_add(1),
            _ => self.incoming.push_back(Incoming::Gap(1)),
        }
    }
}

impl Node for Inbox {
    fn handle_frame(&mut self, _: Instant, frame: &Frame) {
        if self.wanted.is_empty() || self.wanted.contains(&frame.id()) {
            self.take_frame(*frame);
        }
    }
    fn handle_timeout(&mut self, _: Instant) {}
    fn poll_transmit(&mut self, _: Instant) -> Option<Frame> {
        self.outgoing.pop_front()
    }
    fn poll_timeout(&self) -> Option<Instant> {
        None
    }
}
