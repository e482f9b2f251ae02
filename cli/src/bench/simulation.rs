//! The bench's access to simulated devices.

use std::sync::{MutexGuard, PoisonError};

use lexican_bench::engine;
use lexican_bench::view;
use lexican_runtime::NodeId;
use lexican_simulation::{Input, Power, Segment, SimulatedDevice, Takes};

use crate::bus::Simulation;

/// The simulated devices of this process.
pub(super) struct Devices(pub(super) Simulation);

impl Devices {
    /// The name of a device in the plant.
    pub(super) fn name(&self, node: NodeId) -> Option<String> {
        let devices = self.devices();
        devices.nodes().find(|device| device.node() == Some(node))?.name().map(str::to_owned)
    }

    fn devices(&self) -> MutexGuard<'_, Segment<SimulatedDevice>> {
        self.0.devices.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn with<T>(&self, node: NodeId, act: impl FnOnce(&mut SimulatedDevice) -> T) -> Result<T, String> {
        let mut devices = self.devices();
        let device = devices.nodes_mut().find(|device| device.node() == Some(node));
        device.map(act).ok_or_else(|| format!("node {node} is not simulated"))
    }
}

impl engine::Simulation for Devices {
    fn devices(&self) -> Vec<view::Simulated> {
        let shown = |device: &SimulatedDevice| {
            Some(view::Simulated {
                node: device.node()?.get(),
                name: device.name().unwrap_or_default().to_owned(),
                is_on: device.node_id().is_some(),
                inputs: device.inputs().iter().map(shown_input).collect(),
            })
        };
        self.devices().nodes().filter_map(shown).collect()
    }

    fn input(&mut self, node: NodeId, text: &str) -> Result<(), String> {
        let now = self.0.bus.now();
        self.with(node, |device| device.input(now, text).map_err(|refusal| refusal.to_string()))?
    }

    fn set_power(&mut self, node: NodeId, is_on: bool) -> Result<(), String> {
        let now = self.0.bus.now();
        self.with(node, |device| device.set_power(now, if is_on { Power::On } else { Power::Off }))
    }
}

fn shown_input(input: &Input) -> view::Input {
    let (choices, takes) = match &input.takes {
        Takes::Flag => (vec!["false".to_owned(), "true".to_owned()], None),
        Takes::Words(words) => (words.iter().map(|word| (*word).to_owned()).collect(), None),
        takes => (Vec::new(), Some(takes)),
    };
    let help = takes.map_or_else(|| input.what.to_owned(), |takes| format!("{}: {takes}", input.what));
    view::Input { name: input.name.to_owned(), help, choices, value: input.value.clone() }
}
