//! The faults and warnings of chapter 6.1, from the names of the emergency codes in the data sheet: a letter, a number
//! and a text. `F` is a fault, `n` a warning.

pub use lexican_driver::Cause;
use lexican_driver::{ByteOrder, Code, Codes};
use lexican_runtime::object::{Enumeration, ValueName};

use crate::od::EmergencyCode;

/// The kind of an emergency code.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// 0000h.
    NoError,
    Fault,
    /// A warning, or a code that the manual reserves.
    Notice,
}

const NAMES: &[ValueName<'static>] = EmergencyCode::NAMES;

/// The faults, which lead to the state FAULT.
pub const FAULTS: &[Code] = &codes::<{ count(Kind::Fault) }>(Kind::Fault);

/// The warnings, and the codes that the manual reserves.
pub const NOTICES: &[Code] = &codes::<{ count(Kind::Notice) }>(Kind::Notice);

/// The emergency codes, for the driver.
pub const CODES: Codes = Codes { faults: FAULTS, notices: NOTICES, order: ByteOrder::LowFirst };

/// The fault or warning with this label, such as "F439" or "n125"; the first one if two codes have the same label.
#[must_use]
pub fn find(label: &str) -> Option<&'static Code> {
    FAULTS.iter().chain(NOTICES).find(|code| code.label == label)
}

const fn kind(name: &ValueName<'static>) -> Kind {
    match name.name.as_bytes() {
        _ if name.raw == 0 => Kind::NoError,
        [b'F', ..] => Kind::Fault,
        _ => Kind::Notice,
    }
}

const fn is(name: &ValueName<'static>, wanted: Kind) -> bool {
    kind(name) as u8 == wanted as u8
}

const fn count(wanted: Kind) -> usize {
    let (mut count, mut row) = (0, 0);
    while row < NAMES.len() {
        count += is(&NAMES[row], wanted) as usize;
        row += 1;
    }
    count
}

const fn codes<const N: usize>(wanted: Kind) -> [Code; N] {
    let mut codes = [Code { number: 0, label: "", text: "" }; N];
    let (mut count, mut row) = (0, 0);
    while row < NAMES.len() {
        if is(&NAMES[row], wanted) {
            codes[count] = code(&NAMES[row]);
            count += 1;
        }
        row += 1;
    }
    codes
}

const fn code(name: &ValueName<'static>) -> Code {
    let number = name.raw as u16;
    let (label, text) = name.name.split_at(label_len(name.name.as_bytes()));
    match text.as_bytes() {
        [b' ', ..] => Code { number, label, text: text.split_at(1).1 },
        // Eight codes have no text in the manual.
        [] => Code { number, label, text: "without a description" },
        _ => Code { number, label, text },
    }
}

/// The length of the label: a letter and three digits, or nothing.
const fn label_len(name: &[u8]) -> usize {
    match name {
        [b'F' | b'n', b'0'..=b'9', b'0'..=b'9', b'0'..=b'9', ..] => 4,
        _ => 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_has_its_label_and_text() {
        assert_eq!((FAULTS.len(), NOTICES.len(), FAULTS.len() + NOTICES.len() + 1), (124, 43, NAMES.len()));
        let texts = [0x8611, 0x8781, 0x4382, 0x73A9].map(|code| CODES.cause(code).to_string());
        assert_eq!(
            texts,
            [
                "F439 (8611): Following error",
                "n125 (8781): Fieldbus PLL unlocked",
                "F535 (4382): without a description",
                "reserved 73A9h",
            ]
        );
        assert_eq!(find("n125").map(|code| code.number), Some(0x8781));
        assert_eq!(find("F999"), None);
    }
}
