//! `lexican backup`.

use std::path::PathBuf;

use lexican_runtime::NodeId;
use lexican_toolbox::node::remote::RemoteNode;
use lexican_toolbox::parameters::LeftOut;
use lexican_toolbox::parameters::backup::backup;
use lexican_toolbox::values::DeviceValues;
use serde_json::json;

use super::archive::{self, is_archive};
use super::{LeftOutArgs, Watch, by_reason, known, print_refused};
use crate::bus::{Identity, NODES, NetworkArgs, NodeIds};
use crate::output::{Failure, ForceArgs, Outcome, plural, print_result};

/// Save the parameters of nodes as DCF, or of a whole machine in one file
///
/// Without NODES, of all nodes of machine.toml: a tar archive with a DCF for each node, also the DOMAINs, and a manifest with what
/// each node is, its versions, what was left out and why, and checksums.
///
/// Reads every entry that the data sheet lets one read and write, but for set-points (target positions, outputs), what an
/// active RPDO writes, and commands (1003h, 1010h, 1011h, programs, 6040h). The DCF has the node-ID and the identity of the
/// device. What is left out is counted by reason, what the device refuses is listed. Exit code 1 if it refuses anything.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    #[command(flatten)]
    network: NetworkArgs,

    #[arg(value_name = "NODES", help = NODES)]
    nodes: Option<NodeIds>,

    /// The DCF to write; {node} in it is the node-ID. For a machine FILE.tar, by default its name and the date
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,

    #[command(flatten)]
    force: ForceArgs,

    /// Also save DOMAINs, which may be long: each in a file beside the DCF, which names it (DownloadFile)
    #[arg(long)]
    domains: bool,

    #[command(flatten)]
    left_out: LeftOutArgs,

    /// Print one JSON object per line
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
    lexican backup                                     (the machine of this folder)
    lexican backup --bus can0 5 -o drive.dcf
    lexican backup --bus can0 3,5-9 -o machine/{node}.dcf
    lexican backup --bus can0 7 --device FILE.eds -o drive.dcf
    lexican backup --bus can0 5,7 --device 5=DRIVE.eds --device 7=VALVE.eds -o machine/{node}.dcf";

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    let output = match &args.output {
        Some(output) if !is_archive(output) => output,
        _ if args.nodes.is_none() => {
            return archive::backup(&args.network, args.output.as_ref(), args.force, args.json);
        }
        Some(_) => {
            return Err(Failure::new("a machine is saved as a whole").help("without nodes; of a node: -o FILE.dcf"));
        }
        None => return Err(Failure::new("where to?").help("-o FILE.dcf")),
    };
    let mut nodes = args.network.connect_several(args.nodes.as_ref())?;
    nodes.identity = Identity::Product;
    let name = output.to_string_lossy().into_owned();
    if nodes.are_several() && !name.contains(NODE) {
        return Err(Failure::new("several nodes need several files").help("write {node} into the name: -o {node}.dcf"));
    }
    let path_of = |node: NodeId| PathBuf::from(name.replace(NODE, &node.to_string()));
    nodes.ids.iter().try_for_each(|node| args.force.guard(&path_of(*node), args.network.files()))?;
    let watch = Watch::new()?;
    nodes.for_each(|network, node, device| {
        let sheet = known(node, device)?;
        let mut node_read = RemoteNode::new(network, node);
        let mut backup = backup(&mut node_read, sheet, args.domains, &mut |progress| watch.see(progress))?;
        let path = path_of(node);
        let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        for (file, data) in backup.domain_files(&stem) {
            args.force.write(&path.with_file_name(file), &data)?;
        }
        args.force.write(&path, backup.dcf().as_bytes())?;
        let path = path.display().to_string();
        watch.bar.set_position(0);
        let values = DeviceValues::new(sheet);
        for (address, refusal) in &backup.left_out {
            print_refused(args.json, node, &values, *address, refusal)?;
        }
        let unread_domains = backup.no_parameters.values().filter(|reason| **reason == LeftOut::Domain).count();
        let object = json!({
            "event": "summary", "node": node.get(), "file": path, "kept": backup.kept, "refused": backup.left_out.len(),
            "domains": backup.domains.len(), "unread_domains": unread_domains, "left_out": by_reason(&backup.no_parameters),
        });
        let missing = match backup.left_out.len() {
            0 => String::new(),
            count => format!(", {count} are missing"),
        };
        let unread = match unread_domains {
            0 => String::new(),
            count => format!("; {} not saved without --domains", plural(count, "DOMAIN")),
        };
        let kept = plural(backup.kept, "parameter");
        print_result(args.json, object, format_args!("node {node}: {kept} in {path}{missing}{unread}"))?;
        args.left_out.print(args.json, sheet, &backup.no_parameters)?;
        Ok(if backup.left_out.is_empty() { Outcome::Clean } else { Outcome::Found })
    })
}

/// The part of a file name that stands for the node-ID.
const NODE: &str = "{node}";
