//! A plant: simulated devices on one bus, what each of them is set to, and what goes wrong between them.

mod file;
mod segment;

use std::fmt::Display;
use std::path::{Path, PathBuf};

use lexican_runtime::{Instant, NodeId};
use lexican_toolbox::object::resolve;
use lexican_toolbox::values::DeviceValues;

use super::simulated::{Power, Simulated};
use crate::device::Loaded;
use crate::output::Failure;
pub(crate) use segment::Segment;

use segment::Fault;

/// The bit rate of a simulated bus, unless its file has another one.
const BIT_RATE_KBIT: u32 = 500;

/// Whether the name of a device is that of a plant's file.
pub(crate) fn is_plant(name: &str) -> bool {
    Path::new(name).extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml"))
}

pub(crate) struct Plant {
    pub(crate) bit_rate_kbit: u32,
    /// At least one.
    pub(crate) devices: Vec<PlantDevice>,
    faults: Vec<Fault>,
}

/// A device before it is switched on.
pub(crate) struct PlantDevice {
    /// None for a device that gets its node-ID by LSS.
    pub(crate) node: Option<NodeId>,
    /// What its file calls it.
    pub(crate) name: Option<String>,
    /// The name of its data sheet.
    pub(crate) device: String,
    pub(crate) loaded: Loaded,
    /// The file for stored parameters.
    pub(crate) eeprom: Option<PathBuf>,
    pub(crate) script: Option<ScriptText>,
    /// `6060 = profile velocity`.
    settings: Vec<Line>,
    /// `blocked = true`.
    inputs: Vec<Line>,
    is_off: bool,
}

/// A script as it was read.
pub(crate) struct ScriptText {
    /// The file that errors name.
    pub(crate) file: String,
    pub(crate) text: String,
    /// The lines in the file at which the steps begin, if the file has more than the script.
    pub(crate) steps: Option<Vec<usize>>,
}

/// A line of a file about a device.
struct Line {
    /// `plant.toml:7: node 5`.
    place: String,
    text: String,
}

impl Line {
    fn wrong(&self, reason: impl Display) -> Failure {
        Failure::new(format_args!("{}: {reason}", self.place))
    }
}

impl ScriptText {
    /// The line of the file for a line of the text: that of the step that it belongs to, in a file that has more.
    fn line(&self, line: usize) -> usize {
        let Some(steps) = &self.steps else { return line };
        let begun = self.text.lines().take(line).filter(|text| *text == "[[step]]").count();
        steps.get(begun.saturating_sub(1)).copied().unwrap_or(line)
    }
}

impl Plant {
    /// A plant of one device.
    pub(crate) fn of(device: PlantDevice) -> Self {
        Plant { bit_rate_kbit: BIT_RATE_KBIT, devices: vec![device], faults: Vec::new() }
    }

    /// The devices, which are switched on at `now`, behind one link.
    pub(crate) fn segment(&self, now: Instant) -> Result<Segment<Simulated>, Failure> {
        let devices = self.devices.iter().map(|device| device.simulate(now)).collect::<Result<Vec<_>, _>>()?;
        Ok(self.wire(devices))
    }

    /// Nodes for its devices, in their order, behind one link.
    pub(crate) fn wire<N: lexican_runtime::host::Node>(&self, nodes: Vec<N>) -> Segment<N> {
        Segment::new(nodes, &self.faults)
    }
}

impl PlantDevice {
    /// A device with the values of its data sheet.
    pub(crate) fn new(node: Option<NodeId>, device: &str, loaded: Loaded) -> Self {
        PlantDevice {
            node,
            name: None,
            device: device.to_owned(),
            loaded,
            eeprom: None,
            script: None,
            settings: Vec::new(),
            inputs: Vec::new(),
            is_off: false,
        }
    }

    /// The device, which is switched on at `now`, and set to what its file says.
    pub(crate) fn simulate(&self, now: Instant) -> Result<Simulated, Failure> {
        let eeprom = self.eeprom.as_deref();
        let mut device = Simulated::new(now, &self.device, self.node, &self.loaded, eeprom)?;
        let sheet = &self.loaded.device;
        for setting in &self.settings {
            let (object, value) = setting
                .text
                .split_once('=')
                .ok_or_else(|| setting.wrong(format_args!("{:?} is no OBJECT = VALUE", setting.text)))?;
            let address = resolve(Some(sheet), object.trim()).map_err(|error| {
                let failure = setting.wrong(&error);
                failure.help(error.advice())
            })?;
            let data = DeviceValues::new(sheet).encode(address, value.trim()).map_err(|error| setting.wrong(error))?;
            device
                .configure(now, sheet, address, &data)
                .map_err(|code| setting.wrong(format_args!("{:?}: {address}: {code}", setting.text)))?;
        }
        for input in &self.inputs {
            device.input(now, &input.text).map_err(|error| input.wrong(error))?;
        }
        if let Some(script) = &self.script {
            device.follow(now, &script.text).map_err(|error| {
                let line = script.line(error.line);
                Failure::new(format_args!("{}:{line}: {}", script.file, error.problem)).help(error.remedy)
            })?;
        }
        if self.is_off {
            device.set_power(now, Power::Off);
        }
        Ok(device)
    }
}
