//! `lexican eds to-dbc`: a CAN database of a data sheet.

use std::io::Write;
use std::path::PathBuf;

use lexican_runtime::NodeId;
use lexican_toolbox::pdo::dbc::{Database, Node};

use crate::bus::NodeIds;
use crate::device::{DeviceArgs, show_errors};
use crate::output::{self, Failure, ForceArgs, Outcome, warn};

/// Write a CAN database (DBC) of the messages of nodes with this data sheet
///
/// PDOs by the mapping of the data sheet, EMCY, SDO, heartbeat, NMT and SYNC. Names come from the data sheet, units,
/// scaling and named values from its overlay and from CiA 301 and 402. Exit code 1 if two messages have the same COB-ID, of
/// which the second is left out.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    #[command(flatten)]
    device: DeviceArgs,

    /// The node-IDs that have this data sheet: 5, 0x05, 3,5-9; by default the one that a DCF says
    #[arg(long, value_name = "NODES")]
    node: Option<NodeIds>,

    /// The file to write; stdout by default
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,

    #[command(flatten)]
    force: ForceArgs,
}

const EXAMPLES: &str = "\
Examples:
    lexican eds to-dbc siko/ag03-1 --node 5,6 -o plant.dbc
    lexican eds to-dbc drive.eds --overlay drive.toml --node 0x10-0x13 > drives.dbc
    lexican eds to-dbc station.dcf -o station.dbc";

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    args.output.as_ref().map_or(Ok(()), |path| args.device.guard(path))?;
    let sheet = args.device.load()?;
    let configured = sheet.device.commissioning.as_ref().and_then(|commissioning| commissioning.node_id);
    let nodes: Vec<NodeId> = match (&args.node, configured.and_then(NodeId::new)) {
        (Some(nodes), _) => nodes.0.clone(),
        (None, Some(node)) => vec![node],
        (None, None) => {
            let name = args.device.name();
            return Err(
                Failure::new(format_args!("which node-ID has it? {name} does not say")).help("name it with --node 5")
            );
        }
    };
    let nodes: Vec<_> = nodes.into_iter().map(|id| Node::new(id, &sheet.device)).collect();
    let database = Database::new(&nodes);
    let bytes = database.to_bytes();
    match &args.output {
        Some(path) => args.force.write(path, &bytes)?,
        None => {
            let mut stdout = output::raw_stdout();
            stdout.write_all(&bytes)?;
            stdout.flush()?;
        }
    }
    for name in &database.left_out {
        warn(format_args!("{name} is left out: another message has its COB-ID"));
    }
    Ok(if show_errors(&sheet) || !database.left_out.is_empty() { Outcome::Found } else { Outcome::Clean })
}
