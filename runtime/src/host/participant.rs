//! The device shell: a [`Node`] that takes part in the bus behind a [`Link`].

use super::link::MOST_SENT;
use super::{BusState, Incoming, Link, LinkError, Node};
use crate::time::Instant;

/// A node and its link. The link passes on only what [concerns](Node::concerns) the node, also after a manager
/// has given it other identifiers.
pub struct Participant<L, N> {
    link: L,
    node: N,
    /// The [generation](Node::generation) that the link was last told to listen to.
    listening: Option<u32>,
    /// The link refused the last frame.
    refused: bool,
}

/// What happens to a participant's bus.
#[derive(Debug)]
pub enum Notice {
    /// It is in another state.
    State(BusState),
    /// The link refuses frames: this one and all that follow are lost, until it takes one again.
    Refused(LinkError),
}

impl<L: Link, N: Node> Participant<L, N> {
    /// Connects a node, which has been switched on, to a bus.
    #[must_use]
    pub const fn new(link: L, node: N) -> Self {
        Participant { link, node, listening: None, refused: false }
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

    /// Gives link and node back.
    #[must_use]
    pub fn into_parts(self) -> (L, N) {
        (self.link, self.node)
    }

    /// Takes part until `until`, `None` then, or until there is something to tell. To be called again at once:
    /// meanwhile the node is deaf. So it is while a frame waits for room in the interface, at most 100 ms.
    ///
    /// # Errors
    ///
    /// [`LinkError`] when the link is gone for good.
    pub fn run(&mut self, until: Instant) -> Result<Option<Notice>, LinkError> {
        let mut is_over = false;
        loop {
            // Before anything is sent: the answer to an order to listen elsewhere is the sign to send there.
            self.listen()?;
            let is_done = match self.transmit()? {
                Sent::Everything => true,
                Sent::Some => false,
                Sent::Refused(refusal) => return Ok(Some(Notice::Refused(refusal))),
            };
            if is_over {
                return Ok(None);
            }
            let deadline = self.node.poll_timeout().map_or(until, |deadline| deadline.min(until));
            let patience = if is_done { deadline } else { self.link.now() };
            let incoming = self.link.receive(patience)?;
            let now = self.link.now();
            match incoming {
                Some(Incoming::Frame(frame)) => self.node.handle_frame(now, &frame),
                Some(Incoming::State(state)) => return Ok(Some(Notice::State(state))),
                None => {}
            }
            // What gets due meanwhile waits: a period that is too short for the machine must not make the node deaf.
            while self.node.poll_timeout().is_some_and(|deadline| deadline <= now) {
                self.node.handle_timeout(now);
            }
            // Not before something was received: nor must a caller that is late.
            is_over = now >= until;
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

    fn transmit(&mut self) -> Result<Sent, LinkError> {
        for _ in 0..MOST_SENT {
            let Some(frame) = self.node.poll_transmit(self.link.now()) else { return Ok(Sent::Everything) };
            match self.link.send(&frame) {
                Err(error) if error.is_final() => return Err(error),
                Err(error) => {
                    if !core::mem::replace(&mut self.refused, true) {
                        return Ok(Sent::Refused(error));
                    }
                }
                Ok(()) => self.refused = false,
            }
        }
        Ok(Sent::Some)
    }
}

/// How much of what there is to send was sent.
enum Sent {
    Everything,
    Some,
    /// A frame was refused, the first of a series.
    Refused(LinkError),
}
