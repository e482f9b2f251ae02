//! `lexican restore`.

use lexican_runtime::NodeId;
use lexican_runtime::wire::nmt::NmtCommand;
use lexican_toolbox::parameters::restore::{Options, Outcome as Restored, check_identity, configured, restore};
use lexican_toolbox::remote::RemoteNode;

use super::{Wanted, Watch};
use crate::bus::{Connected, NodeArgs, node_id};
use crate::device::load;
use crate::output::{Failure, Outcome, note, warn};

/// Write the parameters of a DCF into a node
///
/// Checks first that the node is of the vendor and the product of the DCF. Reads what the node has, and writes what differs:
/// PDOs are switched off meanwhile, what is refused is tried again after the rest, and each value is read back. The node is
/// set PRE-OPERATIONAL before, and stays so unless --start is given.
///
/// If it ends early (Ctrl-C, a lost bus), it says what was written. The same command then goes on, since it writes only what
/// differs. Exit code 1 if anything is refused, or it is another device; 2 if it ends early.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES, allow_missing_positional = true)]
pub(crate) struct Args {
    #[command(flatten)]
    node: NodeArgs,

    /// Restore a device of another vendor or product, too
    #[arg(long)]
    force: bool,

    #[command(flatten)]
    writing: WriteArgs,

    /// The node-ID, in place of --node
    #[arg(value_name = "ID", value_parser = node_id, conflicts_with = "node")]
    id: Option<NodeId>,

    /// The DCF, such as `lexican backup` writes
    #[arg(value_name = "FILE")]
    dcf: String,
}

/// How parameters are written.
#[derive(clap::Args, Clone, Copy, Debug)]
pub(super) struct WriteArgs {
    /// Only print what differs
    #[arg(long, conflicts_with_all = ["store", "start"])]
    dry_run: bool,

    /// Let the device store its parameters at the end (1010h)
    #[arg(long)]
    store: bool,

    /// Start the node at the end
    #[arg(long)]
    start: bool,

    /// Print one JSON object per line
    #[arg(long)]
    pub(super) json: bool,
}

const EXAMPLES: &str = "\
Examples:
    lexican restore --bus can0 5 drive.dcf --dry-run
    lexican restore --bus can0 --node 5 drive.dcf --store";

impl WriteArgs {
    pub(super) const fn options(self) -> Options {
        Options { dry_run: self.dry_run, store: self.store }
    }

    /// Starts the node, if that is wanted.
    pub(super) fn start<L: lexican_runtime::host::Link>(self, node: &mut RemoteNode<'_, L>) -> Result<(), Failure> {
        if self.start {
            let id = node.id();
            node.network().command(NmtCommand::Start, Some(id))?;
        }
        Ok(())
    }
}

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    let dcf = load(&args.dcf, &[])?.device;
    if dcf.entries().all(|entry| entry.configured.is_none()) {
        return Err(Failure::new(format_args!("{} configures nothing", args.dcf))
            .help("a DCF has ParameterValue=; `lexican backup` writes one"));
    }
    let Connected { mut network, id, device } = args.node.connect_to(args.id)?;
    // How the device is written is up to its data sheet; that of a DCF lacks overlays.
    let sheet = device.as_ref().unwrap_or(&dcf);
    let mut node = RemoteNode::new(&mut network, id);
    if let Err(other) = check_identity(&mut node, &dcf)? {
        warn(format_args!("node {id}: {other}"));
        if !args.force {
            note("nothing was written; --force writes it anyway");
            return Ok(Outcome::Found);
        }
    }
    let settings = configured(&dcf, id);
    let (options, mut restored) = (args.writing.options(), Restored::default());
    let watch = Watch::new()?;
    let ended = restore(&mut node, sheet, &settings, options, &mut |progress| watch.see(progress), &mut restored);
    drop(watch);
    if ended.is_ok() {
        args.writing.start(&mut node)?;
    }
    Wanted { node: id, sheet, settings: &settings, options, json: args.writing.json }.print(&restored, ended)
}
