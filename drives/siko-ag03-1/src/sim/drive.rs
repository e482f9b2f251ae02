//! The simulated drive as a node of a bus.

use lexican_runtime::device::{Device, Event};
use lexican_runtime::host::Node;
use lexican_runtime::object::ObjectDictionary;
use lexican_runtime::wire::emcy::{ErrorCode, ErrorRegister};
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::wire::pdo::TransmissionType;
use lexican_runtime::{AbortCode, CobId, Frame, Instant, NodeId};

use super::controller::{Controller, Network};
use super::inputs::{BusState, Inputs};
use super::objects::{self, Effect, Objects};
use super::parameters::Parameters;
use super::setup::{NonVolatile, Setup};
use super::trajectory;
use crate::od;
use crate::state::State;

/// The green status LED (7.14).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StatusLed {
    /// A supply is missing.
    Off,
    /// The supplies are there.
    On,
    /// A fault, by the number of blinks (table 2).
    Blinks(u8),
}

/// A simulated AG03/1: a [`Node`], to be attached to a bus.
#[derive(Clone, Debug)]
pub struct SimulatedDrive {
    setup: Setup,
    device: Device<4, 4, 1, 0>,
    storage: od::Storage,
    controller: Controller,
    effects: Vec<Effect>,
    /// Until when everything has been looked at: what changes by itself after it is still to be told.
    settled: Instant,
}

impl SimulatedDrive {
    /// A new drive, powered on at the origin of time.
    #[must_use]
    pub fn new(node: NodeId) -> Self {
        SimulatedDrive::power_on(Instant::ZERO, Setup::new(node))
    }

    /// A drive that is powered on at `now`.
    #[must_use]
    pub fn power_on(now: Instant, setup: Setup) -> Self {
        let storage = setup.storage();
        let parameters = objects::parameters(&storage);
        let position = setup.non_volatile.position;
        let mut drive = SimulatedDrive {
            device: Device::new(setup.node, setup.behaviour),
            controller: Controller::new(now, parameters, setup.inputs, position),
            effects: Vec::new(),
            storage,
            setup,
            settled: now,
        };
        drive.with_device(now, |device, od| device.restart(now, od));
        drive.settle(now);
        drive
    }

    /// What would survive if power went off now.
    #[must_use]
    pub fn non_volatile(&self, now: Instant) -> NonVolatile {
        let mut storage = self.storage.clone();
        let eeprom = od::PERSISTENT.iter().map(|&address| (address, objects::raw(&mut storage, address))).collect();
        NonVolatile { eeprom, position: self.position(now) }
    }

    /// Power off and on again.
    pub fn power_cycle(&mut self, now: Instant) {
        let setup = Setup { non_volatile: self.non_volatile(now), inputs: *self.inputs(), ..self.setup.clone() };
        *self = SimulatedDrive::power_on(now, setup);
    }

    /// The node-ID.
    #[must_use]
    pub fn node(&self) -> NodeId {
        self.setup.node
    }

    /// The NMT state.
    #[must_use]
    pub fn nmt_state(&self) -> NmtState {
        self.device.nmt_state()
    }

    /// The state of the state machine.
    #[must_use]
    pub fn state(&self) -> State {
        self.controller.state()
    }

    /// The controller: status words, faults, motion.
    #[must_use]
    pub fn controller(&self) -> &Controller {
        &self.controller
    }

    /// The dictionary, as it is stored; live values are looked up only when the bus asks for them.
    #[must_use]
    pub fn storage(&self) -> &od::Storage {
        &self.storage
    }

    /// The parameters, as numbers.
    #[must_use]
    pub fn parameters(&self) -> Parameters {
        objects::parameters(&self.storage)
    }

    /// The position as 6064h shows it. `now` is not before the last event; so it is with the others.
    #[must_use]
    pub fn position(&self, now: Instant) -> i32 {
        self.controller.position(now)
    }

    /// The velocity as 606Ch shows it, in rev/min.
    #[must_use]
    pub fn velocity(&self, now: Instant) -> i32 {
        self.controller.velocity(now)
    }

    /// The status word 6041h.
    #[must_use]
    pub fn status_word(&self, now: Instant) -> u16 {
        self.controller.status_word(now)
    }

    /// Position and velocity of the shaft as they are, without rounding: increments and increments/s.
    #[must_use]
    pub fn shaft(&self, now: Instant) -> trajectory::State {
        self.controller.motion().state(now)
    }

    /// The world around the drive.
    #[must_use]
    pub fn inputs(&self) -> &Inputs {
        &self.controller.inputs
    }

    /// Lets the world change.
    pub fn set_inputs(&mut self, now: Instant, change: impl FnOnce(&mut Inputs)) {
        let mut inputs = *self.inputs();
        let bus_before = inputs.bus;
        change(&mut inputs);
        self.controller.set_inputs(now, inputs);
        // Table 20: 8120h is not a fault, and over when the bus is well again.
        let recovered = bus_before == BusState::Passive && inputs.bus == BusState::Active;
        if recovered && self.controller.faults().is_empty() {
            self.with_device(now, |device, od| device.clear(ErrorRegister(0xFF), od));
        }
        self.settle(now);
    }

    /// What the status LED shows.
    #[must_use]
    pub fn status_led(&self) -> StatusLed {
        let inputs = self.inputs();
        match self.controller.faults().first() {
            Some(fault) => StatusLed::Blinks(fault.blinks),
            None if inputs.supply_is_present() => StatusLed::On,
            None => StatusLed::Off,
        }
    }

    fn with_device<T>(
        &mut self,
        now: Instant,
        call: impl FnOnce(&mut Device<4, 4, 1, 0>, &mut dyn ObjectDictionary) -> T,
    ) -> T {
        let mut od = Objects {
            now,
            network: self.device.nmt_state(),
            storage: &mut self.storage,
            controller: &self.controller,
            effects: &mut self.effects,
        };
        call(&mut self.device, &mut od)
    }

    fn follow(&mut self, now: Instant, event: Option<Event>) {
        match event {
            Some(Event::StateChanged(state)) => self.controller.set_network(now, network(state)),
            Some(Event::Reset(_)) => self.restart(now),
            _ => {}
        }
        self.settle(now);
    }

    /// Both resets lead through INITIALISATION (7.2.2.2), as power-on does.
    fn restart(&mut self, now: Instant) {
        let position = self.position(now);
        let inputs = *self.inputs();
        let setup = Setup { non_volatile: self.non_volatile(now), inputs, ..self.setup.clone() };
        self.storage = setup.storage();
        self.controller = Controller::new(now, objects::parameters(&self.storage), inputs, position);
        self.with_device(now, |device, od| device.restart(now, od));
    }

    /// Everything that follows from what just happened.
    fn settle(&mut self, now: Instant) {
        let parameters = objects::parameters(&self.storage);
        if parameters != self.controller.parameters {
            self.controller.set_parameters(now, parameters);
        }
        for effect in std::mem::take(&mut self.effects) {
            match effect {
                Effect::Control(word) => self.controller.control(now, word),
                Effect::Calibrate => self.controller.calibrate(now, parameters.calibration_value),
            }
        }
        self.controller.advance(now);
        while let Some(emergency) = self.controller.next_emergency() {
            let (code, register) = (ErrorCode(emergency.code), ErrorRegister(emergency.register));
            self.with_device(now, |device, od| match code {
                ErrorCode::NO_ERROR => device.clear(ErrorRegister(0xFF), od),
                _ if emergency.stored => device.emergency(code, register, [0; 5], od),
                _ => device.emergency_unrecorded(code, register, [0; 5], od),
            });
        }
        self.with_device(now, |device, od| device.compare(od));
        self.settled = now;
    }

    /// The drive has eight abort codes (table 19). For those of CiA 301 that it does not have, the nearest is sent:
    /// which ones a real drive sends then, the manual does not say.
    fn with_code_of_table_19(&self, frame: Frame) -> Frame {
        const ABORT: u8 = 0x80;
        let &[ABORT, index_low, index_high, sub, a, b, c, d] = frame.data() else { return frame };
        if frame.id() != CobId::of_node(0x580, self.setup.node) {
            return frame;
        }
        let [a, b, c, d] = code_of_table_19(AbortCode(u32::from_le_bytes([a, b, c, d]))).0.to_le_bytes();
        Frame::from_array(frame.id(), [ABORT, index_low, index_high, sub, a, b, c, d])
    }

    /// When a TPDO that is sent on change will have something new.
    fn next_change(&self) -> Option<Instant> {
        let mut next = None;
        for tpdo in (1..=4).filter_map(|number| self.device.tpdo(number)) {
            if !tpdo.is_active() || tpdo.parameters().transmission != TransmissionType::EventManufacturer {
                continue;
            }
            let readings = [od::POSITION_ACTUAL_VALUE.address(), od::VELOCITY_ACTUAL_VALUE.address()];
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

impl Node for SimulatedDrive {
    fn handle_frame(&mut self, now: Instant, frame: &Frame) {
        if self.inputs().bus == BusState::Active {
            let event = self.with_device(now, |device, od| device.handle_frame(now, frame, od));
            self.follow(now, event);
        }
    }

    fn handle_timeout(&mut self, now: Instant) {
        let event = self.with_device(now, |device, od| device.handle_timeout(now, od));
        self.follow(now, event);
    }

    fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        let emergencies = CobId::from_parameter(self.storage.get(od::COB_ID_EMERGENCY_MESSAGE));
        loop {
            let was = self.device.nmt_state();
            let bus = self.inputs().bus;
            let frame =
                (bus != BusState::Off).then(|| self.with_device(now, |device, od| device.poll_transmit(now, od)))??;
            if was != self.device.nmt_state() {
                self.controller.set_network(now, network(self.device.nmt_state()));
            }
            // Error passive: "communication is no longer enabled", but the emergency tells so.
            if bus == BusState::Active || frame.id() == emergencies {
                return Some(self.with_code_of_table_19(frame));
            }
        }
    }

    fn poll_timeout(&self) -> Option<Instant> {
        [self.device.poll_timeout(), self.controller.next_event(), self.next_change()].into_iter().flatten().min()
    }
}

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

fn network(state: NmtState) -> Network {
    match state {
        NmtState::Operational => Network::Operational,
        NmtState::Stopped => Network::Stopped,
        _ => Network::PreOperational,
    }
}
