//! How a drive is moved: what lexican knows of it, or else what its data sheet says.

use lexican_driver::{Description, NotADrive};
use lexican_eds::{Input, library};

/// The description of a drive by its data sheet.
///
/// # Errors
///
/// What the data sheet lacks for it.
pub fn describe(input: &Input) -> Result<&'static Description, NotADrive> {
    described_by_hand(input).map_or_else(|| Description::of_data_sheet(input), Ok)
}

/// What lexican knows of a device of the library.
pub(super) fn described_by_hand(input: &Input) -> Option<&'static Description> {
    let shipped = library::all().iter().find(|shipped| shipped.input().eds.name() == input.eds.name())?;
    lexican_registry::find(shipped.id).map(|drive| drive.description)
}
