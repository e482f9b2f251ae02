//! `lexican machine fmt`.

use std::io::Write;

use lexican_toolbox::text::files::read;

use super::file::MachineArgs;
use crate::output::{self, Failure, Outcome, write_whole};

/// Format the file of a machine, and keep its comments and the order of its keys
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    #[command(flatten)]
    machine: MachineArgs,

    /// Only name the file if it would change; exit code 1 if so
    #[arg(long)]
    check: bool,
}

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    let path = args.machine.path()?;
    let source = read(&path)?;
    let formatted = lexican_machine::format(source.text())
        .map_err(|error| Failure::new(format_args!("{}: {error}", path.display())).help("`lexican machine check`"))?;
    if formatted == source.text() {
        return Ok(Outcome::Clean);
    }
    writeln!(output::stdout(), "{}", path.display())?;
    if args.check {
        return Ok(Outcome::Found);
    }
    write_whole(&path, formatted.as_bytes())?;
    Ok(Outcome::Clean)
}
