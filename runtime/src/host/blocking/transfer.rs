//! Transfers and turns of the blocking shell.

use std::collections::VecDeque;

use super::Network;
use crate::abort::AbortCode;
use crate::frame::Frame;
use crate::host::boot::{Plan, is_booting};
use crate::host::pump::{Lent, StateMachine, Turn};
use crate::host::{AccessError, Link, LinkError, trace};
use crate::id::NodeId;
use crate::manager::{BeginError, Event, Manager, NetworkEvent, Payloads};
use crate::object::Address;
use crate::service::sdo_client::{self, Payload, SdoError};
use crate::time::{Instant, earliest};

/// How many events are stored until the application asks for them.
const STORED: usize = 1024;

/// The payload of the transfer with one node. Transfers that the application began through the manager have none.
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

/// A manager and the kept network, on one link. Events of the network are collected, since a frame may cause one of
/// each.
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
        earliest([kept, self.manager.poll_timeout()])
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
        let mut now = self.now();
        let until = self.patience.map_or(Instant::MAX, |patience| now + patience);
        let timed_out = AccessError::Sdo { node, error: SdoError::TimedOut { address } };
        // Booting the node uses the same SDO channel.
        while is_booting(self.kept.as_ref(), node) {
            match self.turn(now, until, &mut [0; 0])? {
                Turn::Over => return Err(timed_out),
                turn => self.store_turn(turn),
            }
            now = self.pump.now();
        }
        self.filter.include(node, &mut self.manager, now);
        // A transfer that the application has begun through the manager comes first.
        if self.manager.sdo(node).is_ok_and(|sdo| sdo.is_busy()) {
            if self.finish(node, now, until, &mut [0; 0])?.is_none() {
                return Err(timed_out);
            }
            now = self.pump.now();
        }
        begin(&mut self.manager, now).expect("no other transfer with the node is under way");
        let mut payload = OfNode { node, payload, nothing: [] };
        match self.finish(node, now, until, &mut payload) {
            Ok(Some(sdo_client::Event::Done { len, .. })) => Ok(len),
            Ok(Some(sdo_client::Event::Failed(error))) => Err(AccessError::Sdo { node, error }),
            Ok(None) => {
                self.abort(node, AbortCode::TIMED_OUT);
                // The result does not depend on whether the abort can be sent.
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

    /// Waits for the end of a transfer, from `now` on; `None` at `until`.
    fn finish(
        &mut self,
        node: NodeId,
        mut now: Instant,
        until: Instant,
        payload: &mut dyn Payloads,
    ) -> Result<Option<sdo_client::Event>, LinkError> {
        loop {
            match self.turn(now, until, payload)? {
                Turn::Event(Event::Sdo { node: ended, event }) if ended == node => {
                    // Ends the transfer at the node, too; the result is known already, so an error is ignored.
                    let _ = self.transmit_at(self.pump.now(), payload);
                    return Ok(Some(event));
                }
                Turn::Event(event) => self.store(event),
                Turn::Over => return Ok(None),
                Turn::Bus(_) | Turn::Gap(_) | Turn::Idle => {}
            }
            now = self.pump.now();
        }
    }

    /// One turn of the pump, beginning at `now`.
    pub(super) fn turn(
        &mut self,
        now: Instant,
        until: Instant,
        payload: &mut dyn Payloads,
    ) -> Result<Turn<Event>, LinkError> {
        // Before a request is sent, so that its answer passes the filter.
        self.filter.apply(&self.manager, &mut self.link)?;
        let (kept, mut events) = (self.kept.as_mut().map(|kept| &mut *kept.network), VecDeque::new());
        let mut served = Served { manager: Lent(&mut self.manager, payload), kept, events: &mut events };
        let turn = self.pump.turn_at(now, &mut self.link, &mut served, until);
        for event in events.into_iter().map(Event::Network) {
            trace::event(self.pump.now(), &event);
            self.store(event);
        }
        match &turn {
            Ok(Turn::Event(event)) => trace::event(self.pump.now(), event),
            Ok(Turn::Gap(frames)) => self.lost += u64::from(*frames),
            _ => {}
        }
        turn
    }

    pub(super) fn store_turn(&mut self, turn: Turn<Event>) {
        if let Turn::Event(event) = turn {
            self.store(event);
        }
    }

    /// Sends up to four frames.
    pub(super) fn transmit(&mut self, payload: &mut dyn Payloads) -> Result<(), LinkError> {
        self.transmit_at(self.now(), payload)
    }

    fn transmit_at(&mut self, now: Instant, payload: &mut dyn Payloads) -> Result<(), LinkError> {
        self.filter.apply(&self.manager, &mut self.link)?;
        self.pump.transmit_at(now, &mut self.link, &mut Lent(&mut self.manager, payload)).map(drop)
    }

    /// Stores an event for [`Network::next_event`], except the end of a transfer that the application began through the
    /// manager.
    /// the manager.
    pub(super) fn store(&mut self, event: Event) {
        if matches!(event, Event::Sdo { .. }) {
            return;
        }
        if self.events.len() == STORED {
            self.events.pop_front();
            self.missed += 1;
        }
        self.events.push_back(event);
    }
}
