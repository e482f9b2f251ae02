//! `lexican eds diff`: compares two data sheets.

use std::io::Write;
use std::path::PathBuf;

use anstyle::{AnsiColor, Style};
use lexican_eds::diff::{ChangeKind, diff, json};

use crate::device::load;
use crate::output::{self, Failure, Outcome, styled};

/// Compare two data sheets by object, regardless of order and spelling
///
/// A line is a difference: + added, - removed, ~ changed. Exit code 0 if they are equivalent, 1 if they differ, 2 if one cannot be read.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// An EDS, DCF or XDD file, or a device that lexican knows
    #[arg(value_name = "FILE|DEVICE")]
    before: String,

    /// The data sheet to compare it with
    #[arg(value_name = "FILE|DEVICE")]
    after: String,

    /// Corrections and meanings in addition to both data sheets (TOML); may be given several times
    #[arg(long, value_name = "FILE")]
    overlay: Vec<PathBuf>,

    /// Print a JSON array
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    let (before, after) = (load(&args.before, &args.overlay)?, load(&args.after, &args.overlay)?);
    let changes = diff(&before.device, &after.device);
    let mut stdout = output::stdout();
    if args.json {
        writeln!(stdout, "{:#}", json(&changes))?;
    } else {
        for change in &changes {
            writeln!(stdout, "{}", styled(style(&change.kind), change))?;
        }
    }
    stdout.flush()?;
    Ok(if changes.is_empty() { Outcome::Clean } else { Outcome::Found })
}

fn style(kind: &ChangeKind) -> Style {
    match kind {
        ChangeKind::Added => AnsiColor::Green.on_default(),
        ChangeKind::Removed => AnsiColor::Red.on_default(),
        ChangeKind::Changed { .. } => AnsiColor::Yellow.on_default(),
    }
}
