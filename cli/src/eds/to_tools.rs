//! `lexican eds to-dbc` and `to-wireshark`: a data sheet for other tools.

use std::io::Write;
use std::path::PathBuf;

use lexican_runtime::NodeId;
use lexican_toolbox::data_sheet::DataSheet;
use lexican_toolbox::decode::wireshark;
use lexican_toolbox::pdo::dbc::{Database, Node};

use crate::bus::NodeIds;
use crate::device::{DeviceArgs, show_errors};
use crate::output::{self, Failure, ForceArgs, Outcome, warn};

/// A data sheet, the nodes that have it, and the file for another tool.
#[derive(clap::Args, Debug)]
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

pub(crate) const DBC_EXAMPLES: &str = "\
Examples:
    lexican eds to-dbc siko/ag03-1 --node 5,6 -o plant.dbc
    lexican eds to-dbc drive.eds --overlay drive.toml --node 0x10-0x13 > drives.dbc
    lexican eds to-dbc station.dcf -o station.dbc";

pub(crate) const WIRESHARK_EXAMPLES: &str = "\
Examples:
    lexican eds to-wireshark siko/ag03-1 --node 5,6 -o drives.lua
    tshark -X lua_script:drives.lua -d can.subdissector,canopen -r bus.log -Y 'lexican.position_actual_value > 100'";

/// `lexican eds to-dbc`.
pub(crate) fn dbc(args: &Args) -> Result<Outcome, Failure> {
    let sheet = args.sheet()?;
    let nodes: Vec<_> = args.nodes(&sheet)?.into_iter().map(|id| Node::new(id, &sheet.device)).collect();
    let database = Database::new(&nodes);
    args.write(&database.to_bytes())?;
    for name in &database.left_out {
        warn(format_args!("{name} is left out: another message has its COB-ID"));
    }
    Ok(if show_errors(&sheet) || !database.left_out.is_empty() { Outcome::Found } else { Outcome::Clean })
}

/// `lexican eds to-wireshark`.
pub(crate) fn wireshark(args: &Args) -> Result<Outcome, Failure> {
    let sheet = args.sheet()?;
    let nodes = args.nodes(&sheet)?.into_iter().map(|id| (format!("node {id}"), id, &sheet.device));
    args.write(wireshark::script(nodes).as_bytes())?;
    Ok(if show_errors(&sheet) { Outcome::Found } else { Outcome::Clean })
}

impl Args {
    fn sheet(&self) -> Result<DataSheet, Failure> {
        self.output.as_ref().map_or(Ok(()), |path| self.device.guard(path))?;
        self.device.load()
    }

    fn nodes(&self, sheet: &DataSheet) -> Result<Vec<NodeId>, Failure> {
        let configured = sheet.device.commissioning.as_ref().and_then(|commissioning| commissioning.node_id);
        match (&self.node, configured.and_then(NodeId::new)) {
            (Some(nodes), _) => Ok(nodes.0.clone()),
            (None, Some(node)) => Ok(vec![node]),
            (None, None) => {
                let what = format_args!("which node-ID has it? {} does not say", self.device.name());
                Err(Failure::new(what).help("name it with --node 5"))
            }
        }
    }

    fn write(&self, bytes: &[u8]) -> Result<(), Failure> {
        match &self.output {
            Some(path) => self.force.write(path, bytes),
            None => {
                let mut stdout = output::raw_stdout();
                stdout.write_all(bytes)?;
                Ok(stdout.flush()?)
            }
        }
    }
}
