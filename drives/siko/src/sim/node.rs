//! The simulated drive as a node of a bus.

use lexican_runtime::device::Event;
use lexican_runtime::host::Node;
use lexican_runtime::service::rpdo;
use lexican_runtime::wire::pdo::TransmissionType;
use lexican_runtime::{AbortCode, CobId, Frame, Instant};

use super::address;
use super::drive::SimulatedDrive;
use super::inputs::BusState;
use crate::frames::{emergency_parameter, is_switched_off, with_size_of_object};

impl Node for SimulatedDrive {
    fn handle_frame(&mut self, now: Instant, frame: &Frame) {
        if self.is_connected() && self.inputs().bus == BusState::Active {
            self.by_sdo = frame.id() == CobId::of_node(SDO_REQUEST, self.node());
            let frame = with_size_of_object(self.setup.model, &*self.storage, frame);
            let event = self.with_device(now, |device, od| device.handle_frame(now, &frame, od));
            self.by_sdo = false;
            self.take(now, event);
        }
        self.run_script(now);
    }

    fn handle_timeout(&mut self, now: Instant) {
        let running = self.is_running();
        let event = running.then(|| self.with_device(now, |device, od| device.handle_timeout(now, od))).flatten();
        self.take(now, event);
        self.run_script(now);
    }

    fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        loop {
            let was = self.device.nmt_state();
            let bus = self.inputs().bus;
            let speaks = self.is_connected() && bus != BusState::Off;
            let frame = speaks.then(|| self.with_device(now, |device, od| device.poll_transmit(now, od)))??;
            if was != self.device.nmt_state() {
                self.enter(now, self.device.nmt_state());
            }
            // Error passive: "communication is no longer enabled", but an emergency message still says so.
            let is_emergency = frame.id() == CobId::from_parameter(emergency_parameter(&*self.storage));
            if is_switched_off(self.setup.model, &*self.storage, &frame) {
                continue;
            }
            if bus == BusState::Active || is_emergency {
                return Some(self.with_code_of_table_19(frame));
            }
        }
    }

    fn poll_timeout(&self) -> Option<Instant> {
        let running = self.is_running();
        let by_itself = [self.device.poll_timeout(), self.controller.next_event(), self.next_change()];
        let always = [self.next_save(), self.next_step()];
        by_itself.into_iter().filter(|_| running).chain(always).flatten().min()
    }

    fn concerns(&self) -> Vec<CobId> {
        self.device.cob_ids().collect()
    }

    fn generation(&self) -> u32 {
        self.device.generation()
    }

    fn changes_only_when_called(&self) -> bool {
        true
    }

    fn set_power(&mut self, now: Instant, on: bool) {
        if on { self.switch_on(now) } else { self.switch_off(now) }
    }
}

impl SimulatedDrive {
    /// Whether it can take part in communication, judged by supply and bit rate.
    fn is_connected(&self) -> bool {
        self.is_running() && self.inputs().bus_bit_rate.is_none_or(|rate| rate == self.bit_rate)
    }

    fn take(&mut self, now: Instant, event: Option<Event>) {
        match event {
            Some(Event::StateChanged(state)) => self.enter(now, state),
            Some(Event::Reset(_)) => self.initialise(now, self.device.node()),
            Some(Event::RpdoRefused { .. }) => self.miss_target(),
            Some(Event::Sync { .. })
                if self.device.applied().any(|(_, event)| matches!(event, rpdo::Event::Refused { .. })) =>
            {
                self.miss_target();
            }
            _ => {}
        }
        self.settle(now);
    }

    /// The drive has eight abort codes (table 19). An abort code that it lacks is replaced by the nearest one; the
    /// manual does not say which one a real drive sends.
    fn with_code_of_table_19(&self, frame: Frame) -> Frame {
        const ABORT: u8 = 0x80;
        let &[ABORT, index_low, index_high, sub, a, b, c, d] = frame.data() else { return frame };
        if frame.id() != CobId::of_node(SDO_ANSWER, self.node()) {
            return frame;
        }
        let [a, b, c, d] = code_of_table_19(AbortCode(u32::from_le_bytes([a, b, c, d]))).0.to_le_bytes();
        Frame::from_array(frame.id(), [ABORT, index_low, index_high, sub, a, b, c, d])
    }

    /// When a TPDO that is sent on change has new contents.
    fn next_change(&self) -> Option<Instant> {
        let mut next = None;
        for tpdo in (1..=4).filter_map(|number| self.device.tpdo(number)) {
            if !tpdo.is_active() || tpdo.parameters().transmission != TransmissionType::EventManufacturer {
                continue;
            }
            let readings = [address::POSITION, address::VELOCITY];
            let change = if readings.into_iter().any(|address| tpdo.mapping().maps(address)) {
                self.controller.next_reading(self.settled)
            } else {
                self.controller.next_change(self.settled)
            };
            next = [next, change].into_iter().flatten().min();
        }
        next
    }
}

/// COB-IDs of the SDO server, without the node-ID; these drives cannot change them.
const SDO_REQUEST: u16 = 0x600;
const SDO_ANSWER: u16 = 0x580;

fn code_of_table_19(code: AbortCode) -> AbortCode {
    match code {
        AbortCode::NO_SUCH_SUB_INDEX
        | AbortCode::READ_ONLY
        | AbortCode::WRITE_ONLY
        | AbortCode::INVALID_VALUE
        | AbortCode::MAXIMUM_BELOW_MINIMUM
        | AbortCode::NO_SUCH_OBJECT
        | AbortCode::DEVICE_STATE => code,
        AbortCode::VALUE_TOO_HIGH | AbortCode::VALUE_TOO_LOW | AbortCode::PARAMETER_INCOMPATIBLE => {
            AbortCode::INVALID_VALUE
        }
        _ => AbortCode::UNSUPPORTED_ACCESS,
    }
}
