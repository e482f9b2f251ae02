//! `lexican apply`.

use lexican_toolbox::node::remote::RemoteNode;
use lexican_toolbox::parameters::LeftOuts;

use super::writing::{Wanted, WriteArgs};
use super::{Watch, known};
use crate::bus::{NetworkArgs, NodeIds};
use crate::machine::{found, sound_on_bus};
use crate::output::{Failure, Outcome};

/// Write the settings of a machine into its nodes
///
/// Those that machine.toml gives a node: objects by name, values with their units, checked against the data sheets (names,
/// access, types, limits, enumerations) before anything is written. What differs is written as `restore` does, and read back.
/// `boot` writes them as well, with all else that a node needs. Exit code 1 if a device refuses anything.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// The node, or several; by default all that have settings
    #[arg(value_name = "NODE")]
    node: Option<NodeIds>,

    #[command(flatten)]
    network: NetworkArgs,

    #[command(flatten)]
    writing: WriteArgs,
}

const EXAMPLES: &str = "\
Settings of a machine:
    [node.feeder]
    id = 5
    sheet = \"siko/ag03-1\"
    settings = { \"Motor Parameter Set/v-Pos\" = 40, 2412 = \"2.5 mm\" }

Examples:
    lexican apply --dry-run
    lexican apply feeder --store";

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    let path = found(None)?;
    let machine = sound_on_bus(&path)?;
    let wanted = |id| args.node.as_ref().is_none_or(|nodes| nodes.0.contains(&id));
    let with_id = machine.nodes.iter().filter_map(|node| Some((node.id?, node)));
    let nodes: Vec<_> = with_id.filter(|(id, node)| wanted(*id) && !node.settings.is_empty()).collect();
    if nodes.is_empty() {
        let whom = if args.node.is_some() { "for that node" } else { "for any node" };
        return Err(Failure::new(format_args!("{} has no settings {whom}", path.display()))
            .help("`lexican apply --help` shows some"));
    }
    let ids = args.node.clone().unwrap_or_else(|| NodeIds(nodes.iter().map(|(id, _)| *id).collect()));
    let mut bus = args.network.connect_several(Some(&ids))?;
    let watch = Watch::new()?;
    let mut sheets = Vec::new();
    for (id, _) in &nodes {
        // Check the identity of all nodes before anything is written.
        sheets.push(bus.device(*id)?);
    }
    let mut outcome = Outcome::Clean;
    for ((id, node), sheet) in nodes.into_iter().zip(sheets) {
        let settings = node.settings.iter().map(|setting| (setting.address, setting.data.clone())).collect();
        let wanted = Wanted::new(id, known(id, sheet.as_ref())?, &settings, &LeftOuts::new(), args.writing)
            .restore(&mut RemoteNode::new(&mut bus.network, id), &watch)?;
        outcome = outcome.max(wanted);
    }
    Ok(outcome)
}
