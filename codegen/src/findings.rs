//! The findings of generating.

use lexican_eds::drive::Finding;
use lexican_eds::{Diagnostic, Severity};

/// All codes that generating may report, sorted. Those about the data sheet of a drive are in
/// [`lexican_eds::drive::FINDINGS`].
pub const FINDINGS: &[Finding] = &[
    Finding {
        code: "od::name-collision",
        severity: Severity::Warning,
        explain: "Several items would have one name in Rust, or one that lexican uses itself. The one with the lowest \
                  address keeps the name, the others have their address appended: one that is added after them renames \
                  none. An overlay can give better names.",
    },
    Finding {
        code: "od::unknown-type",
        severity: Severity::Warning,
        explain: "The data type of an entry is not one of CiA 301, and no DEFTYPE of the data sheet says how many bits it \
                  has. The handle reads and writes bytes. Of a DEFTYPE with at most 64 bits the handle has them as an \
                  unsigned number.",
    },
    Finding {
        code: "od::value-out-of-type",
        severity: Severity::Warning,
        explain: "A default, a configured value or a limit is not a value of the data type, or a limit depends on the \
                  node-ID. It is left out.",
    },
    Finding {
        code: "pdo::too-long",
        severity: Severity::Warning,
        explain: "The default mapping of a PDO has more than 64 bits, which no CAN frame has. No struct is generated.",
    },
    Finding {
        code: "pdo::untyped",
        severity: Severity::Warning,
        explain: "A PDO maps an object that the data sheet does not describe, or one without a fixed size. The field has \
                  the bare bits as `u64`.",
    },
];

pub(crate) fn warning(code: &'static str, message: String) -> Diagnostic {
    debug_assert!(FINDINGS.iter().any(|finding| finding.code == code), "{code} is documented");
    Diagnostic::new(code, Severity::Warning, message)
}
