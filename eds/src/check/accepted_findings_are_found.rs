//! What an overlay accepts is found without it.

use super::Rule;
use crate::diagnostics::{Diagnostic, Severity};
use crate::source::Span;

pub(crate) const RULE: Rule = Rule {
    code: "overlay::accepted-in-vain",
    severity: Severity::Warning,
    holds: "What an overlay accepts is found without it.",
    explain: "`accept` says that a finding is as it should be. What is not found any more was mended, or the overlay \
              is for another version of the data sheet.",
    help: "",
    check: None,
};

pub(crate) fn found(code: &str, span: Span) -> Diagnostic {
    RULE.finding(format!("there is no finding of {code} to accept")).at(span, "")
}
