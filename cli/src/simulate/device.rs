//! The simulated device: made of its data sheet, or a drive that moves.

use std::path::Path;
use std::sync::Arc;

use lexican_runtime::device::Misconfigured;
use lexican_runtime::host::Node;
use lexican_runtime::object::{Address, ObjectDictionary};
use lexican_runtime::wire::emcy::{ErrorCode, ErrorRegister};
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{AbortCode, CobId, Frame, Instant, NodeId};
use siko_ag03_1::sim::{Model, Setup, SimulatedDrive};
use siko_serial::sim::SerialDrive;
use simulator::script::{FromToml, Script};
use simulator::servo::{Servo, ServoModel};
use simulator::{Memory, SimulatedServo};

use super::control::Power;
use crate::bus::simulation::SIMULATORS;
use crate::bus::virtual_device::{VirtualDevice, keeps};
use crate::device::{Loaded, read};
use crate::output::Failure;

/// A device that exists only in software.
pub(super) enum Simulated {
    Sheet(Box<VirtualDevice>),
    /// With its serial interface, which nothing is connected to on CAN.
    Drive(Box<SerialDrive>),
    Servo(Box<SimulatedServo>),
}

impl Simulated {
    pub(super) fn sheet(
        now: Instant,
        node: Option<NodeId>,
        loaded: &Loaded,
        eeprom: Option<&Path>,
    ) -> Result<Self, Failure> {
        let memory = match eeprom {
            Some(path) => Memory::open(path, keeps(&loaded.device)).map_err(Failure::new)?,
            None => Memory::default(),
        };
        let sheet = Arc::new(loaded.device.clone());
        Ok(Simulated::Sheet(Box::new(VirtualDevice::with_memory(now, node, sheet, memory))))
    }

    pub(super) fn drive(
        now: Instant,
        model: &'static Model,
        node: NodeId,
        eeprom: Option<&Path>,
    ) -> Result<Self, Failure> {
        let setup = Setup::new(model, node);
        let drive = match eeprom {
            Some(path) => SimulatedDrive::with_eeprom(now, setup, path).map_err(Failure::new)?,
            None => SimulatedDrive::power_on(now, setup),
        };
        Ok(Simulated::Drive(Box::new(SerialDrive::new(drive))))
    }

    pub(super) fn servo(
        now: Instant,
        model: &'static ServoModel,
        node: NodeId,
        eeprom: Option<&Path>,
    ) -> Result<Self, Failure> {
        let servo = match eeprom {
            Some(path) => SimulatedServo::with_eeprom(now, model, node, path).map_err(Failure::new)?,
            None => SimulatedServo::new(now, model, node),
        };
        Ok(Simulated::Servo(Box::new(servo)))
    }

    /// Lets the script of a file happen to the drive.
    pub(super) fn follow(&mut self, now: Instant, path: &Path) -> Result<(), Failure> {
        match self {
            Simulated::Drive(serial) => {
                let drive = serial.drive_mut();
                drive.follow(now, script(drive.model(), path)?);
            }
            Simulated::Servo(servo) => servo.follow(now, script(servo.model(), path)?),
            Simulated::Sheet(device) => match device.model() {
                Some(model) => device.follow_script(now, script(model, path)?),
                None => {
                    let known: Vec<&str> = SIMULATORS.iter().map(|(id, _)| *id).collect();
                    return Err(Failure::new("this device does not follow a script").help(format!(
                        "drives of CiA 402 do, and {}; lines on stdin control any device",
                        known.join(", ")
                    )));
                }
            },
        }
        Ok(())
    }

    /// The node-ID; none while it is off, or has none.
    pub(super) fn node_id(&self) -> Option<NodeId> {
        match self {
            Simulated::Sheet(device) => device.node(),
            Simulated::Drive(serial) => serial.drive().is_on().then(|| serial.drive().node()),
            Simulated::Servo(servo) => servo.is_on().then(|| servo.node()),
        }
    }

    /// The NMT state; none while it is off, or has no node-ID.
    pub(super) fn nmt_state(&self) -> Option<NmtState> {
        match self {
            Simulated::Sheet(device) => device.nmt_state(),
            Simulated::Drive(serial) => serial.drive().is_on().then(|| serial.drive().nmt_state()),
            Simulated::Servo(servo) => servo.is_on().then(|| servo.nmt_state()),
        }
    }

    pub(super) fn state(&self, now: Instant) -> String {
        match self {
            Simulated::Sheet(device) => device.servo().map_or_else(String::new, |servo| axis(servo, now)),
            Simulated::Servo(servo) if servo.is_on() => axis(servo.servo(), now),
            Simulated::Drive(serial) if serial.drive().is_on() => {
                let drive = serial.drive();
                format!(", {}, position {}, {} rev/min", drive.state(), drive.position(now), drive.velocity(now))
            }
            Simulated::Drive(_) | Simulated::Servo(_) => String::new(),
        }
    }

    /// What it simulates, for the user.
    pub(super) fn abilities(&self) -> &'static str {
        match self {
            Simulated::Sheet(device) if device.servo().is_some() => "a CiA 402 drive that moves",
            Simulated::Sheet(device) if device.serves_lss() => "every object of its data sheet, and LSS",
            Simulated::Sheet(_) => "every object of its data sheet",
            Simulated::Drive(_) | Simulated::Servo(_) => "a drive that moves",
        }
    }

    /// The bytes of an entry, as the bus would read them.
    pub(super) fn value(&mut self, now: Instant, address: Address) -> Result<Vec<u8>, AbortCode> {
        match self {
            Simulated::Sheet(device) => device.value(now, address),
            Simulated::Drive(drive) => drive.drive_mut().with_dictionary(now, |od| simulator::read(od, address)),
            Simulated::Servo(servo) => servo.with_servo(now, |_, od| simulator::read(od, address)),
        }
    }

    /// Changes an entry, regardless of its access.
    pub(super) fn set_value(&mut self, now: Instant, address: Address, data: &[u8]) -> Result<(), AbortCode> {
        match self {
            Simulated::Sheet(device) => device.set_value(now, address, data),
            Simulated::Drive(drive) => drive.drive_mut().with_dictionary(now, |od| write_entry(od, address, data)),
            Simulated::Servo(servo) => servo.with_servo(now, |_, od| write_entry(od, address, data)),
        }
    }

    pub(super) fn emergency(&mut self, code: u16, register: u8, msef: [u8; 5]) -> Result<(), String> {
        match self {
            Simulated::Sheet(device) => {
                device.emergency(ErrorCode(code), ErrorRegister(register), msef);
                Ok(())
            }
            Simulated::Servo(_) => Err("this drive sends an EMCY when it has a fault: fault = 0x4310".to_owned()),
            Simulated::Drive(_) => Err("this drive sends an EMCY when it has a fault: fault = \"D\"".to_owned()),
        }
    }

    pub(super) fn clear_errors(&mut self) -> Result<(), String> {
        match self {
            Simulated::Sheet(device) => {
                device.clear_errors();
                Ok(())
            }
            Simulated::Servo(_) => Err("the cause of this drive's fault goes with: fault = none".to_owned()),
            Simulated::Drive(_) => Err("the causes of this drive's faults go with: clear = \"all\"".to_owned()),
        }
    }

    pub(super) fn set_power(&mut self, now: Instant, power: Power) {
        match (self, power) {
            (Simulated::Sheet(device), Power::On) => device.set_power(now, true),
            (Simulated::Sheet(device), Power::Off) => device.set_power(now, false),
            (Simulated::Sheet(device), Power::Cycle) => {
                device.set_power(now, false);
                device.set_power(now, true);
            }
            (Simulated::Servo(servo), Power::On) => servo.set_power(now, true),
            (Simulated::Servo(servo), Power::Off) => servo.set_power(now, false),
            (Simulated::Servo(servo), Power::Cycle) => {
                servo.set_power(now, false);
                servo.set_power(now, true);
            }
            (Simulated::Drive(drive), Power::On) => drive.drive_mut().switch_on(now),
            (Simulated::Drive(drive), Power::Off) => drive.drive_mut().switch_off(now),
            (Simulated::Drive(drive), Power::Cycle) => drive.drive_mut().power_cycle(now),
        }
    }

    /// Sets an input of the drive, in the syntax of its scripts.
    pub(super) fn input(&mut self, now: Instant, line: &str) -> Result<(), String> {
        match self {
            Simulated::Drive(serial) => {
                let drive = serial.drive_mut();
                changes(drive.model(), line)?.into_iter().for_each(|change| drive.apply(now, change));
            }
            Simulated::Servo(servo) => {
                changes(servo.model(), line)?.iter().for_each(|change| servo.apply(now, change));
            }
            Simulated::Sheet(device) => {
                let model = device.model().ok_or("this device has no inputs but its objects: set OBJECT VALUE")?;
                changes(model, line)?.iter().for_each(|change| device.apply(now, change));
            }
        }
        Ok(())
    }

    /// Takes bytes of its serial interface, and returns what it answers.
    pub(super) fn serial(&mut self, now: Instant, bytes: &[u8]) -> Vec<u8> {
        let Simulated::Drive(serial) = self else { return Vec::new() };
        if serial.poll_timeout().is_some_and(|deadline| deadline <= now) {
            serial.handle_timeout(now);
        }
        serial.handle_bytes(now, bytes);
        std::iter::from_fn(|| serial.poll_transmit()).flat_map(|telegram| telegram.as_bytes().to_vec()).collect()
    }

    /// What of its dictionary the device cannot serve; reported once.
    pub(super) fn take_misconfigured(&mut self) -> Vec<Misconfigured> {
        match self {
            Simulated::Sheet(device) => device.take_misconfigured(),
            Simulated::Drive(_) | Simulated::Servo(_) => Vec::new(),
        }
    }

    /// Why the stored parameters could not be written to their file.
    pub(super) fn trouble(&mut self) -> Option<String> {
        match self {
            Simulated::Sheet(device) => device.trouble(),
            Simulated::Drive(serial) => serial.drive().eeprom_trouble(),
            Simulated::Servo(servo) => servo.eeprom_trouble(),
        }
        .map(|error| format!("cannot write what the device stores: {error}"))
    }

    fn as_node(&self) -> &dyn Node {
        match self {
            Simulated::Sheet(device) => &**device,
            Simulated::Drive(serial) => serial.drive(),
            Simulated::Servo(servo) => &**servo,
        }
    }

    fn as_node_mut(&mut self) -> &mut dyn Node {
        match self {
            Simulated::Sheet(device) => &mut **device,
            Simulated::Drive(serial) => serial.drive_mut(),
            Simulated::Servo(servo) => &mut **servo,
        }
    }
}

/// State and motion of an axis.
fn axis(servo: &Servo, now: Instant) -> String {
    let shaft = servo.shaft(now);
    format!(", {}, shaft at {:.0}, {:.0}/s", servo.state(), shaft.position, shaft.velocity)
}

/// Reads the script of a file.
fn script<C: FromToml>(model: &C::Model, path: &Path) -> Result<Script<C>, Failure> {
    let source = read(path)?;
    Script::from_toml(model, source.text()).map_err(|error| {
        Failure::new(format_args!("{}:{}: {}", path.display(), error.line, error.problem)).help(error.remedy)
    })
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
        self.as_node_mut().poll_transmit(now)
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
