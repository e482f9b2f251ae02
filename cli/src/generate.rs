//! `lexican gen`: generates Rust code from a data sheet.

use std::io::Write;
use std::path::PathBuf;

use lexican_codegen::{Options, compile};
use lexican_eds::Severity;

use crate::device::{DeviceArgs, show_errors};
use crate::output::{self, Failure, ForceArgs, Outcome, warn};

/// Generate Rust code from a data sheet: what lexican-codegen does in a build script
///
/// If the data sheet has errors, they are printed in full, and nothing is written (exit code 1); correct them with an
/// overlay, or drop them with --ignore.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    #[command(flatten)]
    device: DeviceArgs,

    /// The file to write; stdout by default
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,

    #[command(flatten)]
    force: ForceArgs,

    /// Also generate the device's side: the table of all entries and a storage with the defaults
    #[arg(long)]
    storage: bool,

    /// Also generate a table of names
    #[arg(long)]
    names: bool,

    /// Also generate a driver of a CiA 402 drive: the module `driver`, for a crate that depends on lexican-driver
    #[arg(long)]
    driver: bool,

    /// Treat findings with this code as errors; may be given several times
    #[arg(long, value_name = "CODE")]
    deny: Vec<String>,

    /// Drop findings with this code; may be given several times
    #[arg(long, value_name = "CODE")]
    ignore: Vec<String>,
}

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    args.output.as_ref().map_or(Ok(()), |path| args.device.guard(path))?;
    let mut sheet = args.device.load()?;
    let options = Options { storage: args.storage, names: args.names, driver: args.driver, ..Options::default() };
    let output = compile(&sheet.device, &options);
    sheet.diagnostics.extend(output.diagnostics);
    sheet.diagnostics.finish();
    args.deny.iter().for_each(|code| sheet.diagnostics.deny(code));
    args.ignore.iter().for_each(|code| sheet.diagnostics.allow(code));
    if show_errors(&sheet) {
        warn(format_args!("{}: nothing is generated from a data sheet with errors", sheet.input.eds.name()));
        return Ok(Outcome::Found);
    }
    for warning in sheet.diagnostics.iter().filter(|finding| finding.severity == Severity::Warning) {
        warn(warning.render_short(&sheet.input));
    }
    match &args.output {
        Some(path) => args.force.write(path, output.code.as_bytes())?,
        None => {
            let mut stdout = output::raw_stdout();
            stdout.write_all(output.code.as_bytes())?;
            stdout.flush()?;
        }
    }
    Ok(Outcome::Clean)
}
