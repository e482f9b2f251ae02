//! Dummies are data types of a fixed size.

use super::Rule;
use crate::diagnostics::{Diagnostic, Severity};
use crate::source::Span;

pub(crate) const RULE: Rule = Rule {
    code: "eds::bad-dummy",
    severity: Severity::Warning,
    holds: "Dummies are data types of a fixed size.",
    explain: "A dummy (CiA 301) is the index of a data type that a PDO maps to leave a gap, so it needs a size.",
    help: "",
    check: None,
};

pub(crate) fn found(code: u32, span: Span) -> Diagnostic {
    RULE.finding(format!("{code:04X}h is no data type of a fixed size")).at(span, "")
}
