//! Descriptions of drives: from the drive's crate, or else from the data sheet.

use lexican_driver::{Description, NotADrive};
use lexican_eds::{Input, library};

/// The description of a drive with this data sheet. Errors: what the data sheet lacks.
pub fn describe(input: &Input) -> Result<&'static Description, NotADrive> {
    described_by_hand(input).map_or_else(|| Description::of_data_sheet(input), Ok)
}

/// The description in the crate of a drive that lexican knows.
pub(super) fn described_by_hand(input: &Input) -> Option<&'static Description> {
    let shipped = library::all().iter().find(|shipped| shipped.input().eds.name() == input.eds.name())?;
    lexican_registry::find(shipped.id).map(|drive| drive.description)
}
