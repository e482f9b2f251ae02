//! The data sheet of the device under test.

use std::cmp::Reverse;
use std::fmt::{self, Display};

use lexican_eds::model::Device;
use lexican_eds::{Input, Severity, Source, load};
use sha2::{Digest, Sha256};

/// How many findings are named; `lexican eds lint` shows all.
const NAMED: usize = 10;

/// The data sheet of the device, and what the linter finds in it.
#[derive(Debug)]
pub struct Sheet {
    /// The content of the data sheet.
    pub device: Device,
    /// Errors and warnings of the linter, with their places.
    pub findings: Findings,
    /// Whether the data sheet is so wrong that a test would mean nothing.
    pub is_unfit: bool,
    /// The file and its overlays: the name and the SHA-256 of each, as `sha256sum` prints it.
    pub checksums: Vec<(String, String)>,
}

/// The findings of the linter, a line each, errors first. `Display` shows the first ten, and the command that shows
/// all.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Findings {
    /// All findings.
    pub lines: Vec<String>,
    /// The arguments for `lexican eds lint`.
    files: String,
}

impl Sheet {
    /// Reads a data sheet and its overlays.
    #[must_use]
    pub fn of(input: &Input) -> Self {
        let (mut device, diagnostics) = load(input);
        // Some data sheets of drives have no device type; the device has it in 1000h.
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
    /// The command that shows all findings with their remedies.
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
