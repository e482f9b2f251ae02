//! Emergency codes.

use lexican_driver::{Cause, Codes};

use crate::checker::{Against, Checker};
use crate::drive::Case;
use crate::manual::Row;
use crate::rig::{Simulator, once};

/// Compares the code of a row of `emergency.csv` with the data of the frame that the drive sends, high byte first, and
/// its meaning with that in `terms.csv` for the overlay's `EmergencyCode`. `heard` is `None` where the drive cannot
/// send.
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

/// What the drive does while it has an error: the data of its EMCY, and whether it is in the state FAULT.
pub(crate) type Raised = fn(u16) -> (Vec<u8>, bool);

/// Compares `emergency.csv` if its errors have numbers, such as `F439` for a fault or `n125` for a warning, and texts.
/// The names in the enumeration `EmergencyCode` consist of both; the driver has them as label and text.
pub(crate) fn numbers<S: Simulator>(checker: &mut Checker<'_>, case: &Case<'_>, codes: &Codes, raised: Raised) {
    let named = case.sheet.device.enumerations.get("EmergencyCode").map_or(&[][..], |codes| &codes.values);
    for named in named {
        let Some(row) = checker.row("emergency.csv", &format!("{:04X}", named.value)) else { continue };
        let code = u16::try_from(named.value).unwrap_or(0);
        let (number, text) = named.name.split_once(' ').unwrap_or((&named.name, ""));
        let number = match number {
            "no" => "0",
            "reserved" => "-",
            number => number,
        };
        checker.cell(row, "number", Against::Sheet, number);
        let printed = row.get("description").trim_end_matches('.');
        let warning = printed.strip_prefix("Warning:").map_or(printed, str::trim);
        let said = match number {
            "0" => printed == "Emergency error free",
            "-" => matches!(printed, "" | "Reserved"),
            _ => warning == text && (warning == printed || number.starts_with('n')),
        };
        checker.that(row, "description", Against::Sheet, said, &named.name);
        if code == 0 {
            checker.that(row, "code", Against::Code, codes.cause(0) == Cause::NoError, "a fault");
            continue;
        }
        let (known, is_fault) = match codes.cause(code) {
            Cause::Fault(known) => (Some(known), true),
            Cause::Notice(known) => (Some(known), false),
            _ => (None, false),
        };
        let label = known.map_or("", |known| known.label);
        checker.that(row, "number", Against::Code, number == label || number == "-" && label.is_empty(), label);
        let same = known.is_some_and(|known| known.text == text || text.is_empty() || number == "-");
        checker.that(row, "description", Against::Code, same, known.map_or("", |known| known.text));
        let (heard, fails) = once::<S, _>(code, || raised(code));
        checker.that(row, "code", Against::Drive, heard.starts_with(&code.to_le_bytes()), format!("{heard:02X?}"));
        let agrees = is_fault == fails && is_fault == number.starts_with('F');
        checker.that(row, "number", Against::Drive, agrees, if fails { "a fault" } else { "no fault" });
    }
}
