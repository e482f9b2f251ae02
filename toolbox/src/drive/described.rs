//! How a drive is moved: what lexican knows of it, or else what its data sheet says.

use kollmorgen_akd::driver::AKD;
use lexican_driver::{Description, NotADrive};
use lexican_eds::{Input, library};
use siko_ag02::driver::AG02;
use siko_ag03_1::driver::AG03_1;

/// The devices of the library of which lexican knows more than their data sheet says.
const DESCRIBED: [(&str, &Description); 3] = [("kollmorgen/akd", &AKD), ("siko/ag02", &AG02), ("siko/ag03-1", &AG03_1)];

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
    DESCRIBED.iter().find(|(id, _)| *id == shipped.id).map(|(_, description)| *description)
}
