//! Simulated devices inside the process.

use std::sync::{Arc, Mutex};

use lexican_machine::{BoxedLink, Machine};
use lexican_runtime::host::{Fate, Pace, VirtualBus};
use lexican_runtime::{Frame, NodeId};
use lexican_simulation::{Plant, Segment, SimulatedDevice, command};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::error::{MachineFileError, wrong};
use crate::wait::lock;

/// The fates of nodes' frames while faults last.
type Faults = Arc<Mutex<Vec<(NodeId, Fate)>>>;

/// Whether a node has sent a frame, by the predefined connection set.
fn is_of(frame: &Frame, node: NodeId) -> bool {
    let id = frame.id().raw();
    let sent = [0x080, 0x180, 0x280, 0x380, 0x480, 0x580, 0x700];
    !frame.id().is_extended() && id & 0x7F == u32::from(node.get()) && sent.contains(&(id & 0x780))
}

/// The simulated devices of a bus, and their faults.
pub(crate) struct Simulation {
    pub(crate) bus: VirtualBus,
    devices: Arc<Mutex<Segment<SimulatedDevice>>>,
    pub(crate) faults: Faults,
}

impl Simulation {
    /// Switches on the devices of a machine; returns a link and the simulation for each of its buses.
    pub(crate) fn of(machine: &Machine, pace: Pace) -> PyResult<(Vec<BoxedLink>, Vec<Simulation>)> {
        let start = |machine: &Machine| {
            let plant = Plant::of_machine(machine)?;
            let (bus, devices) = plant.on_own_bus(pace)?;
            let faults = Faults::default();
            let lasting = Arc::clone(&faults);
            bus.set_fate(move |_, frame| {
                let faults = lock(&lasting);
                faults.iter().rev().find(|(node, _)| is_of(frame, *node)).map_or(Fate::Deliver, |(_, fate)| *fate)
            });
            Ok((Box::new(bus.link()) as BoxedLink, Simulation { bus, devices, faults }))
        };
        let started = machine.buses().map(start).collect::<Result<Vec<_>, lexican_simulation::PlantError>>();
        Ok(started.map_err(|error| MachineFileError::new_err(error.to_string()))?.into_iter().unzip())
    }

    /// Whether this device is simulated here.
    pub(crate) fn has(&self, node: &str) -> bool {
        lock(&self.devices).nodes().any(|device| device.is_called(node))
    }

    /// Gives a device a command, and returns its answer.
    pub(crate) fn carry_out(&self, node: &str, line: &str) -> PyResult<String> {
        let command = command::parse(line).map_err(wrong)?;
        let command = command.ok_or_else(|| PyValueError::new_err("the line is empty"))?;
        let now = self.bus.now();
        let mut devices = lock(&self.devices);
        let device = devices.nodes_mut().find(|device| device.is_called(node));
        device.expect("it is one of these").carry_out(now, &command).map_err(wrong)
    }
}

/// Parses the pace of simulated time: "virtual" or "real".
pub(crate) fn pace(word: &str) -> PyResult<Pace> {
    match word {
        "virtual" => Ok(Pace::Virtual),
        "real" => Ok(Pace::RealTime),
        _ => Err(PyValueError::new_err(format!("there is no pace {word:?}: \"virtual\" or \"real\""))),
    }
}
