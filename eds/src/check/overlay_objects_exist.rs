//! What an overlay speaks of is in the data sheet.

use super::Rule;
use crate::diagnostics::{Diagnostic, Severity};
use crate::source::Span;

pub(crate) const RULE: Rule = Rule {
    code: "overlay::unknown-object",
    severity: Severity::Error,
    holds: "What an overlay speaks of is in the data sheet.",
    explain: "An overlay corrects and explains what is there; addresses are hexadecimal, `2410` or `2410:05`.",
    help: "",
    check: None,
};

pub(crate) fn found(address: &str, span: Span) -> Diagnostic {
    RULE.finding(format!("the data sheet has no `{address}`")).at(span, "")
}
