//! What emergency codes mean.

use std::fmt;

use lexican_runtime::wire::emcy::ErrorCode;

/// What a drive's manual says of an emergency code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Code {
    /// The code of EMCY and 1003h.
    pub number: u16,
    /// What the manual calls it, such as a letter; empty when it has no name.
    pub label: &'static str,
    /// What happened.
    pub text: &'static str,
}

/// The codes of a drive.
#[derive(Clone, Copy, Debug)]
pub struct Codes {
    /// Those that lead to the state FAULT.
    pub faults: &'static [Code],
    /// Those that do not.
    pub notices: &'static [Code],
    /// In which order the two bytes of a code come.
    pub order: ByteOrder,
}

/// In which order bytes come that are one number, or one text, together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ByteOrder {
    /// As CiA 301 has it.
    LowFirst,
    /// The other way round.
    HighFirst,
    /// The manual contradicts itself: the order that makes a known code of it counts. No code of the table may be another
    /// one's mirror image.
    Either,
}

/// What an emergency code says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// The fault has been reset.
    NoError,
    /// The drive is in the state FAULT.
    Fault(Code),
    /// Something to know that is no fault.
    Notice(Code),
    /// A code that the manual does not have.
    Unknown(u16),
}

impl Codes {
    /// What a code says that came in the order of CiA 301: in an emergency, or as an entry of 1003h.
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
