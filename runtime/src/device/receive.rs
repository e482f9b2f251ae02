//! What frames do to a device.

use super::behaviour::Behaviour;
use super::event::Event;
use super::selection::Selection;
use super::services::{Due, RpdoSlot, Services, Timer, TpdoSlot};
use crate::frame::Frame;
use crate::id::{CobId, NodeId};
use crate::object::ObjectDictionary;
use crate::service::nmt;
use crate::service::rpdo::{self, LengthError};
use crate::time::Instant;
use crate::wire::emcy::ErrorCode;
use crate::wire::heartbeat::ErrorControl;
use crate::wire::nmt::NmtState;
use crate::wire::sync::Sync;
use crate::wire::time;

impl<const RPDOS: usize, const TPDOS: usize, const MONITORED: usize, const MAPPED: usize, S: Selection>
    Services<RPDOS, TPDOS, MONITORED, MAPPED, S>
{
    /// A frame that is no request to a server, and what it has made due.
    pub(super) fn dispatch(
        &mut self,
        now: Instant,
        frame: &Frame,
        od: &mut (impl ObjectDictionary + ?Sized),
    ) -> (Option<Event>, Due) {
        let (id, state) = (frame.id(), self.nmt.state());
        if id == CobId::NMT {
            let event = self.nmt.handle_frame(now, frame);
            return (event.map(|event| self.follow_nmt(now, event)), Due::Anything);
        }
        if state == NmtState::Initialising {
            return (None, Due::Nothing);
        }
        if let Some(node) = ErrorControl::node(id) {
            return (self.handle_error_control(now, node, frame), Due::Anything);
        }
        if state.allows_messages() { self.handle_message(now, frame, od) } else { (None, Due::Nothing) }
    }

    fn handle_message(
        &mut self,
        now: Instant,
        frame: &Frame,
        od: &mut (impl ObjectDictionary + ?Sized),
    ) -> (Option<Event>, Due) {
        let id = frame.id();
        if self.sync_consumer.id() == Some(id) {
            let had_window = self.sync_consumer.poll_timeout().is_some();
            let Some(event) = self.sync_consumer.handle_frame(now, frame) else { return (None, Due::Nothing) };
            if event.length_error {
                self.raise_communication_error(ErrorCode::SYNC_LENGTH, od);
            }
            let (sync, due) = self.handle_sync(event.sync, od);
            let is_quiet = !event.length_error && !had_window && self.sync_consumer.poll_timeout().is_none();
            return (Some(sync), if is_quiet { due } else { Due::Anything });
        }
        if self.time_id() == Some(id) && !frame.is_remote() {
            return (time::parse(frame.data()).map(Event::Time), Due::Nothing);
        }
        if !self.is_operational() {
            return (None, Due::Nothing);
        }
        if frame.is_remote() {
            self.tpdos.iter_mut().for_each(|slot| slot.pdo.handle_frame(now, frame));
            return (None, Due::Anything);
        }
        match self.rpdos.iter().position(|slot| slot.pdo.listens_to(id)) {
            Some(at) => self.handle_rpdo(at, now, frame, od),
            None => (None, Due::Nothing),
        }
    }

    /// Everything that a change of the NMT state brings with it.
    pub(super) fn follow_nmt(&mut self, now: Instant, event: nmt::Event) -> Event {
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
            self.sync_producer.suspend();
            self.timers.set(Timer::OwnSync, None);
            if let Some(time) = &mut self.time {
                time.pending = None;
            }
        }
        match event {
            nmt::Event::StateChanged(state) => Event::StateChanged(state),
            nmt::Event::Reset(reset) => Event::Reset(reset),
        }
    }

    fn handle_error_control(&mut self, now: Instant, node: NodeId, frame: &Frame) -> Option<Event> {
        if node == self.nmt.node() {
            // A device with a heartbeat is not guarded (CiA 301, 7.2.8.3.2.2).
            let guarded = self.heartbeat.period().is_zero();
            let guarding = self.guarding.as_mut().filter(|_| guarded)?;
            return guarding.handle_frame(now, frame).map(Event::LifeGuarding);
        }
        let consumer = self.consumers.iter_mut().flatten().find(|consumer| consumer.node() == node)?;
        let event = consumer.handle_frame(now, frame)?;
        Some(Event::Heartbeat { node, event })
    }

    pub(super) fn handle_sync(&mut self, sync: Sync, od: &mut (impl ObjectDictionary + ?Sized)) -> (Event, Due) {
        let mut due = Due::Nothing;
        if self.is_operational() {
            let Behaviour { rpdos_count_syncs: counts, tpdo_masks: masks, .. } = *self.behaviour();
            let mut touches = false;
            for slot in self.rpdos.iter_mut() {
                match counts {
                    true => slot.pdo.handle_nth_sync(od),
                    false => slot.pdo.handle_sync(od),
                }
                touches |= slot.touched != 0 && slot.pdo.applied().is_some();
            }
            let mut sampled = 0;
            for slot in self.tpdos.iter_mut() {
                sampled += u16::from(slot.pdo.handle_sync(sync.counter, od));
            }
            due = if sampled == 0 { Due::Nothing } else { Due::Sampled(sampled) };
            if touches {
                let applied = self.rpdos.iter().filter(|slot| slot.pdo.applied().is_some());
                applied.for_each(|slot| compare(&mut self.tpdos, slot, masks, od));
                due = Due::Anything;
            }
        }
        (Event::Sync { counter: sync.counter }, due)
    }

    fn handle_rpdo(
        &mut self,
        at: usize,
        now: Instant,
        frame: &Frame,
        od: &mut (impl ObjectDictionary + ?Sized),
    ) -> (Option<Event>, Due) {
        let masks = self.behaviour().tpdo_masks;
        let Some(slot) = self.rpdos.get_mut(at) else { return (None, Due::Nothing) };
        let number = slot.number;
        let before = slot.pdo.length_error();
        let event = slot.pdo.take(now, frame, od);
        let after = slot.pdo.length_error();
        let is_quiet = slot.touched == 0 && after == before && slot.pdo.poll_timeout().is_none();
        if slot.touched != 0 && matches!(event, rpdo::Event::Received | rpdo::Event::Refused { .. }) {
            compare(&mut self.tpdos, slot, masks, od);
        }
        if let Some(error) = after.filter(|_| after != before) {
            let code = match error {
                LengthError::TooShort => ErrorCode::PDO_LENGTH,
                LengthError::TooLong => ErrorCode::PDO_TOO_LONG,
            };
            self.raise_communication_error(code, od);
        }
        (rpdo_event(number, event), if is_quiet { Due::Nothing } else { Due::Anything })
    }
}

/// What an RPDO has written is a change for the TPDOs that map it, if it is another value.
fn compare<const N: usize>(
    tpdos: &mut [TpdoSlot<N>],
    written: &RpdoSlot<N>,
    masks: Option<u16>,
    od: &mut (impl ObjectDictionary + ?Sized),
) {
    for (at, slot) in tpdos.iter_mut().enumerate() {
        if written.touched >> (at % 32) & 1 != 0 && slot.pdo.mapping().overlaps(written.pdo.mapping()) {
            slot.compare(masks, od);
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
