//! What the shell does between two calls of its link.

use std::collections::VecDeque;

use super::Network;
use crate::abort::AbortCode;
use crate::frame::Frame;
use crate::host::boot::{Plan, is_booting};
use crate::host::pump::{Lent, StateMachine, Turn};
use crate::host::{AccessError, Link, LinkError};
use crate::id::NodeId;
use crate::manager::{BeginError, Event, Manager, NetworkEvent, Payloads};
use crate::object::Address;
use crate::service::sdo_client::{self, Payload, SdoError};
use crate::time::Instant;

/// How many events are kept until the application asks for them.
const KEPT: usize = 1024;

/// The payload of the transfer with one node. Others, which the application has begun by itself, have none.
struct OfNode<'a, P> {
    node: NodeId,
    payload: &'a mut P,
    nothing: [u8; 0],
}

impl<P: Payload> Payloads for OfNode<'_, P> {
    fn of_node(&mut self, node: NodeId) -> &mut dyn Payload {
        if node == self.node { self.payload } else { &mut self.nothing }
    }
}

/// A manager and the network that is kept up, on one link. The events of the latter are kept apart: a frame may be news
/// to both.
struct Served<'a> {
    manager: Lent<'a, 127>,
    kept: Option<&'a mut Plan>,
    events: &'a mut VecDeque<NetworkEvent>,
}

impl StateMachine for Served<'_> {
    type Event = Event;

    fn handle_frame(&mut self, now: Instant, frame: &Frame) -> Option<Event> {
        self.events.extend(self.kept.as_mut().and_then(|kept| kept.handle_frame(now, frame)));
        self.manager.handle_frame(now, frame)
    }
    fn handle_timeout(&mut self, now: Instant) -> Option<Event> {
        if let Some(kept) = self.kept.as_mut().filter(|kept| kept.poll_timeout().is_some_and(|due| due <= now)) {
            self.events.extend(kept.handle_timeout(now));
        }
        self.manager.handle_timeout(now)
    }
    fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        self.manager.poll_transmit(now).or_else(|| self.kept.as_mut()?.poll_transmit(now))
    }
    fn poll_timeout(&self) -> Option<Instant> {
        let kept = self.kept.as_ref().and_then(|kept| kept.poll_timeout());
        [kept, self.manager.poll_timeout()].into_iter().flatten().min()
    }
}

impl<L: Link> Network<L> {
    /// Runs one SDO transfer to its end, and returns the number of bytes.
    pub(super) fn transfer(
        &mut self,
        node: NodeId,
        address: Address,
        payload: &mut impl Payload,
        begin: impl FnOnce(&mut Manager<127>, Instant) -> Result<(), BeginError>,
    ) -> Result<u32, AccessError> {
        let until = self.patience.map_or(Instant::MAX, |patience| self.now() + patience);
        let timed_out = AccessError::Sdo { node, error: SdoError::TimedOut { address } };
        // What boots the node uses the same channel.
        while is_booting(self.kept.as_ref(), node) {
            match self.turn(until, &mut [0; 0])? {
                Turn::Over => return Err(timed_out),
                turn => self.keep_turn(turn),
            }
        }
        let mut now = self.now();
        self.audience.include(node, &mut self.manager, now);
        // One that the application has begun by itself comes first.
        if self.manager.sdo(node).is_ok_and(|sdo| sdo.is_busy()) {
            if self.finish(node, until, &mut [0; 0])?.is_none() {
                return Err(timed_out);
            }
            now = self.now();
        }
        begin(&mut self.manager, now).expect("no other transfer with the node is under way");
        let mut payload = OfNode { node, payload, nothing: [] };
        match self.finish(node, until, &mut payload) {
            Ok(Some(sdo_client::Event::Done { len, .. })) => Ok(len),
            Ok(Some(sdo_client::Event::Failed(error))) => Err(AccessError::Sdo { node, error }),
            Ok(None) => {
                self.abort(node, AbortCode::TIMED_OUT);
                // The result does not depend on whether the node hears of it.
                let _ = self.transmit(&mut payload);
                Err(timed_out)
            }
            Err(error) => {
                self.abort(node, AbortCode::GENERAL);
                Err(error.into())
            }
        }
    }

    fn abort(&mut self, node: NodeId, code: AbortCode) {
        if let Ok(sdo) = self.manager.sdo(node) {
            sdo.abort(code);
        }
    }

    /// Waits for the end of a transfer; `None` at `until`.
    fn finish(
        &mut self,
        node: NodeId,
        until: Instant,
        payload: &mut dyn Payloads,
    ) -> Result<Option<sdo_client::Event>, LinkError> {
        loop {
            match self.turn(until, payload)? {
                Turn::Event(Event::Sdo { node: ended, event }) if ended == node => {
                    // The frame that ends a transfer at the node, if there is one. The result does not depend on it.
                    let _ = self.transmit(payload);
                    return Ok(Some(event));
                }
                Turn::Event(event) => self.keep(event),
                Turn::Over => return Ok(None),
                Turn::Bus(_) | Turn::Gap(_) | Turn::Idle => {}
            }
        }
    }

    /// One turn of the pump.
    pub(super) fn turn(&mut self, until: Instant, payload: &mut dyn Payloads) -> Result<Turn<Event>, LinkError> {
        // Before a request is sent whose answer must be heard.
        self.audience.follow(&self.manager, &mut self.link)?;
        let (kept, mut events) = (self.kept.as_mut().map(|kept| &mut *kept.network), VecDeque::new());
        let mut served = Served { manager: Lent(&mut self.manager, payload), kept, events: &mut events };
        let turn = self.pump.turn(&mut self.link, &mut served, until);
        events.into_iter().for_each(|event| self.keep(Event::Network(event)));
        if let Ok(Turn::Gap(frames)) = turn {
            self.lost += u64::from(frames);
        }
        turn
    }

    /// Keeps the event of a turn.
    pub(super) fn keep_turn(&mut self, turn: Turn<Event>) {
        if let Turn::Event(event) = turn {
            self.keep(event);
        }
    }

    /// Sends what is to be sent, or a part of it.
    pub(super) fn transmit(&mut self, payload: &mut dyn Payloads) -> Result<(), LinkError> {
        self.audience.follow(&self.manager, &mut self.link)?;
        self.pump.transmit(&mut self.link, &mut Lent(&mut self.manager, payload)).map(drop)
    }

    /// Keeps an event for [`Network::next_event`]. The end of a transfer that the application has begun by itself is
    /// not one.
    pub(super) fn keep(&mut self, event: Event) {
        if matches!(event, Event::Sdo { .. }) {
            return;
        }
        if self.events.len() == KEPT {
            self.events.pop_front();
            self.missed += 1;
        }
        self.events.push_back(event);
    }
}
