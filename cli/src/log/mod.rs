//! Logs: `lexican record`, `replay` and `convert`.

pub(crate) mod convert;
pub(crate) mod record;
pub(crate) mod replay;
mod trace;

use std::fs;
use std::io;
use std::path::Path;

use lexican_runtime::Duration;
use lexican_toolbox::bus::cob_ids::CobIds;
use lexican_toolbox::log::{Format, LogError, Reader, Selection, Skipped, WriteError};

use crate::output::{Failure, note, plural, reason, warn};
use lexican_toolbox::text::duration::time;

/// Which frames of a log are meant.
#[derive(clap::Args, Debug)]
struct SelectionArgs {
    /// Only these COB-IDs, in hexadecimal: 185,280-28F; with eight digits for extended ones
    #[arg(long, value_name = "COB-IDS")]
    cob_id: Option<CobIds>,

    /// None of these COB-IDs
    #[arg(long, value_name = "COB-IDS")]
    except: Option<CobIds>,

    /// Only the frames of this interface
    #[arg(long, value_name = "NAME")]
    interface: Option<String>,

    /// Only from this time after the log's first frame on
    #[arg(long, value_name = "TIME", value_parser = time)]
    after: Option<Duration>,

    /// Only until this time after the log's first frame
    #[arg(long, value_name = "TIME", value_parser = time)]
    before: Option<Duration>,
}

impl SelectionArgs {
    fn selection(&self) -> Selection {
        let SelectionArgs { cob_id, except, interface, after, before } = self;
        Selection {
            only: cob_id.clone(),
            except: except.clone(),
            interface: interface.clone(),
            after: *after,
            before: *before,
        }
    }
}

/// The file name for stdin and stdout.
const PIPE: &str = "-";

fn is_pipe(path: &Path) -> bool {
    path == Path::new(PIPE)
}

/// Opens a log or stdin; also returns its size, if known.
fn open(path: &Path, format: Option<Format>) -> Result<(Reader, Option<u64>), Failure> {
    if is_pipe(path) {
        return Ok((Reader::new("stdin", io::stdin(), format)?, None));
    }
    Ok((Reader::open(path, format)?, fs::metadata(path).ok().map(|data| data.len()).filter(|len| *len > 0)))
}

/// The format of a file to write: as given, else by its extension.
fn format_of(path: &Path, given: Option<Format>, option: &str) -> Result<Format, Failure> {
    given.or_else(|| Format::of_path(path)).ok_or_else(|| {
        Failure::new(format_args!("which format is {}?", path.display()))
            .help(format_args!("name it with {option}: {}", Format::names()))
    })
}

/// Reports what was left out of a log.
fn remark_on(skipped: Skipped) {
    let parts = [
        (skipped.fd, "frame of CAN FD", "frames of CAN FD"),
        (skipped.errors, "error frame", "error frames"),
        (skipped.other, "other entry", "other entries"),
    ];
    let parts = parts.iter().filter(|(count, ..)| *count > 0);
    let parts: Vec<_> =
        parts.map(|(count, one, more)| format!("{count} {}", if *count == 1 { one } else { more })).collect();
    if !parts.is_empty() {
        note(format_args!("left out: {}", parts.join(", ")));
    }
    if skipped.cut {
        warn("the log ends in the middle of a frame: it was not finished, or is not whole");
    }
}

/// `1 frame`, `2 frames`.
fn frames(count: u64) -> String {
    plural(usize::try_from(count).unwrap_or(usize::MAX), "frame")
}

/// The failure of writing; none if the reader of a pipe has left.
fn write_failure(path: &Path, error: WriteError) -> Failure {
    match error {
        WriteError::Io(error) if is_pipe(path) => error.into(),
        WriteError::Io(error) => Failure::file("write", path, &error),
        error => Failure::new(error),
    }
}

impl From<LogError> for Failure {
    fn from(error: LogError) -> Self {
        match &error {
            LogError::Io { name, error: cause } => {
                let failure = Failure::new(format_args!("cannot read the log {name}: {}", reason(cause)));
                match cause.kind() {
                    io::ErrorKind::NotFound => {
                        failure.help("`lexican record --bus can0 -o FILE` writes a log; is the path right?")
                    }
                    _ => failure,
                }
            }
            LogError::Unknown { .. } => {
                Failure::new(&error).help("if it is one of them, `lexican convert --from FORMAT` reads it as such")
            }
            _ => Failure::new(error),
        }
    }
}

/// Parses a factor greater than zero.
fn factor(text: &str) -> Result<f64, String> {
    let factor = text.parse().ok().filter(|factor: &f64| (1e-3..=1e6).contains(factor));
    factor.ok_or_else(|| format!("{text:?} is no factor from 0.001 to 1000000, such as 10 or 0.5"))
}

/// Parses a number of bytes: `500k`, `10M`, `1G`.
fn size(text: &str) -> Result<u64, String> {
    let units = [("k", 1_000), ("M", 1_000_000), ("G", 1_000_000_000), ("", 1)];
    let found = units.iter().find_map(|(unit, factor)| {
        let digits = text.strip_suffix(unit)?;
        let number: u64 = digits.parse().ok().filter(|_| !digits.starts_with('+'))?;
        number.checked_mul(*factor)
    });
    found.filter(|size| *size > 0).ok_or_else(|| format!("{text:?} is no size such as 500k, 10M or 1G"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_and_factors_are_positive_numbers() {
        let sizes = ["1", "500k", "10M", "2G", "0", "", "k", "-1", "+1", "1.5M", "99999999999G"];
        let expected = [Some(1), Some(500_000), Some(10_000_000), Some(2_000_000_000)];
        let expected: Vec<_> = expected.into_iter().chain([None; 7]).collect();
        assert_eq!(sizes.map(|text| size(text).ok()).to_vec(), expected);
        assert_eq!(
            ["10", "0.5", "0", "-1", "NaN", "inf"].map(|text| factor(text).ok()),
            [Some(10.0), Some(0.5), None, None, None, None]
        );
    }
}
