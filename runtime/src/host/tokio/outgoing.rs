//! Frames on their way out, which wait for room.

use std::collections::VecDeque;

use super::command::Reply;
use crate::frame::Frame;
use crate::host::link::PATIENCE;
use crate::host::{Link, LinkError};
use crate::time::{Duration, Instant};

/// How often it is tried again. No interface reports when it has room.
const NAP: Duration = Duration::from_millis(1);

/// The way out: at most one frame that waits for room, and before it those that were posted.
#[derive(Default)]
pub(super) struct Outgoing {
    waiting: VecDeque<Waiting>,
    /// When to try again.
    again: Instant,
}

struct Waiting {
    frame: Frame,
    reply: Option<Reply>,
    is_posted: bool,
    until: Instant,
}

impl Outgoing {
    /// Whether the next frame may be sent.
    pub(super) fn is_free(&self) -> bool {
        self.waiting.is_empty()
    }

    /// When to [try again](Outgoing::retry).
    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        (!self.waiting.is_empty()).then_some(self.again)
    }

    /// Sends a frame when nothing else waits. A frame that the link refuses is lost, as one on a bad bus is; `reply`
    /// reports it.
    pub(super) fn send(&mut self, link: &mut impl Link, frame: Frame, reply: Option<Reply>) {
        match link.try_send(&frame) {
            Err(LinkError::Full) => {
                let now = link.now();
                self.again = now + NAP;
                self.waiting.push_back(Waiting { frame, reply, is_posted: false, until: now + PATIENCE });
            }
            outcome => tell(reply, outcome),
        }
    }

    /// Sends a frame before all that waits, but for other such frames.
    pub(super) fn post(&mut self, link: &mut impl Link, frame: Frame) {
        let posted = self.waiting.iter().take_while(|waiting| waiting.is_posted).count();
        let until = link.now() + PATIENCE;
        self.waiting.insert(posted, Waiting { frame, reply: None, is_posted: true, until });
        if posted == 0 {
            self.again = Instant::ZERO;
            self.retry(link);
        }
    }

    /// Sends the frames that wait, if there is room now.
    pub(super) fn retry(&mut self, link: &mut impl Link) {
        if self.waiting.is_empty() || link.now() < self.again {
            return;
        }
        while let Some(first) = self.waiting.front() {
            let outcome = link.try_send(&first.frame);
            if matches!(outcome, Err(LinkError::Full)) && link.now() < first.until {
                self.again = link.now() + NAP;
                return;
            }
            tell(self.waiting.pop_front().and_then(|first| first.reply), outcome);
        }
    }

    /// The frames that wait, and the calls that wait for them: there will be no other time.
    pub(super) fn take(&mut self) -> impl Iterator<Item = (Frame, Option<Reply>)> + use<> {
        core::mem::take(&mut self.waiting).into_iter().map(|waiting| (waiting.frame, waiting.reply))
    }
}

pub(super) fn tell(reply: Option<Reply>, outcome: Result<(), LinkError>) {
    if let Some(reply) = reply {
        // The call may have been dropped.
        drop(reply.send(outcome));
    }
}
