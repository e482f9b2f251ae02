//! Flags are 0 or 1.

use super::Rule;
use crate::diagnostics::{Diagnostic, Severity};
use crate::source::Span;

pub(crate) const RULE: Rule = Rule {
    code: "eds::bad-flag",
    severity: Severity::Warning,
    holds: "Flags are 0 or 1.",
    explain: "CiA 306 knows 0 for no and 1 for yes. Every other number is read as yes.",
    help: "",
    check: None,
};

pub(crate) fn found(key: &str, span: Span) -> Diagnostic {
    RULE.finding(format!("`{key}` is neither 0 nor 1")).at(span, "")
}
