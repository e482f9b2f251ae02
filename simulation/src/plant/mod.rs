//! A plant: simulated devices on one bus, what each of them is set to, and what goes wrong between them.

mod error;
mod file;

use std::path::{Path, PathBuf};

use lexican_runtime::host::Node;
use lexican_runtime::{Instant, NodeId};
use lexican_toolbox::data_sheet::DataSheet;
use lexican_toolbox::values::DeviceValues;
use lexican_toolbox::values::lookup::resolve;

use super::command::Power;
use super::device::SimulatedDevice;
use super::segment::{Fault, Segment};

pub use error::{Place, PlantError, Problem};
pub use file::Files;

/// The bit rate of a simulated bus, unless its file has another one.
const BIT_RATE_KBIT: u32 = 500;

/// Whether the name of a device is that of a plant's file.
#[must_use]
pub fn is_plant(name: &str) -> bool {
    Path::new(name).extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml"))
}

/// Simulated devices on one bus.
#[derive(Debug)]
pub struct Plant {
    /// In kbit/s.
    pub bit_rate_kbit: u32,
    /// At least one.
    pub devices: Vec<PlantDevice>,
    /// What goes wrong between them.
    pub faults: Vec<Fault>,
}

/// A device before it is switched on.
#[derive(Debug)]
pub struct PlantDevice {
    /// `None` for a device that gets its node-ID by LSS.
    pub node: Option<NodeId>,
    /// What its file calls it.
    pub name: Option<String>,
    /// The name of its data sheet: a path, or a device of the library.
    pub device: String,
    /// Its data sheet, with overlays.
    pub sheet: DataSheet,
    /// The file for stored parameters.
    pub eeprom: Option<PathBuf>,
    /// What happens to it by itself.
    pub script: Option<ScriptText>,
    /// Its place in the plant's file.
    place: Option<Place>,
    /// `6060 = profile velocity`.
    settings: Vec<Line>,
    /// `blocked = true`.
    inputs: Vec<Line>,
    is_off: bool,
}

/// A script as it was read.
#[derive(Debug)]
pub struct ScriptText {
    file: String,
    text: String,
    /// The lines in the file at which the steps begin, if the file has more than the script.
    steps: Option<Vec<usize>>,
}

/// A line of a file about a device.
#[derive(Debug)]
struct Line {
    place: Place,
    text: String,
}

impl Line {
    fn wrong(&self, problem: Problem) -> PlantError {
        PlantError { place: Some(self.place.clone()), problem: problem.into() }
    }
}

impl ScriptText {
    /// The text of a file that has nothing else in it. Errors name the file.
    #[must_use]
    pub fn new(file: String, text: String) -> Self {
        ScriptText { file, text, steps: None }
    }

    /// The line of the file for a line of the text: that of the step that it belongs to, in a file that has more.
    fn line(&self, line: usize) -> usize {
        let Some(steps) = &self.steps else { return line };
        let begun = self.text.lines().take(line).filter(|text| *text == "[[step]]").count();
        steps.get(begun.saturating_sub(1)).copied().unwrap_or(line)
    }
}

impl Plant {
    /// A plant of one device.
    #[must_use]
    pub fn of(device: PlantDevice) -> Self {
        Plant { bit_rate_kbit: BIT_RATE_KBIT, devices: vec![device], faults: Vec::new() }
    }

    /// The devices, which are switched on at `now`, behind one link.
    pub fn segment(&self, now: Instant) -> Result<Segment<SimulatedDevice>, PlantError> {
        let devices = self.devices.iter().map(|device| device.simulate(now)).collect::<Result<Vec<_>, _>>()?;
        Ok(self.wire(devices))
    }

    /// Nodes for its devices, in their order, behind one link.
    #[must_use]
    pub fn wire<N: Node>(&self, nodes: Vec<N>) -> Segment<N> {
        Segment::new(nodes, &self.faults)
    }
}

impl PlantDevice {
    /// A device with the values of its data sheet, of the name `device`.
    #[must_use]
    pub fn new(node: Option<NodeId>, device: &str, sheet: DataSheet) -> Self {
        PlantDevice {
            node,
            name: None,
            device: device.to_owned(),
            sheet,
            eeprom: None,
            script: None,
            place: None,
            settings: Vec::new(),
            inputs: Vec::new(),
            is_off: false,
        }
    }

    /// The device, which is switched on at `now`, and set to what its file says.
    pub fn simulate(&self, now: Instant) -> Result<SimulatedDevice, PlantError> {
        let device = SimulatedDevice::new(now, &self.sheet, self.node, self.eeprom.as_deref());
        let wrong = |error| PlantError { place: self.place.clone(), problem: Problem::Device(error).into() };
        let mut device = device.map_err(wrong)?.named(self.name.clone());
        for setting in &self.settings {
            device.let_boot(now);
            self.set(now, &mut device, setting)?;
        }
        for input in &self.inputs {
            device.input(now, &input.text).map_err(|error| input.wrong(Problem::Input(error)))?;
        }
        if let Some(script) = &self.script {
            device.follow(now, &script.text).map_err(|error| {
                let place = Place { file: script.file.clone(), line: Some(script.line(error.line)), who: None };
                PlantError { place: Some(place), problem: Problem::Step(error).into() }
            })?;
        }
        if self.is_off {
            device.set_power(now, Power::Off);
        }
        Ok(device)
    }

    fn set(&self, now: Instant, device: &mut SimulatedDevice, setting: &Line) -> Result<(), PlantError> {
        let sheet = &self.sheet.device;
        let (object, value) =
            setting.text.split_once('=').ok_or_else(|| setting.wrong(Problem::NoSetting(setting.text.clone())))?;
        let address = resolve(Some(sheet), object.trim()).map_err(|error| setting.wrong(Problem::Object(error)))?;
        let data = DeviceValues::new(sheet).encode(address, value.trim());
        let data = data.map_err(|error| setting.wrong(Problem::Value(error)))?;
        device
            .set_value(now, address, &data)
            .map_err(|code| setting.wrong(Problem::Refused { setting: setting.text.clone(), address, code }))
    }
}
