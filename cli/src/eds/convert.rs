//! `lexican eds convert`: a data sheet in another format.

use std::path::PathBuf;

use lexican_eds::convert::{Format, losses};
use serde_json::json;

use crate::device::{DeviceArgs, show_errors};
use crate::output::{Failure, ForceArgs, Outcome, plural, print_result, warn};

/// Write a data sheet as EDS, DCF, XDD or XDC
///
/// The name of the output says which. An XDD or XDC that is written says all that an EDS or DCF does, so that nothing is lost on the
/// way there and back. What the format cannot say, such as units in an EDS and values of a configured device in an XDD, is named on
/// stderr.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    #[command(flatten)]
    device: DeviceArgs,

    /// The file to write: .eds, .dcf, .xdd or .xdc
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,

    #[command(flatten)]
    force: ForceArgs,

    /// Print a JSON object: file, objects, entries and what is lost
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
    lexican eds convert drive.eds -o drive.xdd
    lexican eds convert siko/ag03-1 -o ag03.xdd
    lexican eds convert project.xdd -o project.eds";

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    let path = &args.output;
    let format = Format::of(path).ok_or_else(|| {
        Failure::new(format_args!("{} is no name of a data sheet", path.display()))
            .help("end it with .eds, .dcf, .xdd or .xdc")
    })?;
    args.device.guard(path)?;
    args.force.guard(path, [])?;
    let sheet = args.device.load()?;
    let text = format.write(&sheet.device);
    let unread = sheet.diagnostics.iter().filter(|finding| finding.code == "xdd::not-read");
    let unread = unread.map(|finding| finding.message.clone());
    let lost: Vec<String> = unread.chain(losses(&sheet.device, &text)).collect();
    args.force.write(path, text.as_bytes())?;
    let file = path.display().to_string();
    for lost in &lost {
        warn(format_args!("{file} lacks {}", lost.trim_start_matches("not read: ")));
    }
    let (objects, entries) = (sheet.device.objects.len(), sheet.device.entries().count());
    let result = json!({ "file": file, "objects": objects, "entries": entries, "lost": lost });
    print_result(args.json, result, format!("{file}: {}", plural(objects, "object")))?;
    Ok(if show_errors(&sheet) { Outcome::Found } else { Outcome::Clean })
}
