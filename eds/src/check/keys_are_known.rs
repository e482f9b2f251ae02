//! Every key is one that CiA 306 knows for its section.

use super::Rule;
use crate::diagnostics::Severity;

pub(crate) const RULE: Rule = Rule {
    code: "eds::unknown-key",
    severity: Severity::Note,
    holds: "Every key is one that CiA 306 knows for its section.",
    explain: "Vendors add keys for their own tools; CiA 306-1 lets other readers ignore them. A misspelt key looks the \
              same, so each name is told once, at its first place.",
    help: "see whether it is misspelt; what the tool of a vendor has added does no harm",
    check: None,
};
