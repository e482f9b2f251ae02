//! The bits and the names of a bit field differ.

use super::Rule;
use crate::diagnostics::{Diagnostic, Severity};
use crate::source::Span;

pub(crate) const RULE: Rule = Rule {
    code: "overlay::overlapping-bits",
    severity: Severity::Error,
    holds: "The bits and the names of a bit field differ.",
    explain: "Every bit has one meaning, and every name becomes one method in generated code. The first field counts.",
    help: "",
    check: None,
};

pub(crate) fn found(what: &str, span: Span) -> Diagnostic {
    RULE.finding(format!("two fields overlap: {what}")).at(span, "ignored")
}
