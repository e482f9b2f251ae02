//! A quantity has one unit, or several of which each has a condition.

use super::Rule;
use crate::diagnostics::{Diagnostic, Severity};
use crate::source::Span;

pub(crate) const RULE: Rule = Rule {
    code: "overlay::units",
    severity: Severity::Error,
    holds: "A quantity has one unit, or several of which each has a condition.",
    explain: "Where other objects decide the unit, as with increments or millimetres by the spindle pitch, every unit \
              says when it applies.",
    help: "",
    check: None,
};

pub(crate) fn found(units: usize, span: Span) -> Diagnostic {
    let message = if units == 0 { "the quantity has no unit" } else { "a unit among several has no condition" };
    RULE.finding(message).at(span, "").help("`when = \"2412:00 == 0\"` says when a unit applies")
}
