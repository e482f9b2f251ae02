//! `lexican eds dump`: prints the object dictionary.

use std::io::Write;

use lexican_eds::dump;

use crate::device::{DeviceArgs, show_errors};
use crate::output::{self, Failure, Outcome};

/// Print the object dictionary of a data sheet
///
/// Prints one row per entry that an SDO can address. Exit code 1 if the data sheet has errors; the entries that
/// could be read are printed anyway.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    #[command(flatten)]
    device: DeviceArgs,

    /// How to print it
    #[arg(long, value_enum, default_value_t = Format::Csv)]
    format: Format,

    /// Print JSON, including the data of overlays and the PDOs
    #[arg(long, conflicts_with = "format")]
    json: bool,
}

#[derive(clap::ValueEnum, Clone, Copy, Debug)]
enum Format {
    /// Comma-separated values, with a header
    Csv,
    /// A Markdown table
    Md,
}

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    let sheet = args.device.load()?;
    let text = match args.format {
        _ if args.json => format!("{:#}\n", dump::json(&sheet.device)),
        Format::Csv => dump::csv(&sheet.device),
        Format::Md => dump::md(&sheet.device),
    };
    let mut stdout = output::raw_stdout();
    stdout.write_all(text.as_bytes())?;
    stdout.flush()?;
    Ok(if show_errors(&sheet) { Outcome::Found } else { Outcome::Clean })
}
