//! The kinds of buses of this command: one row each.

use std::ffi::OsStr;
use std::fmt::Write as _;

use clap_complete::engine::CompletionCandidate;
use lexican_runtime::host::schemes::{LOG, SLCAN, SOCKETCAN};
use lexican_runtime::host::url::{Scheme, Takes};
use lexican_runtime::host::{BusUrl, BusUrlError, Pace, Replay};
use lexican_toolbox::log::Reader;

use super::failure::open_failure;
use super::kind::{Bus, Kind, Simulated};
use super::{profibus, serial, simulation};
use crate::output::Failure;

/// A new kind is a row here and a file of its own.
pub(crate) static KINDS: [Kind; 6] = [
    Kind { scheme: &SOCKETCAN, open: socketcan, simulated: Simulated::Shared },
    Kind { scheme: &SLCAN, open: link, simulated: Simulated::Alone },
    serial::KIND,
    profibus::KIND,
    simulation::KIND,
    Kind {
        scheme: &Scheme { what: "a recorded log, of any format that `convert` takes", ..LOG },
        open: log,
        simulated: Simulated::Never("a log takes no frames: there is no bus for the device", None),
    },
];

impl Kind {
    pub(crate) fn of(url: &BusUrl) -> &'static Kind {
        let kind = KINDS.iter().find(|kind| kind.scheme.name == url.scheme().name);
        kind.expect("it was parsed by this list")
    }
}

/// Parses the URL of a bus.
pub(crate) fn url(text: &str) -> Result<BusUrl, BusUrlError> {
    BusUrl::among(&KINDS.each_ref().map(|kind| kind.scheme), text)
}

/// The bit rate in the URL of a CAN bus, in bit/s.
pub(crate) fn bit_rate(url: &BusUrl) -> Option<u32> {
    let is_can = matches!(Kind::of(url).simulated, Simulated::Shared | Simulated::Alone);
    url.rate("bitrate").filter(|_| is_can)
}

/// The short help of `--bus`.
pub(super) fn examples() -> String {
    let examples: Vec<_> = KINDS.iter().map(|kind| kind.scheme.example).collect();
    format!("The bus: {}", examples.join(", "))
}

/// The long help of `--bus`.
pub(super) fn help() -> String {
    let mut help = "The bus:\n".to_owned();
    for Kind { scheme, .. } in &KINDS {
        // Writing to a string cannot fail.
        let _ = write!(help, "\n  {}\n      {}\n", scheme.example, scheme.what);
        for parameter in scheme.parameters {
            let values = if let Takes::Words(words) = parameter.takes { words.join("|") } else { String::new() };
            let _ = writeln!(help, "      {}={values}  {}", parameter.key, parameter.what);
        }
    }
    help
}

/// Completions for the URL of a bus.
pub(super) fn complete(current: &OsStr) -> Vec<CompletionCandidate> {
    let schemes = KINDS.iter().map(|kind| kind.scheme);
    let begun = schemes.filter(|scheme| scheme.example.starts_with(&*current.to_string_lossy()));
    begun.map(|scheme| CompletionCandidate::new(scheme.example).help(Some(scheme.what.into()))).collect()
}

/// Opens a bus that needs only a link.
fn link(url: &BusUrl, _: Pace) -> Result<Bus, Failure> {
    let link = url.open().map_err(|error| open_failure(&error))?;
    Ok(Bus::of(link, Vec::new()))
}

fn socketcan(url: &BusUrl, pace: Pace) -> Result<Bus, Failure> {
    if url.place() == "pty" {
        return Err(Failure::new("pty is a bus that `lexican simulate` makes")
            .help("name one of the terminals that it prints, such as --bus slcan:/dev/pts/3"));
    }
    link(url, pace)
}

/// Opens a log of any format.
fn log(url: &BusUrl, _: Pace) -> Result<Bus, Failure> {
    let frames = Reader::open(url.place().as_ref(), None)?.into_frames(url.get("interface").map(str::to_owned));
    let link = Replay::of(frames, url.pace().unwrap_or_default()).map_err(Failure::new)?;
    Ok(Bus::of(Box::new(link), Vec::new()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use lexican_runtime::host::schemes::SCHEMES;

    #[test]
    fn every_link_of_the_runtime_is_a_kind_of_bus() {
        assert!(SCHEMES.iter().all(|scheme| KINDS.iter().any(|kind| kind.scheme.name == scheme.name)));
    }

    #[test]
    fn every_kind_is_in_the_page_and_its_example_is_understood() {
        let page = include_str!("../../README.md");
        for Kind { scheme, .. } in &KINDS {
            assert_eq!(url(scheme.example).map(|url| url.scheme().name), Ok(scheme.name));
            let row = format!("| `{}` | {} |", scheme.example, scheme.what);
            assert!(page.contains(&row), "cli/README.md lacks {row}");
        }
    }
}
