//! A plant: simulated devices on one bus, their settings, and the faults between them.

mod error;

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use lexican_eds::{Input, Source};
use lexican_machine::{Fault, Files, Machine, Node as MachineNode, Simulated};
use lexican_runtime::host::schemes::{anything, elsewhere};
use lexican_runtime::host::url::{PACE, Parameter, Scheme, Takes};
use lexican_runtime::host::{Node, Pace, VirtualBus, VirtualLink};
use lexican_runtime::{Instant, NodeId};
use lexican_toolbox::data_sheet::DataSheet;
use lexican_toolbox::values::DeviceValues;
use lexican_toolbox::values::report::ValueReport;
use simulator::script::ScriptError;

use super::command::Power;
use super::device::SimulatedDevice;
use super::segment::Segment;

pub use error::PlantError;

/// The bit rate of a simulated bus, unless its machine states another one.
const BIT_RATE_KBIT: u32 = 500;

/// The URL of a bus with simulated devices inside a program.
pub const SCHEME: Scheme = Scheme {
    name: "sim",
    example: "sim:siko/ag03-1?node=5",
    what: "a simulated device, or those of a machine (`sim:machine.toml`), for as long as the command runs",
    parameters: &[Parameter { key: "node", what: "the node-ID of the device, 1 by default", takes: Takes::Text }, PACE],
    check: anything,
    open: elsewhere,
};

/// Whether `name` is the file of a machine, perhaps with one of its buses: `machine.toml#left`.
#[must_use]
pub fn is_machine(name: &str) -> bool {
    Machine::file_and_bus(Path::new(name)).0.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml"))
}

/// Simulated devices on one bus.
#[derive(Debug)]
pub struct Plant {
    /// In kbit/s.
    pub bit_rate_kbit: u32,
    /// At least one.
    pub devices: Vec<PlantDevice>,
    /// The faults that happen between them.
    pub faults: Vec<Fault>,
}

/// A device before it is switched on.
#[derive(Debug)]
pub struct PlantDevice {
    /// `None` for a device that gets its node-ID by LSS.
    pub node: Option<NodeId>,
    /// Its name in the machine.
    pub name: Option<String>,
    /// The name of its data sheet: a path, or a device of the library.
    pub device: String,
    /// Its data sheet, with overlays.
    pub sheet: Arc<DataSheet>,
    /// The file for stored parameters.
    pub eeprom: Option<PathBuf>,
    /// The script of what happens to it: a file with its text.
    pub script: Option<Source>,
    stated: Option<Stated>,
}

/// What a machine's file says about a device.
#[derive(Debug)]
struct Stated {
    input: Arc<Input>,
    /// Where the file names it.
    place: Range<usize>,
    simulated: Simulated,
}

impl Plant {
    /// A plant of one device.
    #[must_use]
    pub fn of(device: PlantDevice) -> Self {
        Plant { bit_rate_kbit: BIT_RATE_KBIT, devices: vec![device], faults: Vec::new() }
    }

    /// Parses the devices of a machine. Errors call the text `name`.
    pub fn parse(text: &str, name: &str, files: Files<'_>) -> Result<Self, PlantError> {
        Plant::of_machine(&Machine::parse(Source::new(name, text), files))
    }

    /// The devices of a machine as they are before it boots.
    pub fn of_machine(machine: &Machine) -> Result<Self, PlantError> {
        if machine.findings.has_errors() {
            return Err(PlantError::of(machine.findings.iter(), &machine.input));
        }
        let input = Arc::new(machine.input.clone());
        let devices = machine.nodes.iter().map(|node| PlantDevice::of(node, &input)).collect::<Result<_, _>>()?;
        let bit_rate_kbit = machine.bus.bit_rate.map_or(BIT_RATE_KBIT, |rate| rate / 1000);
        Ok(Plant { bit_rate_kbit, devices, faults: machine.faults.clone() })
    }

    /// The devices behind one link, switched on at `now`.
    pub fn segment(&self, now: Instant) -> Result<Segment<SimulatedDevice>, PlantError> {
        let devices = self.devices.iter().map(|device| device.simulate(now)).collect::<Result<Vec<_>, _>>()?;
        Ok(self.wire(devices))
    }

    /// The devices, switched on, on a new bus. The program can change them meanwhile.
    #[expect(clippy::type_complexity, reason = "a bus, and what it shares with the program")]
    pub fn on_own_bus(&self, pace: Pace) -> Result<(VirtualBus, Arc<Mutex<Segment<SimulatedDevice>>>), PlantError> {
        let bus = VirtualBus::with_bit_rate(self.bit_rate_kbit);
        let devices = Arc::new(Mutex::new(self.segment(bus.now())?));
        bus.attach(Arc::clone(&devices));
        bus.set_pace(pace);
        Ok((bus, devices))
    }

    /// A link to the devices, switched on, on a new bus.
    pub fn link(&self, pace: Pace) -> Result<VirtualLink, PlantError> {
        let bus = VirtualBus::with_bit_rate(self.bit_rate_kbit);
        bus.set_pace(pace);
        self.attach(&bus)?;
        Ok(bus.link())
    }

    /// Switches the devices on, and attaches them to a bus: each by itself, or all as one [`Segment`] if there are
    /// faults.
    pub fn attach(&self, bus: &VirtualBus) -> Result<(), PlantError> {
        if !self.faults.is_empty() {
            bus.attach(self.segment(bus.now())?);
            return Ok(());
        }
        for device in &self.devices {
            bus.attach(device.simulate(bus.now())?);
        }
        Ok(())
    }

    /// Puts nodes for its devices, in the same order, behind one link with its faults.
    #[must_use]
    pub fn wire<N: Node>(&self, nodes: Vec<N>) -> Segment<N> {
        Segment::new(nodes, &self.faults)
    }
}

impl PlantDevice {
    /// A device with the defaults of its data sheet, whose name is `device`.
    #[must_use]
    pub fn new(node: Option<NodeId>, device: &str, sheet: impl Into<Arc<DataSheet>>) -> Self {
        let (name, device, sheet) = (None, device.to_owned(), sheet.into());
        PlantDevice { node, name, device, sheet, eeprom: None, script: None, stated: None }
    }

    fn of(node: &MachineNode, input: &Arc<Input>) -> Result<Self, PlantError> {
        let (place, simulated) = (node.name.span.clone(), node.simulated.clone());
        let (Some(device), Some(sheet)) = (&node.sheet_name, &node.sheet) else {
            let what = format!("{} has no data sheet, by which it could be simulated", node.name.value);
            let help = "sheet = \"FILE.eds\", or a device that `lexican devices` lists".to_owned();
            return Err(PlantError::at(input, &place, what, Some(help)));
        };
        Ok(PlantDevice {
            name: Some(node.name.value.clone()),
            eeprom: simulated.eeprom.clone(),
            script: simulated.script.clone(),
            stated: Some(Stated { input: Arc::clone(input), place, simulated }),
            // A device that gets its node-ID by LSS begins without one.
            ..PlantDevice::new(node.id.filter(|_| node.lss.is_none()), device, Arc::clone(sheet))
        })
    }

    /// The device, switched on at `now`, with the settings of its machine.
    pub fn simulate(&self, now: Instant) -> Result<SimulatedDevice, PlantError> {
        let device = SimulatedDevice::new(now, &self.sheet, self.node, self.eeprom.as_deref());
        let mut device = device.map_err(|error| match &self.stated {
            Some(stated) => PlantError::at(&stated.input, &stated.place, error, None),
            None => PlantError::Device(error),
        })?;
        device = device.named(self.name.clone());
        if let Some(stated) = &self.stated {
            stated.set(now, &mut device)?;
        }
        if let Some(script) = &self.script {
            let wrong = |ScriptError { line, problem, remedy }| {
                let start = script.text().split_inclusive('\n').take(line - 1).map(str::len).sum();
                PlantError::at(&Input::new(script.clone()), &(start..start), problem, Some(remedy))
            };
            device.follow(now, script.text()).map_err(wrong)?;
        }
        if self.stated.as_ref().is_some_and(|stated| stated.simulated.is_off) {
            device.set_power(now, Power::Off);
        }
        Ok(device)
    }
}

impl Stated {
    /// Applies settings, inputs and steps to a device.
    fn set(&self, now: Instant, device: &mut SimulatedDevice) -> Result<(), PlantError> {
        let Stated { input, simulated: Simulated { settings, inputs, steps, .. }, .. } = self;
        for setting in settings {
            device.let_boot(now);
            device.set_value(now, setting.address, &setting.data).map_err(|code| {
                let values = DeviceValues::new(device.sheet());
                let setting = ValueReport::of_bytes(Some(&values), setting.address, &setting.data).equation();
                PlantError::at(input, &self.place, format!("the device refuses {setting}: {code}"), None)
            })?;
        }
        for line in inputs {
            device.input(now, line).map_err(|error| PlantError::at(input, &line.span, error, None))?;
        }
        if steps.is_empty() {
            return Ok(());
        }
        let script: String = steps.iter().map(|step| format!("[[step]]\n{}", step.value)).collect();
        device.follow(now, &script).map_err(|error| {
            let begun = script.lines().take(error.line).filter(|line| *line == "[[step]]").count();
            PlantError::at(input, &steps[begun.saturating_sub(1)].span, error.problem, Some(error.remedy))
        })
    }
}
