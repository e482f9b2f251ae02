//! The data sheets of all nodes on a bus.

use std::collections::BTreeMap;
use std::path::PathBuf;

use lexican_runtime::NodeId;
use lexican_toolbox::data_sheet::DataSheet;

use super::node::NO_DEVICE;
use super::of_node;
use crate::device::{load, load_input};
use crate::machine::{OnBus, machine_of_sheet};
use crate::output::Failure;

#[derive(clap::Args, Debug)]
pub(crate) struct KnownArgs {
    /// The device of a node: 5=siko/ag03-1, 7=drive.eds, 9=none; may be given several times
    #[arg(long, value_name = "NODE=DEVICE", value_parser = of_node)]
    device: Vec<(NodeId, String)>,

    /// Corrections and meanings in addition to the data sheet of a node (TOML): 7=FILE.toml; may be given several times
    #[arg(long, value_name = "NODE=FILE", value_parser = of_node)]
    overlay: Vec<(NodeId, String)>,
}

impl KnownArgs {
    /// The nodes named in the arguments, including those to be treated as unknown.
    pub(crate) fn named(&self) -> impl Iterator<Item = NodeId> {
        self.device.iter().map(|(node, _)| *node)
    }

    /// The name of a node in the machine, by its data sheet `machine.toml#feeder`.
    pub(crate) fn name(&self, node: NodeId) -> Option<String> {
        let (_, name) = self.device.iter().find(|(named, _)| *named == node)?;
        machine_of_sheet(name).map(|(_, node)| node)
    }

    /// The machine to which the nodes belong.
    pub(crate) fn machine(&self) -> Option<OnBus> {
        self.device.iter().find_map(|(_, name)| machine_of_sheet(name)).map(|(machine, _)| machine)
    }

    /// The data sheets with overlays. Those in the arguments replace those in the URL of the bus.
    pub(crate) fn load(&self, of_url: Vec<(NodeId, DataSheet)>) -> Result<BTreeMap<NodeId, DataSheet>, Failure> {
        let overlays = |node| self.overlay.iter().filter(move |(id, _)| *id == node).map(|(_, path)| path.into());
        let overlays = |node| overlays(node).collect::<Vec<PathBuf>>();
        let mut known = BTreeMap::new();
        for (node, sheet) in of_url {
            // With overlays, it is still the data sheet of the library.
            let added = load_input(sheet.input, &overlays(node))?;
            known.insert(node, DataSheet { library: sheet.library, ..added });
        }
        for (node, name) in &self.device {
            match &**name {
                NO_DEVICE => drop(known.remove(node)),
                name => drop(known.insert(*node, load(name, &overlays(*node))?)),
            }
        }
        match self.overlay.iter().find(|(node, _)| !known.contains_key(node)) {
            Some((node, path)) => {
                Err(Failure::new(format_args!("{path} adds to a data sheet, but that of node {node} is unknown"))
                    .help(format_args!("name the data sheet with --device {node}=FILE")))
            }
            None => Ok(known),
        }
    }
}
