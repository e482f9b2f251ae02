//! `lexican restore`.

use std::path::Path;

use lexican_runtime::NodeId;
use lexican_toolbox::parameters::restore::{check_identity, configured, domains};
use lexican_toolbox::remote::RemoteNode;

use super::Watch;
use super::writing::{Wanted, WriteArgs};
use crate::bus::{Connected, NetworkArgs, node_id};
use crate::device::load;
use crate::output::{Failure, Outcome, note, warn};

/// Write the parameters of a DCF into a node
///
/// Checks first that the node is of the vendor and the product of the DCF. Reads what the node has, and writes what differs:
/// DOMAINs come from the files that the DCF names (DownloadFile). PDOs are switched off meanwhile, what is refused is tried again after the rest, and each value is read back. The node is
/// set PRE-OPERATIONAL before, and stays so unless --start is given.
///
/// If it ends early (Ctrl-C, a lost bus), it says what was written. The same command then goes on, since it writes only what
/// differs. Exit code 1 if anything is refused, or it is another device; 2 if it ends early.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    #[command(flatten)]
    network: NetworkArgs,

    /// Restore a device of another vendor or product, too
    #[arg(long)]
    force: bool,

    #[command(flatten)]
    writing: WriteArgs,

    /// The node-ID: 1 to 127, or 0x1 to 0x7F
    #[arg(value_name = "NODE", value_parser = node_id)]
    node: NodeId,

    /// The DCF, such as `lexican backup` writes
    #[arg(value_name = "FILE")]
    dcf: String,
}

const EXAMPLES: &str = "\
Examples:
    lexican restore --bus can0 5 drive.dcf --dry-run
    lexican restore --bus can0 5 drive.dcf --store";

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    let dcf = load(&args.dcf, &[])?.device;
    if dcf.entries().all(|entry| entry.configured.is_none() && entry.download_file.is_none()) {
        return Err(Failure::new(format_args!("{} configures nothing", args.dcf))
            .help("a DCF has ParameterValue=; `lexican backup` writes one"));
    }
    let Connected { mut network, id, device } = args.network.connect(Some(args.node))?;
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
    let mut settings = configured(&dcf, id);
    settings.extend(domains(&dcf, Path::new(&args.dcf).parent().unwrap_or(Path::new("")))?);
    Wanted::new(id, sheet, &settings, args.writing).restore(&mut node, &Watch::new()?)
}
