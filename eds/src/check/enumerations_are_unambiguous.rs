//! The values and the names of an enumeration differ.

use super::Rule;
use crate::diagnostics::{Diagnostic, Severity};
use crate::source::Span;

pub(crate) const RULE: Rule = Rule {
    code: "overlay::duplicate-value",
    severity: Severity::Error,
    holds: "The values and the names of an enumeration differ.",
    explain: "A number with two names, or a name for two numbers, cannot become an enumeration in code. The first one \
              counts.",
    help: "",
    check: None,
};

pub(crate) fn found(what: &str, span: Span) -> Diagnostic {
    RULE.finding(format!("two values are the same: {what}")).at(span, "ignored")
}
