//! No rule finds more than a thousand things in a file.

use super::Rule;
use crate::diagnostics::{Diagnostic, Severity};

pub(crate) const RULE: Rule = Rule {
    code: "eds::more-findings",
    severity: Severity::Note,
    holds: "No rule finds more than a thousand things in a file.",
    explain: "The findings of a rule beyond the thousandth are counted, but not kept, so that a broken file cannot \
              exhaust memory.",
    help: "",
    check: None,
};

pub(crate) fn found(more: usize, code: &str) -> Diagnostic {
    RULE.finding(format!("{more} more findings of {code} are not shown"))
}
