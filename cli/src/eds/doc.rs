//! `lexican eds doc`: a data sheet for people.

use std::path::PathBuf;

use lexican_toolbox::doc;

use crate::device::{DeviceArgs, show_errors};
use crate::output::{Failure, ForceArgs, Outcome};

/// Write a data sheet as one page for people, to search in and to print
///
/// What the device is and can do; its PDOs bit by bit; its emergency codes; each object with types, defaults and values of a DCF,
/// limits, units, named values and bits; and what lint finds. The page loads nothing. All nodes of a machine:
/// `lexican machine export --format html`. Exit code 1 if the data sheet has errors; the page is written anyway.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    #[command(flatten)]
    device: DeviceArgs,

    /// The file to write
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,

    /// HTML has pictures and a search; Markdown is the default of a file that ends with .md
    #[arg(long, value_parser = ["html", "markdown"])]
    format: Option<String>,

    #[command(flatten)]
    force: ForceArgs,
}

const EXAMPLES: &str = "\
Examples:
    lexican eds doc siko/ag03-1 -o ag03-1.html
    lexican eds doc valve.eds --overlay valve.toml -o valve.html
    lexican eds doc station.dcf -o station.md";

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    args.device.guard(&args.output)?;
    args.force.guard(&args.output, [])?;
    let sheet = args.device.load()?;
    let ends_with_md = args.output.extension().is_some_and(|extension| extension == "md");
    let is_markdown = args.format.as_ref().map_or(ends_with_md, |format| format == "markdown");
    let format = if is_markdown { doc::Format::Markdown } else { doc::Format::Html };
    args.force.write(&args.output, doc::page(&sheet, format).as_bytes())?;
    Ok(if show_errors(&sheet) { Outcome::Found } else { Outcome::Clean })
}
