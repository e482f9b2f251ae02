//! An entry is a quantity, an enumeration or a bit field, but only one of them.

use super::Rule;
use crate::diagnostics::{Diagnostic, Severity};
use crate::source::Span;

pub(crate) const RULE: Rule = Rule {
    code: "overlay::two-meanings",
    severity: Severity::Error,
    holds: "An entry is a quantity, an enumeration or a bit field, but only one of them.",
    explain: "The meaning decides the type of the value in generated code, so there can be one only.",
    help: "",
    check: None,
};

pub(crate) fn found(span: Span, other: Span) -> Diagnostic {
    RULE.finding("the entry has two meanings").at(span, "second").and(other, "first")
}
