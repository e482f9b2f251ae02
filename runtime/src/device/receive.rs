//! What frames do to a device.

use super::checked::Checked;
use super::{Device, Event, PdoSet};
use crate::frame::Frame;
use crate::id::{CobId, NodeId};
use crate::object::ObjectDictionary;
use crate::service::nmt;
use crate::service::rpdo::{self, LengthError};
use crate::service::sdo_server::{self, SdoServer};
use crate::time::Instant;
use crate::wire::emcy::ErrorCode;
use crate::wire::heartbeat::ErrorControl;
use crate::wire::nmt::NmtState;
use crate::wire::sync::Sync;
use crate::wire::time;

impl<const RPDOS: usize, const TPDOS: usize, const SERVERS: usize, const MONITORED: usize>
    Device<RPDOS, TPDOS, SERVERS, MONITORED>
{
    pub(super) fn dispatch(&mut self, now: Instant, frame: &Frame, od: &mut dyn ObjectDictionary) -> Option<Event> {
        let (id, state) = (frame.id(), self.nmt.state());
        if id == CobId::NMT {
            let event = self.nmt.handle_frame(now, frame)?;
            return self.follow_nmt(now, event);
        }
        if state == NmtState::Initialising {
            return None;
        }
        if let Some(node) = ErrorControl::node(id) {
            return self.handle_error_control(now, node, frame);
        }
        if !state.allows_messages() {
            return None;
        }
        if id == self.sync_consumer.id() {
            let event = self.sync_consumer.handle_frame(now, frame)?;
            if event.length_error {
                self.raise_communication_error(ErrorCode::SYNC_LENGTH, od);
            }
            return Some(self.handle_sync(event.sync, od));
        }
        if self.time_id == Some(id) && !frame.is_remote() {
            return time::parse(frame.data()).map(Event::Time);
        }
        if state == NmtState::Operational {
            if frame.is_remote() {
                self.tpdos.iter_mut().for_each(|slot| slot.pdo.handle_frame(now, frame));
                return None;
            }
            if let Some(at) = self.rpdos.iter().position(|slot| slot.pdo.listens_to(id)) {
                return self.handle_rpdo(at, now, frame, od);
            }
        }
        self.handle_sdo(now, frame, od)
    }

    /// Everything that a change of the NMT state brings with it.
    pub(super) fn follow_nmt(&mut self, now: Instant, event: nmt::Event) -> Option<Event> {
        let state = self.nmt.state();
        if state == NmtState::Operational {
            self.tpdos.iter_mut().for_each(|slot| slot.pdo.start(now));
        } else {
            self.rpdos.iter_mut().for_each(|slot| slot.pdo.suspend());
            self.tpdos.iter_mut().for_each(|slot| slot.pdo.suspend());
        }
        if state.allows_messages() {
            self.sync_producer.resume(now);
        } else {
            self.servers.iter_mut().flatten().for_each(SdoServer::reset);
            self.sync_producer.suspend();
            self.own_sync = None;
        }
        match event {
            nmt::Event::StateChanged(state) => Some(Event::StateChanged(state)),
            nmt::Event::Reset(reset) => Some(Event::Reset(reset)),
        }
    }

    fn handle_error_control(&mut self, now: Instant, node: NodeId, frame: &Frame) -> Option<Event> {
        if node == self.node {
            // A device with a heartbeat is not guarded (CiA 301, 7.2.8.3.2.2).
            let guarded = self.heartbeat.period().is_zero();
            return if guarded { self.guarding.handle_frame(now, frame).map(Event::LifeGuarding) } else { None };
        }
        let consumer = self.consumers.iter_mut().flatten().find(|consumer| consumer.node() == node)?;
        let event = consumer.handle_frame(now, frame)?;
        Some(Event::Heartbeat { node, event })
    }

    pub(super) fn handle_sync(&mut self, sync: Sync, od: &mut dyn ObjectDictionary) -> Event {
        let (mut applied, mut refused) = (PdoSet::EMPTY, PdoSet::EMPTY);
        if self.nmt.state() == NmtState::Operational {
            for slot in &mut self.rpdos {
                match slot.pdo.handle_sync(od) {
                    Some(rpdo::Event::Refused { .. }) => refused.insert(slot.number),
                    Some(_) => applied.insert(slot.number),
                    None => {}
                }
            }
            self.tpdos.iter_mut().for_each(|slot| slot.pdo.handle_sync(sync.counter, od));
        }
        Event::Sync { counter: sync.counter, applied, refused }
    }

    fn handle_rpdo(&mut self, at: usize, now: Instant, frame: &Frame, od: &mut dyn ObjectDictionary) -> Option<Event> {
        let slot = self.rpdos.get_mut(at)?;
        let number = slot.number;
        let before = slot.pdo.length_error();
        let event = slot.pdo.handle_frame(now, frame, od)?;
        let after = slot.pdo.length_error();
        if after != before {
            match after {
                Some(LengthError::TooShort) => self.raise_communication_error(ErrorCode::PDO_LENGTH, od),
                Some(LengthError::TooLong) => self.raise_communication_error(ErrorCode::PDO_TOO_LONG, od),
                None => {}
            }
        }
        rpdo_event(number, event)
    }

    fn handle_sdo(&mut self, now: Instant, frame: &Frame, od: &mut dyn ObjectDictionary) -> Option<Event> {
        let id = frame.id();
        let server = self.servers.iter_mut().flatten().find(|server| server.request_id() == id)?;
        let mut checked = Checked {
            od,
            state: self.nmt.state(),
            behaviour: &self.behaviour,
            rpdos: &self.rpdos,
            tpdos: &self.tpdos,
            monitored: MONITORED,
        };
        let event = server.handle_frame(now, frame, &mut checked)?;
        self.follow_sdo(now, event, od)
    }

    pub(super) fn follow_sdo(
        &mut self,
        now: Instant,
        event: sdo_server::Event,
        od: &mut dyn ObjectDictionary,
    ) -> Option<Event> {
        match event {
            sdo_server::Event::Read(_) => None,
            sdo_server::Event::Written(address) => {
                self.reconfigure(now, address, od);
                self.changed(address);
                Some(Event::Written(address))
            }
            sdo_server::Event::Aborted { address, code, .. } => Some(Event::SdoAborted { address, reason: code }),
        }
    }
}

fn rpdo_event(number: u16, event: rpdo::Event) -> Option<Event> {
    match event {
        rpdo::Event::Received => Some(Event::RpdoReceived { number }),
        rpdo::Event::Refused { address, reason } => Some(Event::RpdoRefused { number, address, reason }),
        rpdo::Event::TooShort { expected, got } => {
            Some(Event::RpdoTooShort { number, expected: expected as u8, got: got as u8 })
        }
        rpdo::Event::TimedOut => Some(Event::RpdoTimedOut { number }),
        rpdo::Event::Waiting => None,
    }
}
