//! `sim:DEVICE?node=5`: a bus inside the process with one device on it.

use lexican_runtime::NodeId;
use lexican_runtime::host::{Link, Pace, VirtualBus};
use siko_ag03_1::sim::MODEL;
use siko_ag03_1::sim::SimulatedDrive;

use super::node_id;
use super::virtual_device::VirtualDevice;
use crate::device::Loaded;
use crate::output::Failure;

/// The node-ID of a simulation that tells none.
const NODE: NodeId = NodeId::literal(1);
const BIT_RATE_KBIT: u32 = 500;

/// Opens a simulation by the parameters of its URL: the bus, and the node that is on it.
pub(super) fn open(
    device: &str,
    parameters: &[(String, String)],
    mut pace: Pace,
) -> Result<(Box<dyn Link + Send>, NodeId, Loaded), Failure> {
    let mut node = NODE;
    for (key, value) in parameters {
        match (key.as_str(), value.as_str()) {
            ("node", id) => node = node_id(id).map_err(Failure::new)?,
            ("pace", "real") => pace = Pace::RealTime,
            ("pace", "virtual") => pace = Pace::Virtual,
            ("pace", other) => return Err(Failure::new(format_args!("pace={other} is not real or virtual"))),
            _ => return Err(Failure::new(format_args!("a simulation has no parameter {key:?}; there is node, pace"))),
        }
    }
    let loaded = Loaded::named(device)?;
    let bus = VirtualBus::with_bit_rate(BIT_RATE_KBIT);
    if has_simulator(device) {
        bus.attach(SimulatedDrive::new(&MODEL, node));
    } else {
        bus.attach(VirtualDevice::power_on(bus.now(), node, &loaded.device));
    }
    let link = bus.link();
    bus.set_pace(pace);
    Ok((Box::new(link), node, loaded))
}

/// Whether there is a simulator that knows more of a device than its data sheet does.
pub(crate) fn has_simulator(name: &str) -> bool {
    !std::path::Path::new(name).is_file() && lexican_eds::library::find(name).is_some_and(|it| it.id == "siko/ag03-1")
}
