//! `lexican pdo show`.

use std::collections::BTreeMap;

use lexican_toolbox::pdo::{PdoName, PdoState};
use lexican_toolbox::values::DeviceValues;
use lexican_toolbox::values::report::ValueReport;

use super::node::{print, reader};
use crate::bus::{NetworkArgs, NodeIds};
use crate::output::{Failure, Outcome, note, spinner, warn};

/// Show how the PDOs of a node are configured at present: when each is sent, and which bits are whose
///
/// The highest bit of each byte is at its left. Of a node without a known device, PDOs are looked for until eight
/// numbers in a row are missing. Exit code 1 if a PDO that is named does not exist.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    #[command(flatten)]
    network: NetworkArgs,

    /// The node-IDs: 5, 0x10, 3,5-9
    #[arg(value_name = "NODES")]
    nodes: NodeIds,

    /// The PDOs: tpdo1, rpdo3; all by default
    #[arg(value_name = "PDO")]
    pdos: Vec<PdoName>,

    /// Read the mapped objects by SDO, and show their values
    #[arg(long)]
    values: bool,

    /// Print one JSON object per line
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
    lexican pdo show 5 --bus can0
    lexican pdo show 5 tpdo1 rpdo1 --bus can0 --values
    lexican pdo show 5-9 --bus can0 --json | jq 'select(.on) | .cob_id'";

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let nodes = args.network.connect_several(Some(&args.nodes))?;
    let names_node = nodes.are_several() && !args.json;
    nodes.for_each(|network, node, device| {
        let progress = spinner(format!("reading the PDOs of node {node}"));
        let (mut states, mut outcome) = (Vec::new(), Outcome::Clean);
        if args.pdos.is_empty() {
            states = PdoState::read_all(device, reader(network, node))?;
        }
        for name in &args.pdos {
            let state = PdoState::read(*name, reader(network, node))?;
            if state.is_none() {
                warn(format_args!("node {node} has no {name}"));
                outcome = Outcome::Found;
            }
            states.extend(state);
        }
        let mut values = BTreeMap::new();
        for address in
            states.iter().flat_map(|state| &state.mapping).map(|mapped| mapped.address).filter(|_| args.values)
        {
            if let Some(data) = reader(network, node)(address)? {
                let sheet = device.map(DeviceValues::new);
                values.insert(address, ValueReport::of_bytes(sheet.as_ref(), address, &data));
            }
        }
        progress.finish_and_clear();
        if names_node || (states.is_empty() && args.pdos.is_empty()) {
            note(format_args!("node {node} has {} PDOs", states.len()));
        }
        states.iter().try_for_each(|state| print(args.json, node, state, device, &values))?;
        Ok(outcome)
    })
}
