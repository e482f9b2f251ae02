//! The simulated device: made of its data sheet, or a drive with a simulator of its own.

use std::collections::VecDeque;
use std::path::Path;
use std::sync::Arc;

use lexican_eds::model::Device;
use lexican_registry::{DRIVES, DriveModel};
use lexican_runtime::device::Misconfigured;
use lexican_runtime::host::Node;
use lexican_runtime::object::Address;
use lexican_runtime::wire::emcy::{ErrorCode, ErrorRegister};
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{AbortCode, CobId, Frame, Instant, NodeId};
use lexican_toolbox::data_sheet::DataSheet;
use lexican_toolbox::text::node_id::node_id;
use lexican_toolbox::values::DeviceValues;
use lexican_toolbox::values::lookup::resolve;
use lexican_toolbox::values::report::ValueReport;
use siko_ag03_1::sim::{Model, Setup, SimulatedDrive};
use siko_serial::sim::SerialDrive;
use simulator::eeprom::EepromError;
use simulator::script::{FromToml, Input, Script, ScriptError};
use simulator::servo::{self, Servo, ServoModel};
use simulator::{Memory, SimulatedServo, trajectory};

use super::command::{Command, Power, Refusal};
use super::interface::Interface;
use super::virtual_device::{VirtualDevice, keeps};

/// Why a device cannot be simulated.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SimulationError {
    /// It has no node-ID, and no LSS by which it could get one.
    #[error("this drive has no LSS, by which it could get a node-ID")]
    NoLss,
    /// The file for stored parameters cannot be used.
    #[error(transparent)]
    Eeprom(#[from] EepromError),
}

/// A device that exists only in software.
pub struct SimulatedDevice {
    sheet: Arc<Device>,
    /// Its name in a plant.
    name: Option<String>,
    /// The node-ID that it is meant to have.
    given: Option<NodeId>,
    kind: Kind,
    /// Frames that it sent before it was connected.
    sent: VecDeque<Frame>,
}

enum Kind {
    Sheet(Box<VirtualDevice>),
    Drive(Interface),
    Servo(Box<SimulatedServo>),
}

impl SimulatedDevice {
    /// A device that is switched on at `now`. A device of the library that has its own simulator uses that; all others
    /// are made of their data sheets. Without a node-ID it waits for one by LSS. It stores parameters in the file
    /// `eeprom`, if there is one.
    pub fn new(
        now: Instant,
        sheet: &DataSheet,
        node: Option<NodeId>,
        eeprom: Option<&Path>,
    ) -> Result<Self, SimulationError> {
        let device = Arc::new(sheet.device.clone());
        let model = sheet.library.and_then(lexican_registry::find).map(|drive| drive.model);
        let kind = match (model, node) {
            (Some(DriveModel::Siko(model)), Some(node)) => Kind::drive(now, model, node, eeprom)?,
            (Some(DriveModel::Servo(model)), Some(node)) => Kind::servo(now, model, node, eeprom)?,
            (Some(_), None) => return Err(SimulationError::NoLss),
            (None, node) => Kind::sheet(now, node, sheet.input.eds.text(), &device, eeprom)?,
        };
        Ok(SimulatedDevice { sheet: device, name: None, given: node, kind, sent: VecDeque::new() })
    }

    /// The same device with a name.
    #[must_use]
    pub fn named(self, name: Option<String>) -> Self {
        SimulatedDevice { name, ..self }
    }

    /// The name that its plant gives it, if any.
    #[must_use]
    pub fn name(&self) -> Option<&str> {
        self.name.as_deref()
    }

    /// Its data sheet.
    #[must_use]
    pub fn sheet(&self) -> &Device {
        &self.sheet
    }

    /// The node-ID that it has, or is meant to have while it is off.
    #[must_use]
    pub fn node(&self) -> Option<NodeId> {
        self.node_id().or(self.given)
    }

    /// Whether `who` is its name or its node-ID.
    #[must_use]
    pub fn is_called(&self, who: &str) -> bool {
        let node = self.node();
        self.name() == Some(who) || node.is_some() && node_id(who).ok() == node
    }

    /// Carries out a command. The answer is empty if the effect shows on the bus.
    pub fn carry_out(&mut self, now: Instant, command: &Command) -> Result<String, Refusal> {
        match command {
            Command::Status => return Ok(self.status(now)),
            Command::Get(object) => return self.get(now, object),
            Command::Set { object, value } => return self.set(now, object, value),
            Command::Emcy { code, register, msef } => {
                let device = self.with_errors().map_err(|[instead, _]| Refusal::OwnEmergencies { instead })?;
                device.emergency(ErrorCode(*code), ErrorRegister(*register), *msef);
            }
            Command::EmcyClear => {
                self.with_errors().map_err(|[_, instead]| Refusal::OwnCauses { instead })?.clear_errors();
            }
            Command::Power(power) => self.set_power(now, *power),
            Command::Input(line) => {
                self.input(now, line)?;
                return Ok(line.clone());
            }
        }
        Ok(String::new())
    }

    /// Its state in words: `node 5: OPERATIONAL, position 100, ...`.
    #[must_use]
    pub fn status(&self, now: Instant) -> String {
        let who = self.node_id().map_or_else(|| "no node-ID".to_owned(), |node| format!("node {node}"));
        let state = self.nmt_state().map_or_else(|| "not on the bus".to_owned(), |state| state.to_string());
        format!("{who}: {state}{}", self.motion(now))
    }

    /// An object with its name and its value in words.
    fn get(&mut self, now: Instant, object: &str) -> Result<String, Refusal> {
        let sheet = Arc::clone(&self.sheet);
        let address = resolve(Some(&sheet), object)?;
        let value = self.value(now, address).map_err(|code| Refusal::Access { address, code })?;
        let values = self.values(now, &sheet, address);
        Ok(ValueReport::of_bytes(Some(&values), address, &value).equation())
    }

    fn set(&mut self, now: Instant, object: &str, text: &str) -> Result<String, Refusal> {
        let sheet = Arc::clone(&self.sheet);
        let address = resolve(Some(&sheet), object)?;
        let values = self.values(now, &sheet, address);
        let data = values.encode(address, text).map_err(Refusal::Value)?;
        self.set_value(now, address, &data).map_err(|code| Refusal::Access { address, code })?;
        Ok(ValueReport::of_bytes(Some(&values), address, &data).equation())
    }

    /// The values on which unit and limits of an entry depend.
    fn values<'a>(&mut self, now: Instant, sheet: &'a Device, address: Address) -> DeviceValues<'a> {
        let mut values = DeviceValues::new(sheet);
        for condition in values.entry(address).map(|entry| values.conditions(entry)).unwrap_or_default() {
            let data = self.value(now, condition).unwrap_or_default();
            if let Some(value) = ValueReport::of_bytes(Some(&values), condition, &data).value {
                values.set(condition, &value);
            }
        }
        values
    }
}

impl Kind {
    fn sheet(
        now: Instant,
        node: Option<NodeId>,
        text: &str,
        sheet: &Arc<Device>,
        eeprom: Option<&Path>,
    ) -> Result<Self, EepromError> {
        let mut memory = eeprom.map(|path| Memory::open(path, keeps(sheet))).transpose()?.unwrap_or_default();
        memory.data_sheet = text.as_bytes().to_vec();
        Ok(Kind::Sheet(Box::new(VirtualDevice::with_memory(now, node, Arc::clone(sheet), memory))))
    }

    fn drive(now: Instant, model: &'static Model, node: NodeId, eeprom: Option<&Path>) -> Result<Self, EepromError> {
        let setup = Setup::new(model, node);
        let drive = match eeprom {
            Some(path) => SimulatedDrive::with_eeprom(now, setup, path)?,
            None => SimulatedDrive::power_on(now, setup),
        };
        Ok(Kind::Drive(Interface::Serial(Box::new(SerialDrive::new(drive)))))
    }

    fn servo(
        now: Instant,
        model: &'static ServoModel,
        node: NodeId,
        eeprom: Option<&Path>,
    ) -> Result<Self, EepromError> {
        let servo = match eeprom {
            Some(path) => SimulatedServo::with_eeprom(now, model, node, path)?,
            None => SimulatedServo::new(now, model, node),
        };
        Ok(Kind::Servo(Box::new(servo)))
    }
}

impl SimulatedDevice {
    /// Runs a script of events on the drive, beginning at `now`.
    pub fn follow(&mut self, now: Instant, script: &str) -> Result<(), ScriptError> {
        match &mut self.kind {
            Kind::Drive(siko) => {
                let drive = siko.drive_mut();
                drive.follow(now, Script::from_toml(drive.model(), script)?);
            }
            Kind::Servo(servo) => servo.follow(now, Script::from_toml(servo.model(), script)?),
            Kind::Sheet(device) => match device.model() {
                Some(model) => device.follow_script(now, Script::from_toml(model, script)?),
                None => {
                    let known: Vec<&str> = DRIVES.iter().map(|drive| drive.library).collect();
                    return Err(ScriptError {
                        line: 1,
                        problem: "this device does not follow a script".to_owned(),
                        remedy: format!(
                            "drives of CiA 402 do, and {}; lines on stdin control any device",
                            known.join(", ")
                        ),
                    });
                }
            },
        }
        Ok(())
    }

    /// The node-ID; `None` while it is off, or has none.
    #[must_use]
    pub fn node_id(&self) -> Option<NodeId> {
        match &self.kind {
            Kind::Sheet(device) => device.node(),
            Kind::Drive(siko) => siko.drive().is_on().then(|| siko.drive().node()),
            Kind::Servo(servo) => servo.is_on().then(|| servo.node()),
        }
    }

    /// The NMT state; `None` while it is off, or has no node-ID.
    #[must_use]
    pub fn nmt_state(&self) -> Option<NmtState> {
        match &self.kind {
            Kind::Sheet(device) => device.nmt_state(),
            Kind::Drive(siko) => siko.drive().is_on().then(|| siko.drive().nmt_state()),
            Kind::Servo(servo) => servo.is_on().then(|| servo.nmt_state()),
        }
    }

    /// State and motion of a drive that is on; else empty.
    fn motion(&self, now: Instant) -> String {
        match &self.kind {
            Kind::Sheet(device) => device.servo().map_or_else(String::new, |servo| axis(servo, now)),
            Kind::Servo(servo) if servo.is_on() => axis(servo.servo(), now),
            Kind::Drive(siko) if siko.drive().is_on() => {
                let drive = siko.drive();
                format!(", {}, position {}, {} rev/min", drive.state(), drive.position(now), drive.velocity(now))
            }
            Kind::Drive(_) | Kind::Servo(_) => String::new(),
        }
    }

    /// True position and velocity of the shaft of a drive, in units of its simulator; `None` for other devices.
    #[must_use]
    pub fn shaft(&self, now: Instant) -> Option<trajectory::State> {
        match &self.kind {
            Kind::Sheet(device) => device.servo().map(|servo| servo.shaft(now)),
            Kind::Servo(servo) => Some(servo.servo().shaft(now)),
            Kind::Drive(serial) => Some(serial.drive().shaft(now)),
        }
    }

    /// What it simulates, for the user.
    #[must_use]
    pub fn abilities(&self) -> &'static str {
        match &self.kind {
            Kind::Sheet(device) if device.servo().is_some() => "a CiA 402 drive that moves",
            Kind::Sheet(device) if device.serves_lss() => "every object of its data sheet, and LSS",
            Kind::Sheet(_) => "every object of its data sheet",
            Kind::Drive(_) | Kind::Servo(_) => "a drive that moves",
        }
    }

    /// The bytes of an entry, as a client reads them over the bus.
    pub fn value(&mut self, now: Instant, address: Address) -> Result<Vec<u8>, AbortCode> {
        match &mut self.kind {
            Kind::Sheet(device) => device.value(now, address),
            Kind::Drive(siko) => siko.drive_mut().with_dictionary(now, |od| simulator::read(od, address)),
            Kind::Servo(servo) => servo.with_servo(now, |_, od| simulator::read(od, address)),
        }
    }

    /// Changes an entry, regardless of its access. A configuration takes effect.
    pub fn set_value(&mut self, now: Instant, address: Address, data: &[u8]) -> Result<(), AbortCode> {
        match &mut self.kind {
            Kind::Sheet(device) => device.set_value(now, address, data),
            Kind::Drive(siko) => siko.drive_mut().write(now, address, data),
            Kind::Servo(servo) => servo.write(now, address, data),
        }
    }

    /// Lets a device that has just been switched on send its boot-up: some objects can be changed only after it.
    pub(super) fn let_boot(&mut self, now: Instant) {
        while let Some(frame) = self.as_node_mut().poll_transmit(now) {
            self.sent.push_back(frame);
        }
    }

    /// The device of a data sheet. For a drive: the inputs that make it send an EMCY, and that end its errors.
    fn with_errors(&mut self) -> Result<&mut VirtualDevice, [&'static str; 2]> {
        match &mut self.kind {
            Kind::Sheet(device) => Ok(device),
            Kind::Servo(_) => Err(["fault = 0x4310", "fault = none"]),
            Kind::Drive(_) => Err(["fault = \"D\"", "clear = \"all\""]),
        }
    }

    /// Switches the supply.
    pub fn set_power(&mut self, now: Instant, power: Power) {
        if power != Power::On {
            Node::set_power(self, now, false);
        }
        if power != Power::Off {
            Node::set_power(self, now, true);
        }
    }

    /// Sets an input of the drive, in the syntax of its scripts: `battery_v = 2.5`.
    pub fn input(&mut self, now: Instant, line: &str) -> Result<(), Refusal> {
        match &mut self.kind {
            Kind::Drive(siko) => {
                let drive = siko.drive_mut();
                changes(drive.model(), line)?.into_iter().for_each(|change| drive.apply(now, change));
            }
            Kind::Servo(servo) => {
                changes(servo.model(), line)?.iter().for_each(|change| servo.apply(now, change));
            }
            Kind::Sheet(device) => {
                let model = device.model().ok_or(Refusal::NoInputs)?;
                changes(model, line)?.iter().for_each(|change| device.apply(now, change));
            }
        }
        Ok(())
    }

    /// The inputs of a drive and their present values: [`SimulatedDevice::input`] takes the [`line`](Input::line) of
    /// one with another value. Empty for a device that is no drive.
    #[must_use]
    pub fn inputs(&self) -> Vec<Input> {
        match &self.kind {
            Kind::Drive(siko) => siko_ag03_1::sim::script::inputs(siko.drive()),
            Kind::Servo(servo) => servo::script::inputs(servo.servo().inputs()),
            Kind::Sheet(device) => device.world().map(servo::script::inputs).unwrap_or_default(),
        }
    }

    /// The same drive behind PROFIBUS instead of CAN, its node-ID being its address. A device that is no drive of
    /// `model` stays as it is.
    #[must_use]
    pub fn on_profibus(mut self, now: Instant, model: &'static siko_profibus::Model) -> Self {
        self.kind = match self.kind {
            Kind::Drive(interface) if std::ptr::eq(interface.drive().model(), model.drive) => {
                Kind::Drive(interface.into_profibus(now, model))
            }
            kind => kind,
        };
        self
    }

    /// Takes bytes from its serial interface or PROFIBUS, and returns the answer.
    pub fn answer(&mut self, now: Instant, bytes: &[u8]) -> Vec<u8> {
        match &mut self.kind {
            Kind::Drive(interface) => interface.answer(now, bytes),
            Kind::Sheet(_) | Kind::Servo(_) => Vec::new(),
        }
    }

    /// The parts of its dictionary that the device cannot serve; reported once.
    pub fn take_misconfigured(&mut self) -> Vec<Misconfigured> {
        match &mut self.kind {
            Kind::Sheet(device) => device.take_misconfigured(),
            Kind::Drive(_) | Kind::Servo(_) => Vec::new(),
        }
    }

    /// Why the stored parameters could not be written to their file.
    #[must_use]
    pub fn trouble(&self) -> Option<&EepromError> {
        match &self.kind {
            Kind::Sheet(device) => device.trouble(),
            Kind::Drive(siko) => siko.drive().eeprom_trouble(),
            Kind::Servo(servo) => servo.eeprom_trouble(),
        }
    }

    fn as_node(&self) -> &dyn Node {
        match &self.kind {
            Kind::Sheet(device) => &**device,
            Kind::Drive(siko) => siko.drive(),
            Kind::Servo(servo) => &**servo,
        }
    }

    fn as_node_mut(&mut self) -> &mut dyn Node {
        match &mut self.kind {
            Kind::Sheet(device) => &mut **device,
            Kind::Drive(siko) => siko.drive_mut(),
            Kind::Servo(servo) => &mut **servo,
        }
    }
}

/// State and motion of an axis.
fn axis(servo: &Servo, now: Instant) -> String {
    let shaft = servo.shaft(now);
    format!(", {}, shaft at {:.0}, {:.0}/s", servo.state(), shaft.position, shaft.velocity)
}

/// The changes that a line in the syntax of scripts makes. A single word needs no quotes.
fn changes<C: FromToml + Clone>(model: &C::Model, line: &str) -> Result<Vec<C>, Refusal> {
    let (key, value) = line.split_once('=').unwrap_or((line, ""));
    let value = value.trim();
    let is_word = value.starts_with(char::is_alphabetic) && value.chars().all(char::is_alphanumeric);
    let is_bare = is_word && !["true", "false", "inf", "nan"].contains(&value);
    let value = if is_bare { format!("{value:?}") } else { value.to_owned() };
    let script = Script::from_toml(model, &format!("[[step]]\n{key} = {value}\n"));
    let script = script.map_err(|error| Refusal::Input { problem: error.problem, remedy: error.remedy })?;
    Ok(script.steps().iter().flat_map(|step| step.changes.clone()).collect())
}

impl Node for SimulatedDevice {
    fn handle_frame(&mut self, now: Instant, frame: &Frame) {
        self.as_node_mut().handle_frame(now, frame);
    }
    fn handle_timeout(&mut self, now: Instant) {
        self.as_node_mut().handle_timeout(now);
    }
    fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        self.sent.pop_front().or_else(|| self.as_node_mut().poll_transmit(now))
    }
    fn poll_timeout(&self) -> Option<Instant> {
        self.as_node().poll_timeout()
    }
    fn concerns(&self) -> Vec<CobId> {
        self.as_node().concerns()
    }
    fn generation(&self) -> u32 {
        self.as_node().generation()
    }
    fn changes_only_when_called(&self) -> bool {
        self.as_node().changes_only_when_called()
    }
    fn set_power(&mut self, now: Instant, on: bool) {
        self.as_node_mut().set_power(now, on);
        if let Kind::Drive(siko) = &mut self.kind {
            siko.follow_supply(now);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::parse;
    use lexican_runtime::host::VirtualBus;
    use lexican_runtime::{Duration, host::Link};
    use std::sync::{Arc, Mutex};

    /// A data sheet that is not in the library.
    const SENSOR: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../cli/tests/sensor.eds");

    /// A device that has booted on a bus, and a function that returns the frames of the next milliseconds.
    fn bus(device: &str) -> (VirtualBus, Arc<Mutex<SimulatedDevice>>, impl FnMut(u64) -> Vec<String>) {
        let sheet = DataSheet::load(device, &[]).unwrap();
        let bus = VirtualBus::new();
        let device = SimulatedDevice::new(bus.now(), &sheet, NodeId::new(5), None).unwrap();
        let device = Arc::new(Mutex::new(device));
        bus.attach(Arc::clone(&device));
        let mut link = bus.link();
        bus.advance(Duration::from_millis(1));
        let heard = move |ms| {
            let until = link.now() + Duration::from_millis(ms);
            std::iter::from_fn(|| link.receive_frame(until).unwrap()).map(|frame| frame.to_string()).collect()
        };
        (bus, device, heard)
    }

    fn carry_out(bus: &VirtualBus, device: &Mutex<SimulatedDevice>, line: &str) -> Result<String, Refusal> {
        device.lock().unwrap().carry_out(bus.now(), &parse(line).unwrap().unwrap())
    }

    #[test]
    fn what_is_set_takes_effect_in_every_kind_of_device() {
        for (name, time) in [("siko/ag03-1", "raw:100"), ("kollmorgen/akd", "100"), (SENSOR, "100")] {
            let (bus, device, mut heard) = bus(name);
            assert_eq!(heard(1), ["705#00"], "{name}");
            carry_out(&bus, &device, &format!("set 1017 {time}")).unwrap();
            assert_eq!(heard(150), ["705#7F", "705#7F"], "{name}");
            carry_out(&bus, &device, "power off").unwrap();
            assert_eq!(heard(500), [""; 0], "{name}");
            assert_eq!(carry_out(&bus, &device, "status").unwrap(), "no node-ID: not on the bus", "{name}");
            // The heartbeat time was lost with the power.
            carry_out(&bus, &device, "power on").unwrap();
            assert_eq!(heard(500), ["705#00"], "{name}");
        }
    }

    #[test]
    fn what_a_device_refuses_is_said() {
        for (name, line, words) in [
            ("siko/ag03-1", "set 2FFF 1", "2FFF"),
            ("siko/ag03-1", "set 6060 9", "6060:00: 0609 0031"),
            ("siko/ag03-1", "emcy 3120", "when it has a fault: fault = \"D\""),
            ("kollmorgen/akd", "emcy clear", "goes with: fault = none"),
            ("kollmorgen/akd", "blocked = maybe", "`blocked` cannot be \"maybe\"; write true or false"),
            (SENSOR, "blocked = true", "no inputs but its objects"),
            (SENSOR, "set 2000 9999", "2000:00: "),
        ] {
            let (bus, device, _) = bus(name);
            let refusal = carry_out(&bus, &device, line).unwrap_err().to_string();
            assert!(refusal.contains(words), "{name}: {line}: {refusal}");
        }
    }

    #[test]
    fn a_value_is_in_the_unit_that_the_device_has_now() {
        let (bus, device, _) = bus("siko/ag03-1");
        assert!(carry_out(&bus, &device, "set 607C \"12.5 mm\"").is_err());
        carry_out(&bus, &device, "set 2412 \"1.00 mm\"").unwrap();
        assert_eq!(
            carry_out(&bus, &device, "set 607C \"12.5 mm\"").unwrap(),
            carry_out(&bus, &device, "get 607C").unwrap()
        );
    }

    #[test]
    fn each_input_is_set_by_its_line() {
        for (name, input, value) in [("siko/ag03-1", "shaft", "blocked"), ("kollmorgen/akd", "blocked", "true")] {
            let (bus, device, _) = bus(name);
            let find = |device: &SimulatedDevice| device.inputs().into_iter().find(|it| it.name == input).unwrap();
            let line = find(&device.lock().unwrap()).line(value);
            assert_eq!(carry_out(&bus, &device, &line).unwrap(), line);
            assert_eq!(find(&device.lock().unwrap()).value.as_deref(), Some(value), "{name}");
        }
        let (_, device, _) = bus(SENSOR);
        assert_eq!(device.lock().unwrap().inputs(), []);
    }
}
