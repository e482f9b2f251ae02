//! A number is not larger than its key can hold.

use super::Rule;
use crate::diagnostics::{Diagnostic, Severity};
use crate::source::Span;

pub(crate) const RULE: Rule = Rule {
    code: "eds::number-too-large",
    severity: Severity::Warning,
    holds: "A number is not larger than its key can hold.",
    explain: "Object codes, sub-index counts and versions have 8 bits, indices 16, identity numbers 32. The key is \
              read as absent.",
    help: "",
    check: None,
};

pub(crate) fn found(key: &str, value: i128, span: Span) -> Diagnostic {
    RULE.finding(format!("{value} is out of range for `{key}`")).at(span, "read as absent")
}
