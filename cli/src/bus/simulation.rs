//! `sim:DEVICE?node=5`, `sim:plant.toml`: a bus inside the process with simulated devices on it.

use std::path::Path;
use std::sync::{Arc, Mutex};

use lexican_runtime::NodeId;
use lexican_runtime::host::{Link, Pace, VirtualBus};
use lexican_simulation::plant::is_plant;
use lexican_simulation::{Plant, PlantDevice, Segment, SimulatedDevice};
use lexican_toolbox::data_sheet::DataSheet;
use lexican_toolbox::text::node_id::node_id;

use crate::device::{load, warn_of_errors};
use crate::output::Failure;

/// The node-ID of a simulation whose URL names none.
const NODE: NodeId = NodeId::literal(1);

/// Simulated devices, and their bus.
pub(crate) struct Simulation {
    pub(crate) bus: VirtualBus,
    /// In bits per second.
    pub(crate) bit_rate: u32,
    /// Not to be held while the bus is asked for something.
    pub(crate) devices: Arc<Mutex<Segment<SimulatedDevice>>>,
}

/// A bus, the nodes that are on it, and how they are reached otherwise.
type Opened = (Box<dyn Link + Send>, Vec<(NodeId, DataSheet)>, Simulation);

/// Opens a simulation by the parameters of its URL: the bus, and its nodes.
pub(super) fn open(device: &str, parameters: &[(String, String)], mut pace: Pace) -> Result<Opened, Failure> {
    let mut node = None;
    for (key, value) in parameters {
        match (key.as_str(), value.as_str()) {
            ("node", id) => node = Some(node_id(id).map_err(Failure::new)?),
            ("pace", "real") => pace = Pace::RealTime,
            ("pace", "virtual") => pace = Pace::Virtual,
            ("pace", other) => return Err(Failure::new(format_args!("pace={other} is not real or virtual"))),
            _ => return Err(Failure::new(format_args!("a simulation has no parameter {key:?}; there is node, pace"))),
        }
    }
    let plant = match (is_plant(device), node) {
        (true, None) => read_plant(device.as_ref())?,
        (true, Some(_)) => {
            return Err(
                Failure::new("a plant says itself which node-IDs its devices have").help(format!("sim:{device}"))
            );
        }
        (false, node) => Plant::of(PlantDevice::new(Some(node.unwrap_or(NODE)), device, load(device, &[])?)),
    };
    simulate(plant, pace)
}

/// Switches a plant on.
pub(super) fn simulate(plant: Plant, pace: Pace) -> Result<Opened, Failure> {
    let bus = VirtualBus::with_bit_rate(plant.bit_rate_kbit);
    let devices = Arc::new(Mutex::new(plant.segment(bus.now())?));
    bus.attach(Arc::clone(&devices));
    let link = Box::new(bus.link());
    bus.set_pace(pace);
    let nodes = plant.devices.into_iter().filter_map(|device| Some((device.node?, device.sheet))).collect();
    Ok((link, nodes, Simulation { bus, bit_rate: plant.bit_rate_kbit * 1000, devices }))
}

/// Reads a plant; warns about the errors of its data sheets.
pub(crate) fn read_plant(path: &Path) -> Result<Plant, Failure> {
    let plant = Plant::read(path)?;
    plant.devices.iter().for_each(|device| warn_of_errors(&device.sheet));
    Ok(plant)
}
