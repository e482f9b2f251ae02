//! An overlay is TOML.

use super::Rule;
use crate::diagnostics::{Diagnostic, Severity};
use crate::source::Span;

pub(crate) const RULE: Rule = Rule {
    code: "overlay::syntax",
    severity: Severity::Error,
    holds: "An overlay is TOML.",
    explain: "What is broken is skipped; the rest of the overlay is applied.",
    help: "",
    check: None,
};

pub(crate) fn found(message: &str, span: Span) -> Diagnostic {
    RULE.finding(format!("the overlay is not TOML: {message}")).at(span, "")
}
