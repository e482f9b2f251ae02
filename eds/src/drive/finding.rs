//! The codes of findings about drives.

use crate::diagnostic::Severity::{self, Error, Warning};

/// The code of a finding, with its explanation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Finding {
    /// A stable code: `drive::…`.
    pub code: &'static str,
    /// The severity, unless the configuration sets another one.
    pub severity: Severity,
    /// What it means and what to do.
    pub explain: &'static str,
}

/// All codes that [`read`](super::read) reports, sorted.
pub const FINDINGS: &[Finding] = &[
    Finding {
        code: "drive::left-out",
        severity: Warning,
        explain: "An object or a mode that a driver could use contradicts CiA 402: its data type, its access, or an object \
                  that belongs to it is missing. The driver does without. An overlay can correct it.",
    },
    Finding {
        code: "drive::no-mode",
        severity: Error,
        explain: "The drive has neither profile position mode (607Ah, 6064h) nor profile velocity mode (60FFh), or 6502h, \
                  6060h or the overlay say that it has neither.",
    },
    Finding {
        code: "drive::no-object",
        severity: Error,
        explain: "An object that every driver needs is missing: 6040h, 6041h or 6060h, without which a device is not a drive \
                  of CiA 402; or 606Ch and 6064h, without either of which nothing shows that the drive stands.",
    },
    Finding {
        code: "drive::object",
        severity: Error,
        explain: "An object that every driver needs has a data type or access that CiA 402 does not give it. If the data \
                  sheet is wrong, an overlay corrects it.",
    },
    Finding {
        code: "drive::pdo",
        severity: Warning,
        explain: "A PDO carries a control word, status word or target value with another length than the object has, or not \
                  from a byte on. The driver does not use it, and writes by SDO.",
    },
    Finding {
        code: "drive::profile",
        severity: Warning,
        explain: "1000h has another device profile than 402, though the objects of CiA 402 are there. The driver goes by the \
                  objects, and expects this 1000h in the drive. An overlay can say that the device obeys CiA 402.",
    },
    Finding {
        code: "drive::velocity",
        severity: Warning,
        explain: "There is no 606Ch. The driver sees by 6064h whether the drive stands, which takes longer, and does not see \
                  a drive that creeps.",
    },
    Finding {
        code: "drive::vendor",
        severity: Warning,
        explain: "The vendor-ID, by which the driver makes sure that it commands the drive that it is meant for, is not in \
                  the data sheet: any vendor's drive then is taken for it. Or the data sheet contradicts itself: then a drive \
                  without vendor-ID is, too.",
    },
];

pub(super) fn severity(code: &str) -> Severity {
    FINDINGS.iter().find(|finding| finding.code == code).map_or(Error, |finding| finding.severity)
}
