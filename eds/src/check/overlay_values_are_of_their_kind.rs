//! Every value of an overlay is of the kind that its key takes.

use super::Rule;
use crate::diagnostics::{Diagnostic, Severity};
use crate::source::Span;

pub(crate) const RULE: Rule = Rule {
    code: "overlay::bad-value",
    severity: Severity::Error,
    holds: "Every value of an overlay is of the kind that its key takes.",
    explain: "What is of another kind is read as absent: a text where a number belongs, a word that is none of those \
              that are allowed, a table without what it must have.",
    help: "",
    check: None,
};

pub(crate) fn found(expected: &str, span: Span) -> Diagnostic {
    RULE.finding(format!("expected {expected}")).at(span, "")
}
