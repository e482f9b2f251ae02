//! `lexican eds fmt`: data sheets in the form of CiA 306.

use std::io::Write;
use std::path::Path;

use lexican_eds::Input;
use lexican_eds::fmt::normalise;

use crate::device::{Loaded, input};
use crate::output::{self, Failure, Outcome, warn, write_whole};

/// Bring data sheets into the spelling and layout of CiA 306; comments stay where they are
///
/// Prints the result, unless --write or --check says otherwise. No value, object or order is changed, and
/// a file that is written keeps its encoding.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// EDS or DCF files; without --write or --check just one
    #[arg(required = true, value_name = "FILE")]
    files: Vec<String>,

    /// Only say which files would change: exit code 1 when any would
    #[arg(long, conflicts_with = "write")]
    check: bool,

    /// Write the files that change, each wholly or not at all
    #[arg(long)]
    write: bool,
}

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    if args.files.len() > 1 && !args.check && !args.write {
        return Err(Failure::new("several files cannot be printed one after the other").help("use --write or --check"));
    }
    if let Some(name) = args.files.iter().find(|name| args.write && !Path::new(name).is_file()) {
        // What is wrong with it may be told better.
        input(name)?;
        return Err(Failure::new(format_args!("{name} is not a file that could be written")));
    }
    let mut outcome = Outcome::Clean;
    for name in &args.files {
        let Input { eds, .. } = readable(input(name)?)?;
        let formatted = normalise(&eds);
        let changes = formatted != eds.text();
        if args.check && changes {
            writeln!(output::stdout(), "{name}")?;
            outcome = Outcome::Found;
        } else if args.write && changes {
            // Old tools go on reading a file in the encoding that it had.
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

/// The same texts, when they are those of a data sheet: nothing else shall be tidied up.
fn readable(input: Input) -> Result<Input, Failure> {
    Loaded::new(input).map(|loaded| loaded.input)
}
