//! A bus inside the process with simulated devices on it.

use std::path::Path;
use std::sync::{Arc, Mutex};

use lexican_runtime::NodeId;
use lexican_runtime::host::schemes::{anything, elsewhere};
use lexican_runtime::host::url::{PACE, Parameter, Scheme, Takes};
use lexican_runtime::host::{BusUrl, Pace, VirtualBus};
use lexican_simulation::plant::is_machine;
use lexican_simulation::{Plant, PlantDevice};
use lexican_toolbox::text::node_id::node_id;

use super::kind::{Bus, Kind, Simulated, Simulation};
use crate::device::{load, warn_of_errors};
use crate::machine::sound_on_bus;
use crate::output::Failure;

/// The node-ID of a simulation whose URL names none.
const NODE: NodeId = NodeId::literal(1);

pub(super) const KIND: Kind = Kind {
    scheme: &Scheme {
        name: "sim",
        example: "sim:siko/ag03-1?node=5",
        what: "a simulated device, or those of a machine (`sim:machine.toml`), for as long as the command runs",
        parameters: &[
            Parameter { key: "node", what: "the node-ID of the device, 1 by default", takes: Takes::Text },
            PACE,
        ],
        check: anything,
        open: elsewhere,
    },
    open,
    simulated: Simulated::Never(
        "a simulated bus is inside the command: no other command could reach the device",
        Some("without --bus the device is on pseudo-terminals, which other commands can use"),
    ),
};

fn open(url: &BusUrl, pace: Pace) -> Result<Bus, Failure> {
    let device = url.place();
    let node = url.get("node").map(node_id).transpose().map_err(Failure::new)?;
    let plant = match (is_machine(device), node) {
        (true, None) => read_plant(device.as_ref())?,
        (true, Some(_)) => {
            return Err(
                Failure::new("a machine says itself which node-IDs its devices have").help(format!("sim:{device}"))
            );
        }
        (false, node) => Plant::of(PlantDevice::new(Some(node.unwrap_or(NODE)), device, load(device, &[])?)),
    };
    simulate(plant, url.pace().unwrap_or(pace))
}

/// Switches a plant on, on a bus of its own.
pub(crate) fn simulate(plant: Plant, pace: Pace) -> Result<Bus, Failure> {
    let bus = VirtualBus::with_bit_rate(plant.bit_rate_kbit);
    let devices = Arc::new(Mutex::new(plant.segment(bus.now())?));
    bus.attach(Arc::clone(&devices));
    let link = Box::new(bus.link());
    bus.set_pace(pace);
    let nodes = plant
        .devices
        .into_iter()
        .filter_map(|device| Some((device.node?, Arc::unwrap_or_clone(device.sheet))))
        .collect();
    let simulation = Simulation { bus, bit_rate: plant.bit_rate_kbit * 1000, devices };
    Ok(Bus { link, nodes, simulation: Some(simulation) })
}

/// Reads a machine to simulate; warns about the errors of its data sheets.
pub(crate) fn read_plant(path: &Path) -> Result<Plant, Failure> {
    let plant = Plant::of_machine(&*sound_on_bus(path)?)?;
    plant.devices.iter().for_each(|device| warn_of_errors(&device.sheet));
    Ok(plant)
}
