//! `lexican eds fetch`: reads the data sheet that a device stores.

use std::path::PathBuf;

use lexican_runtime::NodeId;
use lexican_runtime::host::Pace;
use lexican_toolbox::data_sheet::DataSheet;
use lexican_toolbox::node::stored;

use crate::access::{LONGEST, save};
use crate::bus::{Connected, Identity, NODE, NetworkArgs, node_id};
use crate::device::show_errors;
use crate::output::{Failure, ForceArgs, Outcome, note, plural};

/// Read the data sheet that a device has in it (1021h)
///
/// `lexican scan` says which nodes have one. Vendors may store it in forms of their own (1022h), which only they can read: it is
/// written as it is then, with exit code 1. Nothing is changed in the device.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    #[command(flatten)]
    network: NetworkArgs,

    /// The file to write; - for stdout
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,

    #[command(flatten)]
    force: ForceArgs,

    #[arg(value_name = "NODE", value_parser = node_id, help = NODE)]
    node: Option<NodeId>,
}

const EXAMPLES: &str = "\
Examples:
    lexican eds fetch 5 --bus can0 -o valve.eds
    lexican eds fetch 5 --bus can0 -o - | less";

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    args.force.guard(&args.output, args.network.files())?;
    let Connected { mut network, id, .. } = args.network.connect_as(Pace::Virtual, args.node, Identity::Any)?;
    let Some(form) = stored::form(&mut network, id)? else {
        let what = format_args!("node {id} has no data sheet in it: there is no 1022h");
        return Err(
            Failure::new(what).help("`lexican devices` lists those that lexican knows; others come from the vendor")
        );
    };
    let outcome = save(&mut network, id, stored::SHEET, LONGEST, &args.output, &args.force)?;
    if outcome != Outcome::Clean || args.output.as_os_str() == "-" {
        return Ok(outcome);
    }
    if form != stored::TEXT {
        let path = args.output.display();
        note(format_args!("{path} is in form {form} of the vendor (1022h), and no text: its tools have to unpack it"));
        return Ok(Outcome::Found);
    }
    let sheet = DataSheet::load(&args.output.to_string_lossy(), &[])?;
    let objects = plural(sheet.device.objects.len(), "object");
    let product = sheet.device.info.product_name.as_deref().unwrap_or("a device without a name");
    note(format_args!("{}: {product}, {objects}", args.output.display()));
    Ok(if show_errors(&sheet) { Outcome::Found } else { Outcome::Clean })
}
