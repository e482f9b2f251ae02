//! The abort codes by which a device may refuse, as data: each set with its source.
//!
//! A code of the set is right. Where CiA 301 names none, codes that only stacks in use send are accepted as well, and
//! the report notes them as an observation. Any other code fails the case.

use std::fmt::{self, Display};

use lexican_runtime::AbortCode;

/// The abort codes for one kind of mistake.
#[derive(Debug)]
pub(crate) struct Accepted {
    pub(crate) codes: &'static [AbortCode],
    /// Codes that stacks in use send, where CiA 301 leaves it open.
    pub(crate) observed: &'static [AbortCode],
    /// The source of the codes. CCT is CiA's conformance test 3.0.3.10, with the number in its plan.
    pub(crate) source: &'static str,
}

impl Accepted {
    /// Whether a code is accepted, as right or as an observation.
    pub(crate) fn takes(&self, code: AbortCode) -> bool {
        self.codes.contains(&code) || self.observed.contains(&code)
    }
}

impl Display for Accepted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let named = |codes: &[AbortCode]| codes.iter().map(ToString::to_string).collect::<Vec<_>>().join("; or ");
        write!(f, "an abort with {} ({})", named(self.codes), self.source)?;
        if self.observed.is_empty() { Ok(()) } else { write!(f, "; also seen, and taken: {}", named(self.observed)) }
    }
}

const GENERAL: AbortCode = AbortCode::GENERAL;
const ACCESS: AbortCode = AbortCode::UNSUPPORTED_ACCESS;
const VALUE: AbortCode = AbortCode::INVALID_VALUE;
const STATE: AbortCode = AbortCode::DEVICE_STATE;

macro_rules! accepted {
    ($($(#[$doc:meta])* $name:ident, $source:literal, [$($code:expr),*] $(, observed [$($observed:expr),*])?;)*) => {
        $($(#[$doc])* pub(crate) const $name: Accepted =
            Accepted { codes: &[$($code),*], observed: &[$($($observed),*)?], source: $source };)*
    };
}

accepted! {
    READ_ONLY, "CCT 2.3, 4.3", [AbortCode::READ_ONLY, ACCESS, GENERAL];
    WRITE_ONLY, "CCT 2.4, 4.4", [AbortCode::WRITE_ONLY, ACCESS, GENERAL];
    NO_SUB_INDEX, "CCT 2.5", [AbortCode::NO_SUCH_SUB_INDEX, GENERAL];
    NO_OBJECT, "CCT 2.6", [AbortCode::NO_SUCH_OBJECT, GENERAL];
    COMMAND, "CCT 2.7", [AbortCode::UNKNOWN_COMMAND, GENERAL];
    TOO_LONG, "CCT 2.8", [AbortCode::LENGTH_TOO_HIGH, AbortCode::LENGTH_MISMATCH, GENERAL];
    TOO_SHORT, "CCT 2.9", [AbortCode::LENGTH_TOO_LOW, AbortCode::LENGTH_MISMATCH, GENERAL];
    TOO_HIGH, "CCT 2.10", [AbortCode::VALUE_TOO_HIGH, VALUE, GENERAL];
    TOO_LOW, "CCT 2.11", [AbortCode::VALUE_TOO_LOW, VALUE, GENERAL];
    TOGGLE, "CCT 2.17", [AbortCode::TOGGLE_BIT, GENERAL];
    BLOCK_SIZE, "CCT 2.26", [AbortCode::INVALID_BLOCK_SIZE, AbortCode::UNKNOWN_COMMAND, GENERAL];
    SEQUENCE, "CCT 2.27", [AbortCode::INVALID_SEQUENCE_NUMBER, AbortCode::UNKNOWN_COMMAND, GENERAL];
    CHECKSUM, "CiA 301, 7.2.4.3.17", [AbortCode::CRC_ERROR, GENERAL];
    /// A mapping is changed while it is active, or while its PDO exists.
    MAPPED, "CCT 3.23, 3.24; lely-core: 0609 0030h", [ACCESS, AbortCode::NOT_MAPPABLE, GENERAL], observed [VALUE, STATE];
    /// More is mapped than fits.
    NO_ROOM, "CCT 3.25, 3.26",
        [AbortCode::PDO_LENGTH_EXCEEDED, AbortCode::NOT_MAPPABLE, AbortCode::NO_SUCH_OBJECT, ACCESS],
        observed [VALUE, AbortCode::VALUE_TOO_HIGH, GENERAL];
    /// An object that cannot be mapped at all, or not in this direction.
    NOT_MAPPABLE, "CCT 3.28, 3.29, 3.31, 3.32; lely-core: 0601 0001h and 0601 0002h",
        [AbortCode::NOT_MAPPABLE, AbortCode::NO_SUCH_OBJECT],
        observed [VALUE, AbortCode::READ_ONLY, AbortCode::WRITE_ONLY, GENERAL];
    /// A parameter of a PDO is changed while the PDO exists.
    WHILE_IT_EXISTS, "CiA 301, 7.5.2.37, which names no code",
        [VALUE, ACCESS, STATE, AbortCode::CANNOT_TRANSFER, GENERAL];
    TRANSMISSION_TYPE, "CiA 301, 7.5.2.37; codes of limits are those of data sheets that have some",
        [VALUE, AbortCode::VALUE_TOO_HIGH, AbortCode::VALUE_TOO_LOW, GENERAL];
    COUNTER_OVERFLOW, "CCT 6.5", [VALUE, AbortCode::VALUE_TOO_HIGH, AbortCode::VALUE_TOO_LOW, GENERAL];
    COUNTER_OVERFLOW_IN_USE, "CCT 6.9", [STATE, GENERAL];
    CONSUMED_TWICE, "CCT 7.104", [AbortCode::PARAMETER_INCOMPATIBLE, GENERAL];
    SIGNATURE, "CCT 8.3, 8.5, 8.7", [AbortCode::CANNOT_TRANSFER, AbortCode::LOCAL_CONTROL, GENERAL];
    RESTRICTED, "CCT 8.10", [VALUE, AbortCode::PARAMETER_INCOMPATIBLE, GENERAL];
    ERROR_HISTORY, "CCT 2.10", [VALUE, AbortCode::VALUE_TOO_HIGH, GENERAL];
    NO_ERROR, "CCT 5.3", [AbortCode::NO_DATA, GENERAL];
}
