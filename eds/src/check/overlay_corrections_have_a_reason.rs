//! A correction says why.

use super::Rule;
use crate::diagnostics::{Diagnostic, Severity};
use crate::source::Span;

pub(crate) const RULE: Rule = Rule {
    code: "overlay::missing-reason",
    severity: Severity::Error,
    holds: "A correction says why.",
    explain: "Whoever reads the overlay later wants to know whether the correction still holds: the page of the \
              manual, the firmware, the measurement.",
    help: "",
    check: None,
};

pub(crate) fn found(address: &str, span: Span) -> Diagnostic {
    RULE.finding(format!("the correction of `{address}` has no reason")).at(span, "").help("add `reason = \"…\"`")
}
