//! The simulated bus with the drives of the machine.

use std::str::FromStr;

use clap::ValueEnum;
use lexican_eds::Source;
use lexican_machine::Machine;
use lexican_profibus::bus::Bus;
use lexican_profibus::virtual_bus::VirtualBus as Profibus;
use lexican_runtime::NodeId;
use lexican_runtime::host::{self, Link, VirtualBus};
use lexican_simulation::{Plant, PlantDevice};
use siko_profibus::{bus::attach_unknown, line};
use siko_serial::sim::{SerialDrive, VirtualLine};
use siko_serial::{Settings, gateway};

/// How fast simulated time passes.
#[derive(Clone, Copy, Default, ValueEnum)]
pub(crate) enum Pace {
    /// As fast as the machine can compute it
    #[default]
    Virtual,
    /// As fast as on a real machine, to watch
    Real,
}

/// A simulated fault: which drive, and when.
#[derive(Clone, Copy)]
pub(crate) struct Fault {
    node: NodeId,
    ms: u64,
}

impl FromStr for Fault {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let (node, seconds) = text.split_once('@').ok_or("say which node, and when: 7@2.5")?;
        let node = node.parse().ok().and_then(NodeId::new).ok_or("a node-ID is 1 to 127")?;
        let seconds = seconds.parse::<f64>().ok().filter(|seconds| (0.0..1e6).contains(seconds));
        let ms = (seconds.ok_or("the time is a number of seconds")? * 1e3) as u64;
        Ok(Fault { node, ms })
    }
}

/// A bus with the drives of the machine; with `doors`, those of SIKO use their other interfaces.
pub(crate) fn simulated(
    machine: &Machine,
    pace: Pace,
    fault: Option<Fault>,
    doors: bool,
) -> Result<Box<dyn Link + Send>, String> {
    let mut plant = Plant::of_machine(machine).map_err(|error| error.to_string())?;
    if let Some(Fault { node, ms }) = fault {
        let device = plant.devices.iter_mut().find(|device| device.node == Some(node));
        let device = device.ok_or_else(|| format!("--fault: the machine has no drive at node {node}"))?;
        // The shaft of a SIKO drive is blocked; the motor of an AKD has a following error.
        let what = if device.device.starts_with("siko/") { "shaft = \"blocked\"" } else { "fault = 0x8611" };
        device.script = Some(Source::new("--fault", format!("[[step]]\nat_ms = {ms}\n{what}\n")));
    }
    let can = VirtualBus::with_bit_rate(plant.bit_rate_kbit);
    let profibus = Bus::new(Profibus::new());
    plant.devices.retain(|device| !(doors && behind_its_door(device, &can, &profibus)));
    plant.attach(&can).map_err(|error| error.to_string())?;
    can.set_pace(match pace {
        Pace::Virtual => host::Pace::Virtual,
        Pace::Real => host::Pace::RealTime,
    });
    Ok(Box::new(can.link()))
}

/// Connects a SIKO drive by its serial port or PROFIBUS to a gateway, which is a node of the bus; false for other
/// drives.
fn behind_its_door(
    device: &PlantDevice,
    can: &VirtualBus,
    profibus: &Bus<Profibus<siko_profibus::ProfibusDrive>>,
) -> bool {
    let Some(node) = device.node else { return false };
    match device.device.as_str() {
        "siko/ag02" => {
            drop(can.attach(gateway::node(VirtualLine::new(SerialDrive::default()), Settings::default(), node)));
        }
        // All of them share one segment, on which the node-ID is the address.
        "siko/ag03-1" => {
            let model = &siko_profibus::AG03_1;
            let _ = profibus.with(|segment| attach_unknown(segment, model, node.get()));
            drop(can.attach(line::node(profibus, model, node).expect("the machine's addresses are below 127")));
        }
        _ => return false,
    }
    true
}
