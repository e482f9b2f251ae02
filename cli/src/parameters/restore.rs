//! `lexican restore`.

use std::path::Path;

use lexican_runtime::NodeId;
use lexican_runtime::host::Pace;
use lexican_toolbox::node::remote::RemoteNode;
use lexican_toolbox::parameters::restore::{check_identity, configured, domains, not_restored};

use super::writing::{Wanted, WriteArgs};
use super::{LeftOutArgs, Watch};
use crate::bus::{Connected, Identity, NetworkArgs, node_id};
use crate::device::load;
use crate::output::{Failure, Outcome, note, warn};

/// Write the parameters of a DCF into a node
///
/// Checks first that the node is of the vendor and the product of the DCF. Reads what the node has, and writes what differs:
/// DOMAINs come from the files that the DCF names (DownloadFile). Set-points, commands and what an active RPDO writes are left out,
/// as in a backup. PDOs are switched off meanwhile, what is refused is tried again after the rest, and each value is read back. The node is
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

    #[command(flatten)]
    left_out: LeftOutArgs,

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
    let identity = if args.force { Identity::Any } else { Identity::Product };
    let Connected { mut network, id, device } = args.network.connect_as(Pace::Virtual, Some(args.node), identity)?;
    // Write by the data sheet of the device, since a DCF lacks overlays.
    let sheet = device.as_ref().unwrap_or(&dcf);
    let mut node = RemoteNode::new(&mut network, id);
    if let Err(other) = check_identity(&mut node, &dcf)? {
        warn(format_args!("node {id}: {other}"));
        if !args.force {
            note("nothing was written; --force writes it anyway");
            return Ok(Outcome::Found);
        }
    }
    let left_out = not_restored(&dcf, id);
    args.left_out.print(args.writing.json, &dcf, &left_out)?;
    let mut settings = configured(&dcf, id);
    settings.extend(domains(&dcf, id, Path::new(&args.dcf).parent().unwrap_or(Path::new("")))?);
    Wanted::new(id, sheet, &settings, &left_out, args.writing).restore(&mut node, &Watch::new()?)
}
