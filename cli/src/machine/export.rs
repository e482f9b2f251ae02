//! `lexican machine export`.

use std::io::Write;
use std::path::PathBuf;

use super::file::{MachineArgs, sound};
use crate::output::{self, Failure, ForceArgs, Outcome};

/// Write what other tools take of a machine into a folder
///
/// A concise DCF for each node (NAME.bin, 1F22h of CiA 302-3), by the rules of dcfgen: what the data sheet says already is
/// left out.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    #[command(flatten)]
    machine: MachineArgs,

    /// The folder, which is made if it is not there
    #[arg(long, value_name = "DIR")]
    folder: PathBuf,

    #[command(flatten)]
    force: ForceArgs,
}

const EXAMPLES: &str = "\
Examples:
    lexican machine export --folder dcf";

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    let machine = sound(&args.machine.path()?)?;
    std::fs::create_dir_all(&args.folder).map_err(|error| Failure::file("make", &args.folder, &error))?;
    for machine in machine.buses() {
        for node in &machine.nodes {
            let path = args.folder.join(format!("{}.bin", node.name.value));
            args.force.write(&path, &machine.concise_dcf(node))?;
            writeln!(output::stdout(), "{}", path.display())?;
        }
    }
    Ok(Outcome::Clean)
}
