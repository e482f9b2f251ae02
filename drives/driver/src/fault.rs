//! Emergency codes of drives, and their meaning.

use std::fmt;

use lexican_runtime::wire::emcy::ErrorCode;

/// An emergency code in a drive's manual.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Code {
    /// The code of EMCY and 1003h.
    pub number: u16,
    /// The name in the manual, such as a letter; empty if it has none.
    pub label: &'static str,
    /// What happened.
    pub text: &'static str,
}

/// The codes of a drive.
#[derive(Clone, Copy, Debug)]
pub struct Codes {
    /// The codes that lead to FAULT.
    pub faults: &'static [Code],
    /// The codes that do not lead to FAULT.
    pub notices: &'static [Code],
    /// The order of the two bytes of a code.
    pub order: ByteOrder,
}

/// The byte order of a number or a text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ByteOrder {
    /// Little-endian, as in CiA 301.
    LowFirst,
    /// Big-endian.
    HighFirst,
    /// The manual contradicts itself: whichever order gives a code of the table counts. So no code of the table may be
    /// the byte-swapped form of another.
    Either,
}

/// The meaning of an emergency code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// The fault has been reset.
    NoError,
    /// The drive reports this fault.
    Fault(Code),
    /// A message that is not a fault.
    Notice(Code),
    /// A code that is not in the table.
    Unknown(u16),
}

impl Codes {
    /// The meaning of a code that came in the byte order of CiA 301, in an emergency or as an entry of 1003h.
    #[must_use]
    pub fn cause(&self, code: u16) -> Cause {
        let swapped = code.swap_bytes();
        let known = match self.order {
            ByteOrder::LowFirst => self.find(code),
            ByteOrder::HighFirst => self.find(swapped),
            ByteOrder::Either => self.find(code).or_else(|| self.find(swapped)),
        };
        known.unwrap_or(Cause::Unknown(if self.order == ByteOrder::HighFirst { swapped } else { code }))
    }

    fn find(&self, code: u16) -> Option<Cause> {
        let among = |codes: &[Code]| codes.iter().find(|row| row.number == code).copied();
        match code {
            0x0000 => Some(Cause::NoError),
            _ => among(self.faults).map(Cause::Fault).or_else(|| among(self.notices).map(Cause::Notice)),
        }
    }
}

impl fmt::Display for Code {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Code { number, label, text } = self;
        if label.is_empty() { write!(f, "{number:04X}: {text}") } else { write!(f, "{label} ({number:04X}): {text}") }
    }
}

impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Cause::NoError => f.write_str("no error"),
            Cause::Fault(code) => fmt::Display::fmt(code, f),
            Cause::Notice(Code { label: "", text, .. }) => f.write_str(text),
            Cause::Notice(code) => fmt::Display::fmt(code, f),
            Cause::Unknown(code) => write!(f, "{}; the drive's description has no such code", ErrorCode(*code)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HOT: Code = Code { number: 0x4310, label: "D", text: "too hot" };
    const PASSIVE: Code = Code { number: 0x8120, label: "", text: "error passive" };

    #[track_caller]
    fn check(order: ByteOrder, code: u16, expected: Cause) {
        let codes = Codes { faults: &[HOT], notices: &[PASSIVE], order };
        assert_eq!(codes.cause(code), expected, "{order:?}");
    }

    #[test]
    fn a_code_is_understood_in_the_order_of_the_drive() {
        check(ByteOrder::LowFirst, 0x4310, Cause::Fault(HOT));
        check(ByteOrder::LowFirst, 0x1043, Cause::Unknown(0x1043));
        check(ByteOrder::HighFirst, 0x1043, Cause::Fault(HOT));
        check(ByteOrder::HighFirst, 0x3412, Cause::Unknown(0x1234));
        check(ByteOrder::Either, 0x4310, Cause::Fault(HOT));
        check(ByteOrder::Either, 0x1043, Cause::Fault(HOT));
        check(ByteOrder::Either, 0x2081, Cause::Notice(PASSIVE));
        check(ByteOrder::Either, 0x0000, Cause::NoError);
    }

    #[test]
    fn a_cause_prints_label_code_and_text() {
        assert_eq!(Cause::Fault(HOT).to_string(), "D (4310): too hot");
        assert_eq!(Cause::Fault(Code { label: "", ..HOT }).to_string(), "4310: too hot");
        assert_eq!(Cause::Notice(PASSIVE).to_string(), "error passive");
        assert_eq!(Cause::Notice(Code { label: "n7", ..PASSIVE }).to_string(), "n7 (8120): error passive");
        let mains = "3120h: mains voltage (31xxh); the drive's description has no such code";
        assert_eq!(Cause::Unknown(0x3120).to_string(), mains);
    }
}
