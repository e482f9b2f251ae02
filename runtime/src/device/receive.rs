//! What frames do to a device.

use super::checked::Checked;
use super::transmit::is_guarded;
use super::{Device, Event, TpdoSlot};
use crate::frame::Frame;
use crate::id::{CobId, NodeId};
use crate::object::{Address, ObjectDictionary};
use crate::service::mapping::Mapping;
use crate::service::nmt;
use crate::service::rpdo::{self, LengthError};
use crate::service::sdo_server::{self, SdoServer};
use crate::service::tpdo::Tpdo;
use crate::time::Instant;
use crate::wire::emcy::ErrorCode;
use crate::wire::heartbeat::ErrorControl;
use crate::wire::nmt::NmtState;
use crate::wire::sync::Sync;
use crate::wire::time;

impl<const RPDOS: usize, const TPDOS: usize, const SERVERS: usize, const MONITORED: usize>
    Device<RPDOS, TPDOS, SERVERS, MONITORED>
{
    /// A frame that is no request to a server.
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
        if state.allows_messages() { self.handle_message(now, frame, od) } else { None }
    }

    fn handle_message(&mut self, now: Instant, frame: &Frame, od: &mut dyn ObjectDictionary) -> Option<Event> {
        let id = frame.id();
        if self.sync_consumer.id() == Some(id) {
            let event = self.sync_consumer.handle_frame(now, frame)?;
            if event.length_error {
                self.raise_communication_error(ErrorCode::SYNC_LENGTH, od);
            }
            return Some(self.handle_sync(event.sync, od));
        }
        if self.time_id == Some(id) && !frame.is_remote() {
            return time::parse(frame.data()).map(Event::Time);
        }
        if self.nmt.state() != NmtState::Operational {
            return None;
        }
        if frame.is_remote() {
            self.tpdos.iter_mut().for_each(|slot| slot.pdo.handle_frame(now, frame));
            return None;
        }
        let at = self.rpdos.iter().position(|slot| slot.pdo.listens_to(id))?;
        self.handle_rpdo(at, now, frame, od)
    }

    /// Everything that a change of the NMT state brings with it.
    pub(super) fn follow_nmt(&mut self, now: Instant, event: nmt::Event) -> Option<Event> {
        let state = self.nmt.state();
        self.quiet = None;
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
            self.time = None;
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
        if self.nmt.state() == NmtState::Operational {
            self.rpdos.iter_mut().for_each(|slot| slot.pdo.handle_sync(od));
            self.tpdos.iter_mut().for_each(|slot| slot.pdo.handle_sync(sync.counter, od));
            for slot in self.rpdos.iter().filter(|slot| slot.pdo.applied().is_some()) {
                compare(&mut self.tpdos, slot.pdo.mapping(), od);
            }
        }
        Event::Sync { counter: sync.counter }
    }

    fn handle_rpdo(&mut self, at: usize, now: Instant, frame: &Frame, od: &mut dyn ObjectDictionary) -> Option<Event> {
        let slot = self.rpdos.get_mut(at)?;
        let number = slot.number;
        let before = slot.pdo.length_error();
        let event = slot.pdo.handle_frame(now, frame, od)?;
        let after = slot.pdo.length_error();
        if matches!(event, rpdo::Event::Received | rpdo::Event::Refused { .. }) {
            compare(&mut self.tpdos, slot.pdo.mapping(), od);
        }
        if after != before {
            match after {
                Some(LengthError::TooShort) => self.raise_communication_error(ErrorCode::PDO_LENGTH, od),
                Some(LengthError::TooLong) => self.raise_communication_error(ErrorCode::PDO_TOO_LONG, od),
                None => {}
            }
        }
        rpdo_event(number, event)
    }

    /// Whether the identifier is one of messages that go before SDO, should a data sheet give both the same one.
    #[inline]
    pub(super) fn is_sync_or_time(&self, id: CobId) -> bool {
        let id = Some(id);
        id == self.sync_consumer.id() || id == self.time_id
    }

    /// The place of the server that has requests of this identifier.
    #[inline]
    pub(super) fn server_of(&self, id: CobId) -> Option<usize> {
        if !self.nmt.state().allows_messages() {
            return None;
        }
        self.servers.iter().position(|server| server.as_ref().is_some_and(|server| server.request_id() == id))
    }

    /// A request to the server in place `at`.
    // Always inlined: so the event is looked at where it is written, and not moved about before.
    #[inline(always)]
    pub(super) fn handle_request(
        &mut self,
        at: usize,
        now: Instant,
        frame: &Frame,
        od: &mut dyn ObjectDictionary,
    ) -> Option<sdo_server::Event> {
        let server = self.servers.get_mut(at)?.as_mut()?;
        if is_guarded(server) || may_name_communication(frame) || !self.behaviour.writable_in.is_empty() {
            return self.handle_guarded(at, now, frame, od);
        }
        server.handle_frame(now, frame, od)
    }

    #[inline(never)]
    fn handle_guarded(
        &mut self,
        at: usize,
        now: Instant,
        frame: &Frame,
        od: &mut dyn ObjectDictionary,
    ) -> Option<sdo_server::Event> {
        let (server, mut checked) = self.guarded(at, od)?;
        server.handle_frame(now, frame, &mut checked)
    }

    /// The server in place `at`, and the dictionary as its client may write it.
    pub(super) fn guarded<'a>(
        &'a mut self,
        at: usize,
        od: &'a mut dyn ObjectDictionary,
    ) -> Option<(&'a mut SdoServer, Checked<'a>)> {
        let server = self.servers.get_mut(at)?.as_mut()?;
        let checked = Self::checked(od, &self.nmt, &self.behaviour, &self.rpdos, &self.tpdos);
        Some((server, checked))
    }

    /// What a server did to an entry.
    #[inline(always)]
    pub(super) fn follow_sdo(
        &mut self,
        now: Instant,
        event: Option<sdo_server::Event>,
        od: &mut dyn ObjectDictionary,
    ) -> Option<Event> {
        match event {
            None | Some(sdo_server::Event::Read(_)) => None,
            Some(sdo_server::Event::Written(address)) => Some(self.follow_write(now, address, od)),
            Some(sdo_server::Event::Aborted { address, code, .. }) => Some(Event::SdoAborted { address, reason: code }),
        }
    }

    fn follow_write(&mut self, now: Instant, address: Address, od: &mut dyn ObjectDictionary) -> Event {
        self.reconfigure(now, address, od);
        self.changed(address);
        self.end_communication_error(od);
        Event::Written(address)
    }
}

/// Whether a request may name an entry that [`Checked`] looks at: 1000h to 1FFFh. Where others name an index,
/// a segment has data.
fn may_name_communication(frame: &Frame) -> bool {
    frame.data().get(2).is_some_and(|high| high >> 4 == 1)
}

/// What an RPDO has written is a change for the TPDOs that map it, if it is another value.
fn compare(tpdos: &mut [TpdoSlot], written: &Mapping, od: &mut dyn ObjectDictionary) {
    let maps_any = |pdo: &Tpdo| pdo.mapping().iter().any(|mapped| written.maps(mapped.address));
    tpdos.iter_mut().filter(|slot| maps_any(&slot.pdo)).for_each(|slot| slot.pdo.compare(od));
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
