//! Frames on their way out: at most one, which waits for room.

use super::Reply;
use crate::frame::Frame;
use crate::host::link::PATIENCE;
use crate::host::{Link, LinkError};
use crate::time::{Duration, Instant};

/// How often it is tried again. Nobody tells when an interface has room.
const NAP: Duration = Duration::from_millis(1);

/// The way out. Nothing overtakes the frame that waits there.
#[derive(Default)]
pub(super) struct Outgoing(Option<Waiting>);

struct Waiting {
    frame: Frame,
    reply: Option<Reply>,
    again: Instant,
    until: Instant,
}

impl Outgoing {
    /// Whether the next frame may be sent.
    pub(super) const fn is_free(&self) -> bool {
        self.0.is_none()
    }

    /// When to [try again](Outgoing::retry).
    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        self.0.as_ref().map(|waiting| waiting.again)
    }

    /// Sends a frame when nothing else waits. A frame that the link refuses is lost, as one on a bad bus is;
    /// `reply` tells it to whoever wants to know.
    pub(super) fn send(&mut self, link: &mut impl Link, frame: Frame, reply: Option<Reply>) {
        match link.try_send(&frame) {
            Err(LinkError::Full) => {
                let now = link.now();
                self.0 = Some(Waiting { frame, reply, again: now + NAP, until: now + PATIENCE });
            }
            outcome => tell(reply, outcome),
        }
    }

    /// Sends the frame that waits, if there is room now.
    pub(super) fn retry(&mut self, link: &mut impl Link) {
        if let Some(waiting) = self.0.take_if(|waiting| waiting.again <= link.now()) {
            match link.try_send(&waiting.frame) {
                Err(LinkError::Full) if link.now() < waiting.until => {
                    self.0 = Some(Waiting { again: link.now() + NAP, ..waiting });
                }
                outcome => tell(waiting.reply, outcome),
            }
        }
    }

    /// The frame that waits, and who waits for it: there will be no other time.
    pub(super) fn take(&mut self) -> Option<(Frame, Option<Reply>)> {
        self.0.take().map(|waiting| (waiting.frame, waiting.reply))
    }
}

pub(super) fn tell(reply: Option<Reply>, outcome: Result<(), LinkError>) {
    if let Some(reply) = reply {
        // Nobody may be waiting any more.
        drop(reply.send(outcome));
    }
}
