//! Emergency codes.

use crate::checker::{Against, Checker};
use crate::drive::Case;
use crate::manual::Row;

/// Compares the code of a row of `emergency.csv` with the data of the frame that the drive sends, high byte first, and
/// its meaning with what `terms.csv` has for the overlay's `EmergencyCode`. `heard` is `None` where the drive cannot send.
pub(crate) fn check(checker: &mut Checker<'_>, case: &Case<'_>, row: &Row, code: u16, heard: Option<&[u8]>) {
    let term = case.manual.cell("terms.csv", &format!("EmergencyCode:0x{code:04X}"), "printed");
    checker.cell(row, "meaning", Against::Manual, term);
    let bytes = code.to_be_bytes();
    for (column, byte) in ["byte_0", "byte_1"].into_iter().zip(bytes).filter(|(column, _)| row.has(column)) {
        checker.cell(row, column, Against::Manual, format!("{byte:02X}"));
    }
    if let Some(heard) = heard {
        checker.that(row, "code", Against::Drive, heard.starts_with(&bytes), format!("{heard:02X?}"));
    }
}
