//! What the shell does between two calls of its link.

use super::Network;
use crate::abort::AbortCode;
use crate::host::link::MOST_SENT;
use crate::host::{AccessError, Incoming, Link, LinkError};
use crate::id::NodeId;
use crate::manager::{BeginError, Event, Manager, Payloads};
use crate::service::sdo_client::{self, Payload};
use crate::time::{Duration, Instant};

/// How long frames that have come already are taken before a deadline that has passed.
const GRACE: Duration = Duration::from_millis(20);

/// How many events are kept until somebody asks for them.
const KEPT: usize = 1024;

/// What came of a step.
#[derive(PartialEq, Eq)]
pub(super) enum Step {
    /// Something happened that ends no transfer.
    On,
    /// The transfer with a node ended.
    Sdo(NodeId, sdo_client::Event),
    /// The time is over.
    Over,
}

/// The payload of the transfer with one node. Others, which the application has begun by itself, have none.
struct Lent<'a, P> {
    node: NodeId,
    payload: &'a mut P,
    nothing: [u8; 0],
}

impl<P: Payload> Payloads for Lent<'_, P> {
    fn of_node(&mut self, node: NodeId) -> &mut dyn Payload {
        if node == self.node { self.payload } else { &mut self.nothing }
    }
}

impl<L: Link> Network<L> {
    /// Runs one SDO transfer to its end, and returns the number of bytes.
    pub(super) fn transfer(
        &mut self,
        node: NodeId,
        payload: &mut impl Payload,
        begin: impl FnOnce(&mut Manager<127>, Instant) -> Result<(), BeginError>,
    ) -> Result<u32, AccessError> {
        let mut now = self.now();
        self.audience.include(node, &mut self.manager, now);
        // One that the application has begun by itself comes first.
        if self.manager.sdo(node).is_ok_and(|sdo| sdo.is_busy()) {
            self.finish(node, &mut [0; 0])?;
            now = self.now();
        }
        begin(&mut self.manager, now).expect("no other transfer with the node is under way");
        match self.finish(node, &mut Lent { node, payload, nothing: [] }) {
            Ok(sdo_client::Event::Done { len, .. }) => Ok(len),
            Ok(sdo_client::Event::Failed(error)) => Err(AccessError::Sdo { node, error }),
            Err(error) => {
                let sdo = self.manager.sdo(node).expect("the node was added above");
                sdo.abort(AbortCode::GENERAL);
                Err(error.into())
            }
        }
    }

    fn finish(&mut self, node: NodeId, payload: &mut dyn Payloads) -> Result<sdo_client::Event, LinkError> {
        loop {
            let until = self.manager.poll_timeout().expect("a transfer has a deadline");
            match self.step(until, payload)? {
                Step::Sdo(ended, event) if ended == node => {
                    // The node may have to be told that the transfer is over. It need not hear it.
                    let _ = self.transmit(payload);
                    return Ok(event);
                }
                _ => {}
            }
        }
    }

    /// Sends what is to be sent, then takes one frame, deadline or change of the bus, not after `until`.
    pub(super) fn step(&mut self, until: Instant, payload: &mut dyn Payloads) -> Result<Step, LinkError> {
        let is_done = self.transmit(payload)?;
        let deadline = self.manager.poll_timeout().filter(|deadline| *deadline <= until);
        let patience = if is_done { deadline.unwrap_or(until) } else { self.link.now() };
        let incoming = self.link.receive(patience)?;
        let now = self.link.now();
        let event = match incoming {
            Some(Incoming::Frame(frame)) => self.manager.handle_frame(now, &frame, payload),
            Some(Incoming::State(_)) => None,
            None if deadline.is_some_and(|deadline| deadline <= now) => self.manager.handle_timeout(now),
            None if is_done => return Ok(Step::Over),
            None => None,
        };
        // A flood of frames must not hold up what is overdue; the frames that have come may be the answer.
        let overdue = self.manager.poll_timeout().is_some_and(|deadline| deadline + GRACE <= now);
        let event = match event {
            None if overdue => self.manager.handle_timeout(now),
            event => event,
        };
        if event.is_none() && now >= until + GRACE {
            return Ok(Step::Over);
        }
        Ok(match event {
            Some(Event::Sdo { node, event }) => Step::Sdo(node, event),
            Some(event) => {
                self.keep(event);
                Step::On
            }
            None => Step::On,
        })
    }

    /// Sends what is to be sent; `false` when that may not be all.
    pub(super) fn transmit(&mut self, payload: &mut dyn Payloads) -> Result<bool, LinkError> {
        // Before a request is sent whose answer must be heard.
        self.audience.follow(&self.manager, &mut self.link)?;
        let now = self.link.now();
        for _ in 0..MOST_SENT {
            let Some(frame) = self.manager.poll_transmit(now, payload) else { return Ok(true) };
            self.link.send(&frame)?;
        }
        Ok(false)
    }

    fn keep(&mut self, event: Event) {
        if self.events.len() == KEPT {
            self.events.pop_front();
            self.missed += 1;
        }
        self.events.push_back(event);
    }
}
