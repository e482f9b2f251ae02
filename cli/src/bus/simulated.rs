//! The simulated device: made of its data sheet, or a drive that moves.

use std::collections::VecDeque;
use std::path::Path;
use std::sync::Arc;

use lexican_eds::model::Device;
use lexican_runtime::device::Misconfigured;
use lexican_runtime::host::Node;
use lexican_runtime::object::{Address, ObjectDictionary};
use lexican_runtime::wire::emcy::{ErrorCode, ErrorRegister};
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::wire::sdo::{ClientRequest, Content, Expedited, ServerResponse};
use lexican_runtime::{AbortCode, CobId, Frame, Instant, NodeId, cia301};
use lexican_toolbox::values::wire::written;
use siko_ag03_1::sim::{Model, Setup, SimulatedDrive};
use siko_serial::sim::SerialDrive;
use simulator::script::{FromToml, Script, ScriptError};
use simulator::servo::{Servo, ServoModel};
use simulator::{Memory, SimulatedServo};

use super::sdo::{request_frame, response_id};
use super::virtual_device::{VirtualDevice, keeps};
use crate::device::Loaded;
use crate::output::Failure;

/// A simulator that knows more than a data sheet says.
#[derive(Clone, Copy)]
enum Simulator {
    /// A positioning drive of SIKO.
    Siko(&'static Model),
    /// A servo with a model of its own.
    Servo(&'static ServoModel),
}

/// The devices of the library that have a simulator of their own.
const SIMULATORS: &[(&str, Simulator)] = &[
    ("kollmorgen/akd", Simulator::Servo(&kollmorgen_akd::sim::MODEL)),
    ("siko/ag02", Simulator::Siko(&siko_ag02::sim::MODEL)),
    ("siko/ag03-1", Simulator::Siko(&siko_ag03_1::sim::MODEL)),
];

/// The simulator of a device of the library; none for a file.
fn simulator(name: &str) -> Option<Simulator> {
    let shipped = lexican_eds::library::find(name).filter(|_| !Path::new(name).is_file())?;
    SIMULATORS.iter().find(|(id, _)| *id == shipped.id).map(|(_, simulator)| *simulator)
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Power {
    On,
    Off,
    Cycle,
}

/// A device that exists only in software.
pub(crate) struct Simulated {
    kind: Kind,
    /// What it has sent before it was connected.
    sent: VecDeque<Frame>,
}

enum Kind {
    Sheet(Box<VirtualDevice>),
    /// With its serial interface, which nothing is connected to on CAN.
    Drive(Box<SerialDrive>),
    Servo(Box<SimulatedServo>),
}

impl Simulated {
    /// A device that is switched on at `now`: one of the library with its own simulator, if it has one, else the device of
    /// its data sheet.
    pub(crate) fn new(
        now: Instant,
        name: &str,
        node: Option<NodeId>,
        loaded: &Loaded,
        eeprom: Option<&Path>,
    ) -> Result<Self, Failure> {
        let kind = match (simulator(name), node) {
            (Some(Simulator::Siko(model)), Some(node)) => Kind::drive(now, model, node, eeprom),
            (Some(Simulator::Servo(model)), Some(node)) => Kind::servo(now, model, node, eeprom),
            (Some(_), None) => {
                Err(Failure::new("this drive has no LSS, by which it could get a node-ID").help("--node 5"))
            }
            (None, node) => Kind::sheet(now, node, loaded, eeprom),
        };
        Ok(Simulated { kind: kind?, sent: VecDeque::new() })
    }
}

impl Kind {
    fn sheet(now: Instant, node: Option<NodeId>, loaded: &Loaded, eeprom: Option<&Path>) -> Result<Self, Failure> {
        let memory = match eeprom {
            Some(path) => Memory::open(path, keeps(&loaded.device)).map_err(Failure::new)?,
            None => Memory::default(),
        };
        let sheet = Arc::new(loaded.device.clone());
        Ok(Kind::Sheet(Box::new(VirtualDevice::with_memory(now, node, sheet, memory))))
    }

    fn drive(now: Instant, model: &'static Model, node: NodeId, eeprom: Option<&Path>) -> Result<Self, Failure> {
        let setup = Setup::new(model, node);
        let drive = match eeprom {
            Some(path) => SimulatedDrive::with_eeprom(now, setup, path).map_err(Failure::new)?,
            None => SimulatedDrive::power_on(now, setup),
        };
        Ok(Kind::Drive(Box::new(SerialDrive::new(drive))))
    }

    fn servo(now: Instant, model: &'static ServoModel, node: NodeId, eeprom: Option<&Path>) -> Result<Self, Failure> {
        let servo = match eeprom {
            Some(path) => SimulatedServo::with_eeprom(now, model, node, path).map_err(Failure::new)?,
            None => SimulatedServo::new(now, model, node),
        };
        Ok(Kind::Servo(Box::new(servo)))
    }
}

impl Simulated {
    /// Lets a script happen to the drive, beginning at `now`.
    pub(crate) fn follow(&mut self, now: Instant, script: &str) -> Result<(), ScriptError> {
        match &mut self.kind {
            Kind::Drive(serial) => {
                let drive = serial.drive_mut();
                drive.follow(now, Script::from_toml(drive.model(), script)?);
            }
            Kind::Servo(servo) => servo.follow(now, Script::from_toml(servo.model(), script)?),
            Kind::Sheet(device) => match device.model() {
                Some(model) => device.follow_script(now, Script::from_toml(model, script)?),
                None => {
                    let known: Vec<&str> = SIMULATORS.iter().map(|(id, _)| *id).collect();
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

    /// The node-ID; none while it is off, or has none.
    pub(crate) fn node_id(&self) -> Option<NodeId> {
        match &self.kind {
            Kind::Sheet(device) => device.node(),
            Kind::Drive(serial) => serial.drive().is_on().then(|| serial.drive().node()),
            Kind::Servo(servo) => servo.is_on().then(|| servo.node()),
        }
    }

    /// The NMT state; none while it is off, or has no node-ID.
    pub(crate) fn nmt_state(&self) -> Option<NmtState> {
        match &self.kind {
            Kind::Sheet(device) => device.nmt_state(),
            Kind::Drive(serial) => serial.drive().is_on().then(|| serial.drive().nmt_state()),
            Kind::Servo(servo) => servo.is_on().then(|| servo.nmt_state()),
        }
    }

    pub(crate) fn state(&self, now: Instant) -> String {
        match &self.kind {
            Kind::Sheet(device) => device.servo().map_or_else(String::new, |servo| axis(servo, now)),
            Kind::Servo(servo) if servo.is_on() => axis(servo.servo(), now),
            Kind::Drive(serial) if serial.drive().is_on() => {
                let drive = serial.drive();
                format!(", {}, position {}, {} rev/min", drive.state(), drive.position(now), drive.velocity(now))
            }
            Kind::Drive(_) | Kind::Servo(_) => String::new(),
        }
    }

    /// What it simulates, for the user.
    pub(crate) fn abilities(&self) -> &'static str {
        match &self.kind {
            Kind::Sheet(device) if device.servo().is_some() => "a CiA 402 drive that moves",
            Kind::Sheet(device) if device.serves_lss() => "every object of its data sheet, and LSS",
            Kind::Sheet(_) => "every object of its data sheet",
            Kind::Drive(_) | Kind::Servo(_) => "a drive that moves",
        }
    }

    /// The bytes of an entry, as the bus would read them.
    pub(crate) fn value(&mut self, now: Instant, address: Address) -> Result<Vec<u8>, AbortCode> {
        match &mut self.kind {
            Kind::Sheet(device) => device.value(now, address),
            Kind::Drive(drive) => drive.drive_mut().with_dictionary(now, |od| simulator::read(od, address)),
            Kind::Servo(servo) => servo.with_servo(now, |_, od| simulator::read(od, address)),
        }
    }

    /// Changes an entry, regardless of its access.
    pub(crate) fn set_value(&mut self, now: Instant, address: Address, data: &[u8]) -> Result<(), AbortCode> {
        match &mut self.kind {
            Kind::Sheet(device) => device.set_value(now, address, data),
            Kind::Drive(drive) => drive.drive_mut().with_dictionary(now, |od| write_entry(od, address, data)),
            Kind::Servo(servo) => servo.with_servo(now, |_, od| write_entry(od, address, data)),
        }
    }

    /// Changes an entry as [`Simulated::set_value`] does; what configures the communication takes effect.
    pub(crate) fn configure(
        &mut self,
        now: Instant,
        sheet: &Device,
        address: Address,
        data: &[u8],
    ) -> Result<(), AbortCode> {
        let is_communication = cia301::COMMUNICATION.contains(&address.index());
        if let Some(node) = self.node_id().filter(|_| is_communication)
            && let Some(content) = Expedited::new(&written(Some(sheet), data.to_vec()))
        {
            // SDO begins after the boot-up message.
            self.send_what_waits(now, node);
            let content = Content::Expedited(content);
            let request = request_frame(node, ClientRequest::InitiateDownload { address, content });
            self.as_node_mut().handle_frame(now, &request);
            match self.send_what_waits(now, node) {
                Some(ServerResponse::InitiateDownload { .. }) => return Ok(()),
                Some(ServerResponse::Abort(abort)) if abort.code != AbortCode::READ_ONLY => return Err(abort.code),
                _ => {}
            }
        }
        self.set_value(now, address, data)
    }

    /// Takes what the device sends; returns the response to an SDO request.
    fn send_what_waits(&mut self, now: Instant, node: NodeId) -> Option<ServerResponse> {
        let mut response = None;
        while let Some(frame) = self.as_node_mut().poll_transmit(now) {
            match frame.id() == response_id(node) {
                true => response = ServerResponse::parse(frame.data()),
                false => self.sent.push_back(frame),
            }
        }
        response
    }

    pub(crate) fn emergency(&mut self, code: u16, register: u8, msef: [u8; 5]) -> Result<(), String> {
        match &mut self.kind {
            Kind::Sheet(device) => {
                device.emergency(ErrorCode(code), ErrorRegister(register), msef);
                Ok(())
            }
            Kind::Servo(_) => Err("this drive sends an EMCY when it has a fault: fault = 0x4310".to_owned()),
            Kind::Drive(_) => Err("this drive sends an EMCY when it has a fault: fault = \"D\"".to_owned()),
        }
    }

    pub(crate) fn clear_errors(&mut self) -> Result<(), String> {
        match &mut self.kind {
            Kind::Sheet(device) => {
                device.clear_errors();
                Ok(())
            }
            Kind::Servo(_) => Err("the cause of this drive's fault goes with: fault = none".to_owned()),
            Kind::Drive(_) => Err("the causes of this drive's faults go with: clear = \"all\"".to_owned()),
        }
    }

    pub(crate) fn set_power(&mut self, now: Instant, power: Power) {
        match (&mut self.kind, power) {
            (Kind::Sheet(device), Power::On) => device.set_power(now, true),
            (Kind::Sheet(device), Power::Off) => device.set_power(now, false),
            (Kind::Sheet(device), Power::Cycle) => {
                device.set_power(now, false);
                device.set_power(now, true);
            }
            (Kind::Servo(servo), Power::On) => servo.set_power(now, true),
            (Kind::Servo(servo), Power::Off) => servo.set_power(now, false),
            (Kind::Servo(servo), Power::Cycle) => {
                servo.set_power(now, false);
                servo.set_power(now, true);
            }
            (Kind::Drive(drive), Power::On) => drive.drive_mut().switch_on(now),
            (Kind::Drive(drive), Power::Off) => drive.drive_mut().switch_off(now),
            (Kind::Drive(drive), Power::Cycle) => drive.drive_mut().power_cycle(now),
        }
    }

    /// Sets an input of the drive, in the syntax of its scripts.
    pub(crate) fn input(&mut self, now: Instant, line: &str) -> Result<(), String> {
        match &mut self.kind {
            Kind::Drive(serial) => {
                let drive = serial.drive_mut();
                changes(drive.model(), line)?.into_iter().for_each(|change| drive.apply(now, change));
            }
            Kind::Servo(servo) => {
                changes(servo.model(), line)?.iter().for_each(|change| servo.apply(now, change));
            }
            Kind::Sheet(device) => {
                let model = device.model().ok_or("this device has no inputs but its objects: set OBJECT VALUE")?;
                changes(model, line)?.iter().for_each(|change| device.apply(now, change));
            }
        }
        Ok(())
    }

    /// Takes bytes of its serial interface, and returns what it answers.
    pub(crate) fn serial(&mut self, now: Instant, bytes: &[u8]) -> Vec<u8> {
        let Kind::Drive(serial) = &mut self.kind else { return Vec::new() };
        if serial.poll_timeout().is_some_and(|deadline| deadline <= now) {
            serial.handle_timeout(now);
        }
        serial.handle_bytes(now, bytes);
        std::iter::from_fn(|| serial.poll_transmit()).flat_map(|telegram| telegram.as_bytes().to_vec()).collect()
    }

    /// What of its dictionary the device cannot serve; reported once.
    pub(crate) fn take_misconfigured(&mut self) -> Vec<Misconfigured> {
        match &mut self.kind {
            Kind::Sheet(device) => device.take_misconfigured(),
            Kind::Drive(_) | Kind::Servo(_) => Vec::new(),
        }
    }

    /// Why the stored parameters could not be written to their file.
    pub(crate) fn trouble(&mut self) -> Option<String> {
        match &mut self.kind {
            Kind::Sheet(device) => device.trouble(),
            Kind::Drive(serial) => serial.drive().eeprom_trouble(),
            Kind::Servo(servo) => servo.eeprom_trouble(),
        }
        .map(|error| format!("cannot write what the device stores: {error}"))
    }

    fn as_node(&self) -> &dyn Node {
        match &self.kind {
            Kind::Sheet(device) => &**device,
            Kind::Drive(serial) => serial.drive(),
            Kind::Servo(servo) => &**servo,
        }
    }

    fn as_node_mut(&mut self) -> &mut dyn Node {
        match &mut self.kind {
            Kind::Sheet(device) => &mut **device,
            Kind::Drive(serial) => serial.drive_mut(),
            Kind::Servo(servo) => &mut **servo,
        }
    }
}

/// State and motion of an axis.
fn axis(servo: &Servo, now: Instant) -> String {
    let shaft = servo.shaft(now);
    format!(", {}, shaft at {:.0}, {:.0}/s", servo.state(), shaft.position, shaft.velocity)
}

/// The changes that a line makes in the syntax of scripts; the quotes around one word may be missing.
fn changes<C: FromToml + Clone>(model: &C::Model, line: &str) -> Result<Vec<C>, String> {
    let (key, value) = line.split_once('=').unwrap_or((line, ""));
    let value = value.trim();
    let is_word = value.starts_with(char::is_alphabetic) && value.chars().all(char::is_alphanumeric);
    let is_bare = is_word && !["true", "false", "inf", "nan"].contains(&value);
    let value = if is_bare { format!("{value:?}") } else { value.to_owned() };
    let script = Script::from_toml(model, &format!("[[step]]\n{key} = {value}\n"));
    let script = script.map_err(|error| format!("{}; {}", error.problem, error.remedy))?;
    Ok(script.steps().iter().flat_map(|step| step.changes.clone()).collect())
}

fn write_entry(od: &mut dyn ObjectDictionary, address: Address, data: &[u8]) -> Result<(), AbortCode> {
    let entry = od.entry(address)?;
    od.write(&entry, 0, data, true)
}

impl Node for Simulated {
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
}
