//! The device shell: a [`Node`] that takes part in the bus behind a [`Link`].

use super::pump::{Pump, Turn};
use super::{BusState, Link, LinkError, Node};
use crate::time::Instant;

/// A node and its link. The link's filter is kept at the frames that [concern](Node::concerns) the node, even when a
/// manager changes its COB-IDs.
pub struct Participant<L, N> {
    link: L,
    node: N,
    pump: Pump,
    /// The [generation](Node::generation) of the COB-IDs that the link receives.
    listening: Option<u32>,
}

/// A change of a participant's bus.
#[derive(Debug)]
pub enum Notice {
    /// The bus has changed its state.
    State(BusState),
    /// This many frames are missing: see [`Incoming::Gap`](super::Incoming::Gap).
    Gap(u32),
    /// The link refuses frames: they are lost until it takes one again.
    Refused(LinkError),
}

impl<L: Link, N: Node> Participant<L, N> {
    /// Connects a started node to a bus.
    #[must_use]
    pub fn new(link: L, node: N) -> Self {
        Participant { link, node, pump: Pump::new(), listening: None }
    }

    /// The link's time.
    #[must_use]
    pub fn now(&self) -> Instant {
        self.link.now()
    }

    /// The node.
    pub const fn node(&mut self) -> &mut N {
        &mut self.node
    }

    /// Returns link and node.
    #[must_use]
    pub fn into_parts(self) -> (L, N) {
        (self.link, self.node)
    }

    /// Runs the node until there is something to report, or until `until`, and then returns `None`. Call it again at
    /// once, since no frame is received between two calls. Nor is one received while a frame waits for room in the
    /// interface, which takes at most 100 ms.
    pub fn run(&mut self, until: Instant) -> Result<Option<Notice>, LinkError> {
        loop {
            // Before anything is sent: once a manager has the answer to a new COB-ID, it may use that at once.
            self.listen()?;
            match self.pump.turn(&mut self.link, &mut self.node, until) {
                Ok(Turn::Event(never)) => match never {},
                Ok(Turn::Bus(state)) => return Ok(Some(Notice::State(state))),
                Ok(Turn::Gap(frames)) => return Ok(Some(Notice::Gap(frames))),
                Ok(Turn::Idle) => {}
                Ok(Turn::Over) => return Ok(None),
                Err(error) if error.is_final() => return Err(error),
                // Only the first of a series is reported.
                Err(error) if self.pump.refused() == 1 => return Ok(Some(Notice::Refused(error))),
                Err(_) => {}
            }
        }
    }

    fn listen(&mut self) -> Result<(), LinkError> {
        let generation = self.node.generation();
        if self.listening != Some(generation) {
            self.link.listen_to(&self.node.concerns())?;
            self.listening = Some(generation);
        }
        Ok(())
    }
}
