//! `lexican apply`.

use std::path::PathBuf;

use lexican_eds::model::Device;
use lexican_runtime::NodeId;
use lexican_toolbox::node::remote::RemoteNode;
use lexican_toolbox::parameters::LeftOuts;
use lexican_toolbox::parameters::restore::Settings;
use lexican_toolbox::parameters::settings::{Section, conditions, parse};
use lexican_toolbox::values::DeviceValues;
use serde_json::json;

use super::writing::{Wanted, WriteArgs};
use super::{Watch, known};
use crate::bus::{NetworkArgs, NodeIds, Nodes};
use crate::output::{Failure, Outcome, note, print_result, warn};
use lexican_toolbox::text::files::read;

/// Apply settings from a file (TOML) to nodes
///
/// The file names objects and values as `write` takes them, in a section for each node or several. All of it is checked
/// against the data sheets (names, access, types, limits, enumerations) before anything is written; then what differs is
/// written as `restore` does, and read back. Exit code 1 if anything is refused, by a data sheet or by a device.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    #[command(flatten)]
    network: NetworkArgs,

    #[command(flatten)]
    writing: WriteArgs,

    /// The settings; the end of this help shows some
    #[arg(value_name = "FILE")]
    settings: PathBuf,
}

const EXAMPLES: &str = "\
Settings:
    [node.5]
    \"Modes of Operation\" = \"profile velocity\"
    \"Motor Parameter Set/v-Pos\" = 40
    2412 = \"2.5 mm\"

    [node.\"6,8-10\"]
    1017 = \"100 ms\"

Examples:
    lexican apply --bus can0 settings.toml --dry-run
    lexican apply --bus can0 settings.toml --store";

/// The settings of one node.
struct Job {
    node: NodeId,
    sheet: Device,
    settings: Settings,
}

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    let path = args.settings.display();
    let sections = parse(read(&args.settings)?.text()).map_err(|error| {
        Failure::new(format_args!("{path}: {error}")).help("`lexican apply --help` shows such a file")
    })?;
    let mut work: Vec<(NodeId, &Section)> = Vec::new();
    for section in &sections {
        let nodes: NodeIds = section
            .nodes
            .parse()
            .map_err(|error| Failure::new(format_args!("{path}: node.{}: {error}", section.nodes)))?;
        for node in nodes.0 {
            if work.iter().any(|(other, _)| *other == node) {
                return Err(Failure::new(format_args!("{path}: node {node} has two sections")));
            }
            work.push((node, section));
        }
    }
    let ids = NodeIds(work.iter().map(|(node, _)| *node).collect());
    let mut nodes = args.network.connect_several(Some(&ids))?;
    let (mut jobs, mut is_wrong) = (Vec::new(), false);
    for (node, section) in work {
        match args.job(&mut nodes, node, section)? {
            Some(job) => jobs.push(job),
            None => is_wrong = true,
        }
    }
    if is_wrong {
        note("nothing was written");
        return Ok(Outcome::Found);
    }
    let watch = Watch::new()?;
    let mut outcome = Outcome::Clean;
    for Job { node: id, sheet, settings } in &jobs {
        let mut node = RemoteNode::new(&mut nodes.network, *id);
        outcome =
            outcome.max(Wanted::new(*id, sheet, settings, &LeftOuts::new(), args.writing).restore(&mut node, &watch)?);
    }
    Ok(outcome)
}

impl Args {
    /// Checks the settings of a node; `None` if anything is wrong with them, which is printed.
    fn job(&self, nodes: &mut Nodes, node: NodeId, section: &Section) -> Result<Option<Job>, Failure> {
        let device = nodes.device(node)?;
        let sheet = known(node, device.as_ref())?;
        let mut values = DeviceValues::new(sheet);
        RemoteNode::new(&mut nodes.network, node).read_conditions(conditions(sheet), &mut values)?;
        match section.encode(&mut values, node) {
            Ok(settings) => Ok(Some(Job { node, sheet: sheet.clone(), settings })),
            Err(wrong) => {
                for reason in wrong {
                    if self.writing.json {
                        let object = json!({ "event": "wrong", "node": node.get(), "reason": reason });
                        print_result(true, object, "")?;
                    } else {
                        warn(format_args!("node {node}: {reason}"));
                    }
                }
                Ok(None)
            }
        }
    }
}
