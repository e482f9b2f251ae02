//! A correction says something else than the data sheet.

use super::Rule;
use crate::diagnostics::{Diagnostic, Severity};
use crate::source::Span;

pub(crate) const RULE: Rule = Rule {
    code: "overlay::no-effect",
    severity: Severity::Warning,
    holds: "A correction says something else than the data sheet.",
    explain: "A correction of what is right already was made for another version of the data sheet, or for another \
              device.",
    help: "",
    check: None,
};

pub(crate) fn found(key: &str, span: Span) -> Diagnostic {
    RULE.finding(format!("the data sheet has the same `{key}`")).at(span, "this changes nothing")
}
