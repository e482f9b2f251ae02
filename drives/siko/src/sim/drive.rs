//! The simulated drive, and its view from outside.

use std::path::Path;

use lexican_runtime::device::Device;
use lexican_runtime::object::{Address, Object, ObjectDictionary, Value};
use lexican_runtime::wire::emcy::{ErrorCode, ErrorRegister};
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{AbortCode, Instant, NodeId};
use simulator::Storage;
use simulator::eeprom::EepromFile;
use simulator::script::Following;

use super::controller::{Controller, Network};
use super::eeprom::{EepromError, NonVolatile};
use super::inputs::{BusState, Inputs};
use super::leds::{BusLed, Lights, StatusLed};
use super::objects::{Effect, Objects};
use super::parameters::Parameters;
use super::script::Change;
use super::setup::Setup;
use super::switches::DipSwitches;
use super::trajectory;
use crate::model::Model;
use crate::order::{Braking, Order, Refused};
use crate::state::State;

/// Whether the drive runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Power {
    /// The control has no supply.
    Off,
    On,
    /// It was switched on with the DIP switches set to restore factory settings: it has restored them, shows that, and
    /// does nothing else until it is switched on again (2.4). That it is not on the bus meanwhile is an assumption: its
    /// switches set no address.
    Restored,
}

/// A simulated drive: a [`Node`](lexican_runtime::host::Node), to be attached to a bus.
#[derive(Clone, Debug)]
pub struct SimulatedDrive {
    pub(super) setup: Setup,
    pub(super) device: Device<4, 4, 1, 0>,
    pub(super) storage: Box<dyn Storage>,
    pub(super) controller: Controller,
    effects: Vec<Effect>,
    /// Whether the parameters of the controller may be out of date. They are not read each time, since that takes long.
    pub(super) parameters_written: bool,
    /// Whether an SDO request is being served.
    pub(super) by_sdo: bool,
    /// Up to when everything is up to date; what changes by itself after that is still to be reported.
    pub(super) settled: Instant,
    pub(super) power: Power,
    /// The signals of the LEDs, and since when they are shown.
    leds: ((StatusLed, Instant), (BusLed, Instant)),
    pub(super) switched_off: bool,
    /// In bit/s, from 2100h at the last initialisation.
    pub(super) bit_rate: u32,
    pub(super) eeprom: Option<EepromFile<NonVolatile>>,
    pub(super) following: Following<Change>,
}

impl SimulatedDrive {
    /// A new drive, powered on at time 0.
    #[must_use]
    pub fn new(model: &'static Model, node: NodeId) -> Self {
        SimulatedDrive::power_on(Instant::ZERO, Setup::new(model, node))
    }

    /// A drive that is powered on at `now`.
    #[must_use]
    pub fn power_on(now: Instant, setup: Setup) -> Self {
        let node = setup.node();
        let storage = setup.storage(node);
        let parameters = Parameters::read(setup.model, &*storage, &setup.non_volatile);
        let position = setup.non_volatile.position;
        let mut drive = SimulatedDrive {
            device: Device::new(node, setup.behaviour),
            controller: Controller::new(setup.model, now, parameters, setup.inputs, position),
            effects: Vec::new(),
            parameters_written: false,
            by_sdo: false,
            storage,
            setup,
            settled: now,
            power: Power::Off,
            leds: ((StatusLed::Off, now), (BusLed::Off, now)),
            switched_off: false,
            bit_rate: 0,
            eeprom: None,
            following: Following::default(),
        };
        drive.follow_supply(now);
        drive.settle(now);
        drive
    }

    /// A drive that is powered on at `now`, with a file at `path` for its non-volatile data. The file, if there is one,
    /// replaces [`Setup::non_volatile`]. It is written whenever an entry of the EEPROM has changed, and with the
    /// position whenever the shaft has come to rest.
    ///
    /// ```
    /// # use lexican_runtime::{AbortCode, Instant, NodeId};
    /// # use siko_ag03_1::sim::{MODEL, Setup, SimulatedDrive};
    /// # let path = std::env::temp_dir().join(format!("ag03-eeprom-{}", std::process::id()));
    /// let setup = Setup::new(&MODEL, NodeId::literal(5));
    /// let drive = SimulatedDrive::with_eeprom(Instant::ZERO, setup, &path)?;
    /// assert!(path.exists() && drive.eeprom_trouble().is_none());
    /// # std::fs::remove_file(path)?;
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// Errors: the file cannot be read, is truncated, or is something else.
    pub fn with_eeprom(now: Instant, setup: Setup, path: impl AsRef<Path>) -> Result<Self, EepromError> {
        let (file, kept) = EepromFile::open(path.as_ref(), |text| NonVolatile::from_text(setup.model, text))?;
        let mut setup = setup;
        setup.non_volatile = kept.unwrap_or(setup.non_volatile);
        let mut drive = SimulatedDrive::power_on(now, setup);
        drive.eeprom = Some(file);
        drive.settle(now);
        Ok(drive)
    }

    /// Why the file of the EEPROM could not be written the last time.
    #[must_use]
    pub fn eeprom_trouble(&self) -> Option<&EepromError> {
        self.eeprom.as_ref()?.trouble()
    }

    /// The data that would survive if power went off now.
    #[must_use]
    pub fn non_volatile(&self, now: Instant) -> NonVolatile {
        let kept = self.setup.model.persistent.iter();
        let eeprom = kept.filter_map(|&address| Some((address, self.storage.raw(address)?))).collect();
        NonVolatile { eeprom, position: self.position(now), inching_stop: self.setup.non_volatile.inching_stop }
    }

    /// The node-ID.
    #[must_use]
    pub fn node(&self) -> NodeId {
        self.device.node()
    }

    /// The bit rate in bit/s: 2100h at the last initialisation.
    #[must_use]
    pub fn bit_rate(&self) -> u32 {
        self.bit_rate
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

    /// Which drive it is.
    #[must_use]
    pub fn model(&self) -> &'static Model {
        self.setup.model
    }

    /// The stored value of an object; live values are calculated only when the bus reads them.
    #[must_use]
    pub fn stored<T: Value, A, M, D>(&self, object: Object<T, A, M, D>) -> T {
        self.storage.get(object)
    }

    /// The present parameters of the controller.
    #[must_use]
    pub fn parameters(&self) -> Parameters {
        Parameters::read(self.setup.model, &*self.storage, &self.setup.non_volatile)
    }

    /// Sets parameter 25, how inching operation 2 stops, of the AG02, which has no object for it. In other drives the
    /// object counts.
    pub fn set_inching_stop(&mut self, now: Instant, braking: Braking) {
        self.setup.non_volatile.inching_stop = u8::from(braking == Braking::Programmed);
        self.parameters_written = true;
        self.settle(now);
    }

    /// The position as in 6064h. `now` must not be before the last event; the same holds for the methods below.
    #[must_use]
    pub fn position(&self, now: Instant) -> i32 {
        self.controller.position(now)
    }

    /// The velocity as in 606Ch, in rev/min.
    #[must_use]
    pub fn velocity(&self, now: Instant) -> i32 {
        self.controller.velocity(now)
    }

    /// The status word 6041h.
    #[must_use]
    pub fn status_word(&self, now: Instant) -> u16 {
        self.controller.status_word(now)
    }

    /// Exact position and velocity of the shaft, in increments and increments/s.
    #[must_use]
    pub fn shaft(&self, now: Instant) -> trajectory::State {
        self.controller.motion().state(now)
    }

    /// Turns the shaft by hand, instantly. Returns whether it turned: a motor that is not released holds it.
    pub fn turn_shaft(&mut self, now: Instant, increments: i32) -> bool {
        let turned = self.controller.turn_shaft(now, increments);
        self.settle(now);
        turned
    }

    /// The inputs of the drive.
    #[must_use]
    pub fn inputs(&self) -> &Inputs {
        &self.controller.inputs
    }

    /// Changes the inputs. Without its control supply, the drive is off.
    pub fn set_inputs(&mut self, now: Instant, change: impl FnOnce(&mut Inputs)) {
        let mut inputs = *self.inputs();
        let before = inputs;
        change(&mut inputs);
        if self.power == Power::Off || !inputs.control_is_supplied() {
            self.controller.inputs = inputs;
        } else {
            self.controller.set_inputs(now, inputs);
        }
        self.follow_supply(now);
        // 8120h is not a fault, and ends when the bus has recovered (table 20).
        let was_reported = before.bus == BusState::Passive || before.bus_error.is_some();
        let recovered = was_reported && inputs.bus == BusState::Active && inputs.bus_error.is_none();
        if recovered && self.is_running() && self.controller.faults().is_empty() {
            let is_reported = self.setup.model.reports_recovery;
            self.with_device(now, |device, od| match is_reported {
                true => device.clear(ErrorRegister(0xFF), od),
                false => device.clear_unreported(ErrorRegister(0xFF), od),
            });
        }
        self.settle(now);
    }

    /// The DIP switches.
    #[must_use]
    pub fn switches(&self) -> DipSwitches {
        self.setup.switches
    }

    /// Sets the DIP switches; the drive reads them when its supply is switched on (7.13).
    pub fn set_switches(&mut self, switches: DipSwitches) {
        self.setup.switches = switches;
    }

    /// What the status LED shows.
    #[must_use]
    pub fn status_led(&self) -> StatusLed {
        match (self.power, self.controller.faults().first()) {
            (Power::Off, _) => StatusLed::Off,
            (Power::Restored, _) => StatusLed::Alternates,
            (Power::On, Some(fault)) => StatusLed::Blinks(fault.blinks),
            (Power::On, None) if self.inputs().supply_is_present() => StatusLed::On,
            (Power::On, None) => StatusLed::Off,
        }
    }

    /// What the bus LED shows.
    #[must_use]
    pub fn bus_led(&self) -> BusLed {
        match self.power {
            Power::Off => BusLed::Off,
            Power::Restored => BusLed::Alternates,
            Power::On => BusLed::of(self.nmt_state()),
        }
    }

    /// Which LEDs are lit at `now`. Blinking starts when the signal is first shown.
    #[must_use]
    pub fn lights(&self, now: Instant) -> Lights {
        let ((status, status_since), (bus, bus_since)) = self.leds;
        Lights { status: status.is_lit(now.since(status_since)), bus: bus.is_lit(now.since(bus_since)) }
    }

    fn show(&mut self, now: Instant) {
        let (status, bus) = (self.status_led(), self.bus_led());
        if self.leds.0.0 != status {
            self.leds.0 = (status, now);
        }
        if self.leds.1.0 != bus {
            self.leds.1 = (bus, now);
        }
    }

    /// Gives `call` the dictionary with its live values, without the bus: access rights are not enforced, all other
    /// checks are.
    pub fn with_dictionary<T>(&mut self, now: Instant, call: impl FnOnce(&mut dyn ObjectDictionary) -> T) -> T {
        let result = self.with_device(now, |_, od| call(od));
        self.settle(now);
        result
    }

    /// Writes an object without the bus: access rights are not enforced, all other checks are; communication settings
    /// take effect.
    ///
    /// Errors: the abort code that a client would get; nothing has changed then.
    pub fn write(&mut self, now: Instant, address: Address, data: &[u8]) -> Result<(), AbortCode> {
        let result = self.with_device(now, |device, od| device.write(now, address, data, od));
        self.settle(now);
        result
    }

    /// Takes an order without the bus, as from another interface of the drive.
    ///
    /// Errors: why the drive refuses. A drive that is off counts as not enabled.
    pub fn order(&mut self, now: Instant, order: Order) -> Result<(), Refused> {
        let result = if self.is_running() { self.controller.order(now, order) } else { Err(Refused::NotEnabled) };
        self.settle(now);
        result
    }

    /// Sets what another interface than CAN allows the drive. While that interface has control
    /// ([`Operational`](Network::Operational)), the operator keys are locked; when it loses control, the motor is
    /// released.
    pub fn set_network(&mut self, now: Instant, network: Network) {
        self.controller.set_network(now, network);
        self.settle(now);
    }

    pub(super) fn with_device<T>(
        &mut self,
        now: Instant,
        call: impl FnOnce(&mut Device<4, 4, 1, 0>, &mut dyn ObjectDictionary) -> T,
    ) -> T {
        let mut od = Objects {
            now,
            model: self.setup.model,
            node: self.device.node(),
            network: self.device.nmt_state(),
            by_sdo: self.by_sdo,
            storage: &mut *self.storage,
            inching_stop: &mut self.setup.non_volatile.inching_stop,
            parameters_written: &mut self.parameters_written,
            controller: &self.controller,
            effects: &mut self.effects,
        };
        call(&mut self.device, &mut od)
    }

    pub(super) fn enter(&mut self, now: Instant, state: NmtState) {
        let network = match state {
            NmtState::Operational => Network::Operational,
            NmtState::Stopped => Network::Stopped,
            _ => Network::PreOperational,
        };
        self.controller.set_network(now, network);
        self.show(now);
    }

    /// Notes that the dictionary has refused a target that came with the control word.
    pub(super) fn miss_target(&mut self) {
        for effect in &mut self.effects {
            if let Effect::Control(word) = *effect {
                *effect = Effect::ControlWithoutTarget(word);
            }
        }
    }

    /// Follows up all effects of the last event.
    pub(super) fn settle(&mut self, now: Instant) {
        if self.is_running() {
            self.settle_running(now);
        }
        self.settled = now;
        self.show(now);
        self.save(now);
    }

    fn settle_running(&mut self, now: Instant) {
        if std::mem::take(&mut self.parameters_written) {
            let parameters = self.parameters();
            if parameters != self.controller.parameters {
                self.controller.set_parameters(now, parameters);
            }
        }
        for effect in std::mem::take(&mut self.effects) {
            match effect {
                Effect::Control(word) => self.controller.control(now, word),
                Effect::ControlWithoutTarget(word) => self.controller.control_without_target(now, word),
                Effect::Calibrate => self.controller.calibrate(now, self.controller.parameters.calibration_value),
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
    }
}
