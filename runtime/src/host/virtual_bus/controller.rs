//! The CAN controller of a node.

use std::boxed::Box;
use std::collections::{BTreeSet, VecDeque};
use std::sync::{Arc, Mutex};

use super::fate::Judge;
use super::inbox::Inbox;
use crate::host::node::lock;
use crate::host::{BusState, Incoming, Node};
use crate::{CobId, Duration, Frame, Instant};

/// A CAN controller with acceptance filters, a mailbox and a transmit buffer of one frame, and the node behind it.
pub(super) struct Controller {
    node: Box<dyn Node + Send>,
    /// The queues of a link, which are then the node.
    link: Option<Arc<Mutex<Inbox>>>,
    /// Whether `due` is valid until the next call of the node. Otherwise the node is asked each time.
    pub(super) is_settled: bool,
    due: Option<Instant>,
    is_attached: bool,
    has_power: bool,
    /// The next frame to send. If it loses arbitration, it and all later frames of the node wait.
    buffer: Option<Frame>,
    /// How long the node takes to handle a frame.
    pub(super) response_time: Duration,
    /// Frames that the node has not handled yet, each with the time when it will have done so.
    mailbox: VecDeque<(Instant, Frame)>,
    capacity: usize,
    overruns: u64,
    /// The acceptance filters: the identifiers that concern the node, and their generation.
    accepted: Option<(u32, BTreeSet<CobId>)>,
    /// Decides the fate of the frames that it sends.
    pub(super) judge: Judge,
}

/// What became of a frame that a controller received.
pub(super) enum Taken {
    /// The filters or a full mailbox rejected it.
    Not,
    Handled,
    /// It is in the mailbox until this time.
    Until(Instant),
}

impl Controller {
    pub(super) fn new(node: Box<dyn Node + Send>, response_time: Duration) -> Self {
        Controller {
            is_settled: node.changes_only_when_called(),
            due: node.poll_timeout(),
            node,
            link: None,
            is_attached: true,
            has_power: true,
            buffer: None,
            response_time,
            mailbox: VecDeque::new(),
            capacity: usize::MAX,
            overruns: 0,
            accepted: None,
            judge: Judge::default(),
        }
    }

    /// The controller of a link. It reports frames at once, as interfaces do, which time-stamp them in the controller.
    pub(super) fn of_link(inbox: &Arc<Mutex<Inbox>>) -> Self {
        let controller = Controller::new(Box::new(Arc::clone(inbox)), Duration::ZERO);
        // It has no deadlines, and the link reports when it sends.
        Controller { link: Some(Arc::clone(inbox)), is_settled: true, ..controller }
    }

    /// Whether it receives and sends.
    const fn is_on_bus(&self) -> bool {
        self.is_attached && self.has_power
    }

    pub(super) const fn set_attached(&mut self, is_attached: bool) {
        self.is_attached = is_attached;
    }

    pub(super) fn set_power(&mut self, now: Instant, on: bool) {
        if core::mem::replace(&mut self.has_power, on) != on {
            self.buffer = None;
            self.mailbox.clear();
            self.call(|node| node.set_power(now, on));
        }
    }

    pub(super) fn set_capacity(&mut self, frames: usize) {
        self.capacity = frames;
        if let Some(inbox) = &self.link {
            lock(inbox).capacity = frames;
        }
    }

    pub(super) fn overruns(&self) -> u64 {
        self.overruns + self.link.as_ref().map_or(0, |inbox| lock(inbox).overruns)
    }

    /// Reports the state of the bus to the link, if this is one.
    pub(super) fn report(&self, condition: BusState) {
        if let Some(inbox) = &self.link {
            lock(inbox).take(Incoming::State(condition));
        }
    }

    /// The frame with which it takes part in the next arbitration.
    pub(super) fn contend(&mut self, now: Instant) -> Option<Frame> {
        if !self.is_on_bus() {
            return None;
        }
        if self.buffer.is_none() {
            self.buffer = self.call(|node| node.poll_transmit(now));
        }
        self.buffer
    }

    /// Ends the transmission of the buffered frame: it has won arbitration.
    pub(super) const fn win(&mut self) {
        self.buffer = None;
    }

    /// Keeps a frame that was cut off, to send it again.
    pub(super) const fn hold(&mut self, frame: Frame) {
        self.buffer = Some(frame);
    }

    /// A frame has come over the bus.
    pub(super) fn receive(&mut self, now: Instant, frame: &Frame) -> Taken {
        if !self.is_on_bus() {
            return Taken::Not;
        }
        if self.response_time.is_zero() && self.mailbox.is_empty() {
            self.call(|node| node.handle_frame(now, frame));
            return Taken::Handled;
        }
        if !self.accepts(frame.id()) {
            return Taken::Not;
        }
        if self.mailbox.len() >= self.capacity {
            self.overruns += 1;
            return Taken::Not;
        }
        // The node handles one frame after the other.
        let begins = self.mailbox.back().map_or(now, |(handled, _)| *handled);
        let handled = begins + self.response_time;
        self.mailbox.push_back((handled, *frame));
        Taken::Until(handled)
    }

    fn accepts(&mut self, id: CobId) -> bool {
        let generation = self.node.generation();
        let accepted = match &self.accepted {
            Some((of, accepted)) if *of == generation => accepted,
            _ => &self.accepted.insert((generation, self.node.concerns().into_iter().collect())).1,
        };
        accepted.is_empty() || accepted.contains(&id)
    }

    /// Lets the node handle the oldest frame of the mailbox, if its time has come.
    pub(super) fn handle_mail(&mut self, now: Instant) {
        if self.mailbox.front().is_some_and(|(handled, _)| *handled <= now)
            && let Some((_, frame)) = self.mailbox.pop_front()
        {
            self.call(|node| node.handle_frame(now, &frame));
        }
    }

    pub(super) fn handle_timeout(&mut self, now: Instant) {
        if self.node_timeout().is_some_and(|at| at <= now) {
            self.call(|node| node.handle_timeout(now));
        }
    }

    /// The deadline of the node.
    pub(super) fn node_timeout(&self) -> Option<Instant> {
        if !self.has_power {
            return None;
        }
        if self.is_settled { self.due } else { self.node.poll_timeout() }
    }

    fn call<R>(&mut self, what: impl FnOnce(&mut dyn Node) -> R) -> R {
        let result = what(&mut *self.node);
        if self.is_settled {
            self.due = self.node.poll_timeout();
        }
        result
    }
}
