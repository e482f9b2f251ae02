//! A bus in this process, with simulated devices.

use std::path::Path;
use std::sync::Arc;

use lexican_runtime::NodeId;
use lexican_runtime::host::{BusUrl, Pace};
use lexican_simulation::plant::{SCHEME, is_machine};
use lexican_simulation::{Plant, PlantDevice};
use lexican_toolbox::text::node_id::node_id;

use super::kind::{Bus, Kind, Simulated, Simulation};
use crate::device::{load, warn_of_errors};
use crate::machine::sound_on_bus;
use crate::output::Failure;

/// The default node-ID of a simulation.
const NODE: NodeId = NodeId::literal(1);

pub(super) const KIND: Kind = Kind {
    scheme: &SCHEME,
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

/// Switches on a plant on a bus of its own.
pub(crate) fn simulate(plant: Plant, pace: Pace) -> Result<Bus, Failure> {
    let (bus, devices) = plant.on_own_bus(pace)?;
    let link = Box::new(bus.link());
    let nodes = plant
        .devices
        .into_iter()
        .filter_map(|device| Some((device.node?, Arc::unwrap_or_clone(device.sheet))))
        .collect();
    let simulation = Simulation { bus, bit_rate: plant.bit_rate_kbit * 1000, devices };
    Ok(Bus { link, nodes, simulation: Some(simulation) })
}

/// Reads a machine to simulate; warns about errors in its data sheets.
pub(crate) fn read_plant(path: &Path) -> Result<Plant, Failure> {
    let plant = Plant::of_machine(&*sound_on_bus(path)?)?;
    plant.devices.iter().for_each(|device| warn_of_errors(&device.sheet));
    Ok(plant)
}
