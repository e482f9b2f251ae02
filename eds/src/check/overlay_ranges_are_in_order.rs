//! A range begins with its smaller end.

use super::Rule;
use crate::diagnostics::{Diagnostic, Severity};
use crate::source::Span;

pub(crate) const RULE: Rule = Rule {
    code: "overlay::range-reversed",
    severity: Severity::Error,
    holds: "A range begins with its smaller end.",
    explain: "No value lies in a range whose low end is above its high end.",
    help: "",
    check: None,
};

pub(crate) fn found(span: Span) -> Diagnostic {
    RULE.finding("`low` is above `high`").at(span, "")
}
