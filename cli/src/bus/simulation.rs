//! `sim:DEVICE?node=5`: a bus inside the process with one device on it.

use lexican_runtime::NodeId;
use lexican_runtime::host::{Link, Pace, VirtualBus};
use siko_ag03_1::sim::{Model, SimulatedDrive};
use simulator::SimulatedServo;
use simulator::servo::ServoModel;

use super::node_id;
use super::virtual_device::VirtualDevice;
use crate::device::Loaded;
use crate::output::Failure;

/// The node-ID of a simulation whose URL names none.
const NODE: NodeId = NodeId::literal(1);
const BIT_RATE_KBIT: u32 = 500;

/// A simulator that knows more than a data sheet says.
#[derive(Clone, Copy)]
pub(crate) enum Simulator {
    /// A positioning drive of SIKO.
    Siko(&'static Model),
    /// A servo with a model of its own.
    Servo(&'static ServoModel),
}

/// The devices of the library that have a simulator of their own.
pub(crate) const SIMULATORS: &[(&str, Simulator)] = &[
    ("kollmorgen/akd", Simulator::Servo(&kollmorgen_akd::sim::MODEL)),
    ("siko/ag02", Simulator::Siko(&siko_ag02::sim::MODEL)),
    ("siko/ag03-1", Simulator::Siko(&siko_ag03_1::sim::MODEL)),
];

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
    match simulator(device) {
        Some(Simulator::Siko(model)) => bus.attach(SimulatedDrive::new(model, node)),
        Some(Simulator::Servo(model)) => bus.attach(SimulatedServo::new(bus.now(), model, node)),
        None => bus.attach(VirtualDevice::power_on(bus.now(), node, &loaded.device)),
    }
    let link = bus.link();
    bus.set_pace(pace);
    Ok((Box::new(link), node, loaded))
}

/// The simulator of a device of the library; none for a file.
pub(crate) fn simulator(name: &str) -> Option<Simulator> {
    let shipped = lexican_eds::library::find(name).filter(|_| !std::path::Path::new(name).is_file())?;
    SIMULATORS.iter().find(|(id, _)| *id == shipped.id).map(|(_, simulator)| *simulator)
}
