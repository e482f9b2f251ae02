//! Keys that hold numbers hold one.

use super::Rule;
use crate::diagnostics::Severity;

pub(crate) const RULE: Rule = Rule {
    code: "eds::empty-number",
    severity: Severity::Note,
    holds: "Keys that hold numbers hold one.",
    explain: "Editors write keys without value where nothing was entered. They are read as absent keys.",
    help: "",
    check: None,
};
