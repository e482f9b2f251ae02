//! Which controllers are to be called and when, so that an event costs nothing for the nodes that sleep.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::vec::Vec;

use super::controller::Controller;
use crate::{Frame, Instant};

/// What the controllers have to do. Each is known by its place, an index.
#[derive(Default)]
pub(super) struct Agenda {
    /// When each frame in a mailbox is handled.
    mail: Times,
    /// Deadlines of settled controllers. An entry that differs from `due_of` is out of date.
    due: Times,
    due_of: Vec<Option<Instant>>,
    /// Controllers whose nodes change without being called.
    unsettled: Vec<usize>,
    /// Controllers that may have a frame to send, in any order. One that had none is left out until it is called.
    senders: Vec<usize>,
    /// Whether a place is among the senders.
    is_sender: Vec<bool>,
}

/// Ordered by time, then by place.
type Times = BinaryHeap<Reverse<(Instant, usize)>>;

fn first(times: &Times) -> Option<Instant> {
    times.peek().map(|Reverse((at, _))| *at)
}

impl Agenda {
    pub(super) fn add(&mut self, controller: &Controller) {
        let place = self.due_of.len();
        if !controller.is_settled {
            self.unsettled.push(place);
        }
        self.due_of.push(None);
        self.is_sender.push(false);
        self.note(place, controller);
    }

    /// Updates the agenda after a call of the controller.
    pub(super) fn note(&mut self, place: usize, controller: &Controller) {
        if !std::mem::replace(&mut self.is_sender[place], true) {
            self.senders.push(place);
        }
        if controller.is_settled {
            self.reschedule(place, controller.node_timeout());
        }
    }

    fn reschedule(&mut self, place: usize, due: Option<Instant>) {
        if self.due_of[place] != due {
            self.due_of[place] = due;
            self.due.extend(due.map(|due| Reverse((due, place))));
            while let Some(Reverse((at, place))) = self.due.peek().copied()
                && self.due_of[place] != Some(at)
            {
                self.due.pop();
            }
        }
    }

    /// Notes when the controller will have handled a frame in its mailbox.
    pub(super) fn add_mail(&mut self, handled: Instant, place: usize) {
        self.mail.push(Reverse((handled, place)));
    }

    /// The next controller that has handled a frame by `now`.
    pub(super) fn take_mail(&mut self, now: Instant) -> Option<usize> {
        first(&self.mail).filter(|handled| *handled <= now)?;
        self.mail.pop().map(|Reverse((_, place))| place)
    }

    /// The controllers whose nodes may be due at `now`, in order.
    pub(super) fn take_due(&mut self, now: Instant) -> Vec<usize> {
        let mut places = self.unsettled.clone();
        while first(&self.due).is_some_and(|due| due <= now)
            && let Some(Reverse((at, place))) = self.due.pop()
        {
            if self.due_of[place].take_if(|due| *due == at).is_some() {
                places.push(place);
            }
        }
        places.sort_unstable();
        places
    }

    pub(super) fn poll_timeout(&self, controllers: &[Controller]) -> Option<Instant> {
        let unsettled = self.unsettled.iter().filter_map(|place| controllers[*place].node_timeout());
        unsettled.chain(first(&self.mail)).chain(first(&self.due)).min()
    }

    /// The controller that wins the arbitration at `now`, and its frame.
    pub(super) fn arbitrate(&mut self, controllers: &mut [Controller], now: Instant) -> Option<(usize, Frame)> {
        let mut winner: Option<(usize, Frame)> = None;
        let mut senders = std::mem::take(&mut self.senders);
        senders.retain(|&place| {
            let controller = &mut controllers[place];
            let frame = controller.contend(now);
            if let Some(frame) = frame
                && winner.is_none_or(|(at, best)| (frame.arbitration(), place) < (best.arbitration(), at))
            {
                winner = Some((place, frame));
            }
            if controller.is_settled {
                self.is_sender[place] = frame.is_some();
                self.reschedule(place, controller.node_timeout());
            }
            self.is_sender[place]
        });
        self.senders = senders;
        winner
    }
}
