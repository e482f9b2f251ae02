//! `lexican eds fmt`: formats data sheets.

use std::io::Write;
use std::path::Path;

use lexican_eds::Input;
use lexican_eds::fmt::normalise;

use super::file::must_be_file;
use crate::output::{self, Failure, Outcome, warn, write_whole};
use lexican_toolbox::data_sheet::{DataSheet, find};

/// Format data sheets in the spelling and layout of CiA 306, or XML by its depth
///
/// Prints the result, unless --write or --check is given. Values, objects, comments and their order stay as they
/// are, and a file that is written keeps its encoding.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// EDS, DCF, XDD or XDC files; only one without --write or --check
    #[arg(required = true, value_name = "FILE")]
    files: Vec<String>,

    /// Only list the files that would change; exit code 1 if there are any
    #[arg(long, conflicts_with = "write")]
    check: bool,

    /// Replace the files that change
    #[arg(long)]
    write: bool,
}

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    if args.files.len() > 1 && !args.check && !args.write {
        return Err(Failure::new("several files cannot be printed one after the other").help("use --write or --check"));
    }
    if args.write {
        args.files.iter().try_for_each(|name| must_be_file(name))?;
    }
    let mut outcome = Outcome::Clean;
    for name in &args.files {
        let Input { eds, .. } = DataSheet::new(find(name)?)?.input;
        let formatted = normalise(&eds);
        let changes = formatted != eds.text();
        if args.check && changes {
            writeln!(output::stdout(), "{name}")?;
            outcome = Outcome::Found;
        } else if args.write && changes {
            // Keep the encoding, because old tools may read only that one.
            match eds.encoding().encode(&formatted) {
                Some(bytes) => write_whole(Path::new(name), &bytes)?,
                None => {
                    write_whole(Path::new(name), formatted.as_bytes())?;
                    warn(format_args!("{name} was in {}, and is in UTF-8 now", eds.encoding().name()));
                }
            }
            writeln!(output::stdout(), "{name}")?;
        } else if !args.check && !args.write {
            let mut stdout = output::raw_stdout();
            stdout.write_all(formatted.as_bytes())?;
            stdout.flush()?;
        }
    }
    Ok(outcome)
}
