//! Frames that wait for room in the interface.

use std::collections::VecDeque;

use tokio::sync::oneshot;

use crate::frame::Frame;
use crate::host::link::PATIENCE;
use crate::host::{Link, LinkError, trace};
use crate::time::{Duration, Instant};

/// How often a frame is tried again. No interface reports when it has room.
const NAP: Duration = Duration::from_millis(1);

pub(super) type Reply = oneshot::Sender<Result<(), LinkError>>;

/// Frames on their way to the link: those that were posted, then at most one that waits for room.
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

    /// Sends a frame when no other one waits. A frame that the link refuses is lost, as one on a bad bus is; `reply`
    /// reports it.
    pub(super) fn send(&mut self, link: &mut impl Link, now: Instant, frame: Frame, reply: Option<Reply>) {
        match link.try_send(&frame) {
            Err(LinkError::Full) => {
                self.again = now + NAP;
                self.waiting.push_back(Waiting { frame, reply, is_posted: false, until: now + PATIENCE });
            }
            outcome => {
                trace::sent(now, &frame, &outcome);
                reply_to(reply, outcome);
            }
        }
    }

    /// Sends a frame before those that wait, except for other posted ones.
    pub(super) fn post(&mut self, link: &mut impl Link, frame: Frame) {
        let posted = self.waiting.iter().take_while(|waiting| waiting.is_posted).count();
        let now = link.now();
        self.waiting.insert(posted, Waiting { frame, reply: None, is_posted: true, until: now + PATIENCE });
        if posted == 0 {
            self.again = Instant::ZERO;
            self.retry(link, now);
        }
    }

    /// Sends the frames that wait, if there is room now.
    pub(super) fn retry(&mut self, link: &mut impl Link, now: Instant) {
        if now < self.again {
            return;
        }
        while let Some(first) = self.waiting.front() {
            let outcome = link.try_send(&first.frame);
            if matches!(outcome, Err(LinkError::Full)) && now < first.until {
                self.again = now + NAP;
                return;
            }
            trace::sent(now, &first.frame, &outcome);
            reply_to(self.waiting.pop_front().and_then(|first| first.reply), outcome);
        }
    }

    /// Removes the frames that wait, with the calls that wait for them.
    pub(super) fn take(&mut self) -> impl Iterator<Item = (Frame, Option<Reply>)> + use<> {
        core::mem::take(&mut self.waiting).into_iter().map(|waiting| (waiting.frame, waiting.reply))
    }
}

pub(super) fn reply_to(reply: Option<Reply>, outcome: Result<(), LinkError>) {
    if let Some(reply) = reply {
        // The call may have been dropped.
        drop(reply.send(outcome));
    }
}
