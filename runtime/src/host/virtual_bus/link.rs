//! A link to the virtual bus.

use std::sync::{Arc, Mutex};

use super::attachment::Attachment;
use super::inbox::Inbox;
use super::state::{Clock, State, step};
use crate::host::node::lock;
use crate::host::{Incoming, Link, LinkError};
use crate::{CobId, Frame, Instant};

/// A link to a [`VirtualBus`](super::VirtualBus). Virtual time passes while a link is waited on.
pub struct VirtualLink {
    state: Arc<Mutex<State>>,
    clock: Clock,
    pub(super) inbox: Arc<Mutex<Inbox>>,
    attachment: Attachment,
}

impl VirtualLink {
    pub(super) fn new(state: Arc<Mutex<State>>, inbox: Arc<Mutex<Inbox>>, attachment: Attachment) -> Self {
        let clock = lock(&state).clock.clone();
        VirtualLink { state, clock, inbox, attachment }
    }

    /// Its place on the bus, to unplug it, slow it down or limit its mailbox.
    #[must_use]
    pub fn attachment(&self) -> Attachment {
        self.attachment.clone()
    }
}

impl Link for VirtualLink {
    fn is_real_time(&self) -> bool {
        lock(&self.state).is_in_real_time()
    }

    fn now(&self) -> Instant {
        self.clock.now()
    }

    fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        let mut state = lock(&self.state);
        if !state.condition.carries_frames() {
            return Err(LinkError::NoBus(state.condition));
        }
        state.call(self.attachment.place, |_, _| lock(&self.inbox).outgoing.push_back(*frame));
        Ok(())
    }

    fn receive(&mut self, until: Instant) -> Result<Option<Incoming>, LinkError> {
        loop {
            if let Some(incoming) = lock(&self.inbox).incoming.pop_front() {
                return Ok(Some(incoming));
            }
            if !step(&self.state, until) {
                return Ok(lock(&self.inbox).incoming.pop_front());
            }
        }
    }

    fn listen_to(&mut self, ids: &[CobId]) -> Result<(), LinkError> {
        lock(&self.inbox).wanted = ids.iter().copied().collect();
        Ok(())
    }
}

/// A link leaves the bus when it is dropped, so that frames do not pile up for it.
impl Drop for VirtualLink {
    fn drop(&mut self) {
        lock(&self.inbox).close();
    }
}
