//! `lexican eds dump`: the object dictionary as a table.

use std::io::Write;

use lexican_eds::dump;

use crate::device::DeviceArgs;
use crate::output::{self, Failure, Outcome};

/// Print the object dictionary of a data sheet
///
/// One row per entry that an SDO can address; the headers of arrays and records are no rows. Exit code 1
/// when the data sheet has errors: what could be read of it is printed all the same.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    #[command(flatten)]
    device: DeviceArgs,

    /// How to print it
    #[arg(long, value_enum, default_value_t = Format::Csv)]
    format: Format,
}

#[derive(clap::ValueEnum, Clone, Copy, Debug)]
enum Format {
    /// Comma-separated values, with a header
    Csv,
    /// JSON, with what the overlay knows and the PDOs
    Json,
    /// A Markdown table
    Md,
}

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    let loaded = args.device.load()?;
    let text = match args.format {
        Format::Csv => dump::csv(&loaded.device),
        Format::Json => format!("{:#}\n", dump::json(&loaded.device)),
        Format::Md => dump::md(&loaded.device),
    };
    let mut stdout = output::raw_stdout();
    stdout.write_all(text.as_bytes())?;
    stdout.flush()?;
    Ok(if loaded.show_errors() { Outcome::Found } else { Outcome::Clean })
}
