//! The data sheet that a device is tested by.

use std::cmp::Reverse;
use std::fmt::{self, Display};

use lexican_eds::model::Device;
use lexican_eds::{Input, Severity, Source, load};
use sha2::{Digest, Sha256};

/// So many findings are named; `lexican eds lint` has all of them.
const NAMED: usize = 10;

/// The data sheet of the device, and what the linter finds in it.
#[derive(Debug)]
pub struct Sheet {
    /// What the data sheet says.
    pub device: Device,
    /// Errors and warnings of the linter, with their places.
    pub findings: Findings,
    /// Nothing correct can be made of the data sheet, so that a test by it would mean nothing.
    pub is_unfit: bool,
    /// The file and its overlays: the name of each, and the SHA-256 of its bytes as `sha256sum` prints it.
    pub checksums: Vec<(String, String)>,
}

/// What the linter finds in a data sheet, a line each, errors first. As text they are the first ten, and how to see the others.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Findings {
    /// All of them.
    pub lines: Vec<String>,
    /// What `lexican eds lint` needs to find them.
    files: String,
}

impl Sheet {
    /// Reads a data sheet and its overlays.
    #[must_use]
    pub fn of(input: &Input) -> Self {
        let (mut device, diagnostics) = load(input);
        // Some drives say what they are in 1000h, and their data sheets do not.
        let is_drive = [0x6040, 0x6041, 0x6060].iter().all(|index| device.object(*index).is_some());
        if device.profile.is_none() && is_drive {
            device.profile = Some(402);
        }
        let has_type = device.entry(0x1000, 0).is_some();
        let mut grave: Vec<_> = diagnostics.iter().filter(|finding| finding.severity > Severity::Note).collect();
        grave.sort_by_key(|finding| Reverse(finding.severity));
        let is_unfit = !has_type || grave.first().is_some_and(|finding| finding.severity == Severity::Error);
        let lacks = (!has_type).then(|| format!("{}: 1000h, the device type, cannot be read in it", input.eds.name()));
        let lines = lacks.into_iter().chain(grave.into_iter().map(|finding| finding.render_short(input))).collect();
        let overlays = input.overlays.iter().map(|overlay| format!(" --overlay {}", overlay.name()));
        let files = input.eds.name().to_owned() + &overlays.collect::<String>();
        let checksums =
            [&input.eds].into_iter().chain(&input.overlays).map(|source| (source.name().to_owned(), checksum(source)));
        Sheet { device, findings: Findings { lines, files }, is_unfit, checksums: checksums.collect() }
    }
}

fn checksum(source: &Source) -> String {
    let bytes = source.to_bytes().unwrap_or_else(|| source.text().as_bytes().to_vec());
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

impl Findings {
    /// The command that shows all of them with what to do about each.
    #[must_use]
    pub fn command(&self) -> String {
        format!("lexican eds lint {}", self.files)
    }
}

impl Display for Findings {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.lines[..self.lines.len().min(NAMED)].join("\n"))?;
        match self.lines.len().saturating_sub(NAMED) {
            0 => Ok(()),
            more => write!(f, "\nand {more} more: {}", self.command()),
        }
    }
}
