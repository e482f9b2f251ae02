//! `lexican eds fmt`: data sheets in the form of CiA 306.

use std::io::Write;
use std::path::Path;

use lexican_eds::fmt::normalise;
use lexican_eds::text::Encoding;
use lexican_eds::{Input, Source};

use crate::device::{Loaded, input};
use crate::output::{self, Failure, Outcome, write_whole};

/// Bring data sheets into the spelling and layout of CiA 306; comments stay where they are
///
/// Prints the result, unless --write or --check says otherwise. No value, object or order is changed.
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
            write_whole(Path::new(name), &encoded(&eds, &formatted))?;
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

/// The bytes of a text in the encoding that the file had, so that old tools go on reading it.
fn encoded(eds: &Source, text: &str) -> Vec<u8> {
    match eds.encoding() {
        Encoding::Windows1252 => windows_1252(text),
        Encoding::Utf8 | Encoding::Utf8WithMark | Encoding::Utf16 => text.as_bytes().to_vec(),
    }
}

/// What reads back as `text`: the reader's own table, upside down.
fn windows_1252(text: &str) -> Vec<u8> {
    // A byte from 80h on is no UTF-8 by itself, so it is read in code page 1252.
    let high: Vec<(char, u8)> =
        (0x80..=0xFF).filter_map(|byte| Some((Source::from_bytes("", &[byte]).text().chars().next()?, byte))).collect();
    let byte = |letter: char| match u8::try_from(letter) {
        Ok(byte) if byte.is_ascii() => byte,
        _ => high.iter().find(|(known, _)| *known == letter).map_or(b'?', |(_, byte)| *byte),
    };
    text.chars().map(byte).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn code_page_1252_comes_back_as_it_was() {
        let bytes: Vec<u8> = (0x20..=0xFF).collect();
        let source = Source::from_bytes("x", &bytes);
        assert_eq!(source.encoding(), Encoding::Windows1252);
        assert_eq!(encoded(&source, source.text()), bytes);
    }
}
