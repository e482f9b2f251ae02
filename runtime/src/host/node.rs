//! The nodes of a bus, as links and shells see them.

use std::boxed::Box;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::vec::Vec;

use crate::{CobId, Frame, Instant};

/// A node of a bus: the four verbs of a composite, with its dictionary already lent.
pub trait Node {
    /// Handles a frame of another node.
    fn handle_frame(&mut self, now: Instant, frame: &Frame);
    /// Handles the deadline of [`Node::poll_timeout`], which has come. The next one must be later, or `None`, after a
    /// finite number of calls.
    fn handle_timeout(&mut self, now: Instant);
    /// The next frame to send.
    fn poll_transmit(&mut self, now: Instant) -> Option<Frame>;
    /// When to call [`Node::handle_timeout`].
    fn poll_timeout(&self) -> Option<Instant>;

    /// The COB-IDs of all frames that concern the node, as [`Device::cob_ids`] returns them; empty for all frames. A
    /// link that can filter drops the others.
    ///
    /// [`Device::cob_ids`]: crate::device::Device::cob_ids
    fn concerns(&self) -> Vec<CobId> {
        Vec::new()
    }

    /// Changes when [`Node::concerns`] may have changed; see [`Device::generation`].
    ///
    /// [`Device::generation`]: crate::device::Device::generation
    fn generation(&self) -> u32 {
        0
    }

    /// Whether only these calls change what the node sends and when it is due, so that it need not be polled in
    /// between. That is not true of a node with other owners, as in an [`Arc`], and so not the default.
    fn changes_only_when_called(&self) -> bool {
        false
    }

    /// The node loses its power, or gets it back, and then boots with its stored data. Without power, no other method
    /// is called. By default nothing happens, and the node keeps its state.
    fn set_power(&mut self, now: Instant, on: bool) {
        let _ = (now, on);
    }
}

impl<N: Node + ?Sized> Node for Box<N> {
    fn handle_frame(&mut self, now: Instant, frame: &Frame) {
        (**self).handle_frame(now, frame);
    }
    fn handle_timeout(&mut self, now: Instant) {
        (**self).handle_timeout(now);
    }
    fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        (**self).poll_transmit(now)
    }
    fn poll_timeout(&self) -> Option<Instant> {
        (**self).poll_timeout()
    }
    fn concerns(&self) -> Vec<CobId> {
        (**self).concerns()
    }
    fn generation(&self) -> u32 {
        (**self).generation()
    }
    fn changes_only_when_called(&self) -> bool {
        (**self).changes_only_when_called()
    }
    fn set_power(&mut self, now: Instant, on: bool) {
        (**self).set_power(now, on);
    }
}

/// A node shared by its application and a shell.
impl<N: Node> Node for Arc<Mutex<N>> {
    fn handle_frame(&mut self, now: Instant, frame: &Frame) {
        lock(self).handle_frame(now, frame);
    }
    fn handle_timeout(&mut self, now: Instant) {
        lock(self).handle_timeout(now);
    }
    fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        lock(self).poll_transmit(now)
    }
    fn poll_timeout(&self) -> Option<Instant> {
        lock(self).poll_timeout()
    }
    fn concerns(&self) -> Vec<CobId> {
        lock(self).concerns()
    }
    fn generation(&self) -> u32 {
        lock(self).generation()
    }
    fn set_power(&mut self, now: Instant, on: bool) {
        lock(self).set_power(now, on);
    }
}

/// Several nodes behind one link. They do not receive each other's frames.
impl<N: Node> Node for Vec<N> {
    fn handle_frame(&mut self, now: Instant, frame: &Frame) {
        self.iter_mut().for_each(|node| node.handle_frame(now, frame));
    }
    fn handle_timeout(&mut self, now: Instant) {
        for node in self {
            if node.poll_timeout().is_some_and(|deadline| deadline <= now) {
                node.handle_timeout(now);
            }
        }
    }
    fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        self.iter_mut().find_map(|node| node.poll_transmit(now))
    }
    fn poll_timeout(&self) -> Option<Instant> {
        self.iter().filter_map(Node::poll_timeout).min()
    }
    fn concerns(&self) -> Vec<CobId> {
        let each: Vec<Vec<CobId>> = self.iter().map(Node::concerns).collect();
        // An empty list means all frames, so one node without filters needs all of them.
        if each.iter().any(Vec::is_empty) { Vec::new() } else { each.concat() }
    }
    fn generation(&self) -> u32 {
        self.iter().fold(0, |sum, node| sum.wrapping_add(node.generation()))
    }
    fn changes_only_when_called(&self) -> bool {
        self.iter().all(Node::changes_only_when_called)
    }
    fn set_power(&mut self, now: Instant, on: bool) {
        self.iter_mut().for_each(|node| node.set_power(now, on));
    }
}

pub(super) fn lock<T: ?Sized>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // The panic that poisoned it has been reported where it happened.
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
