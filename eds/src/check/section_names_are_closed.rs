//! A section name ends with a bracket.

use super::Rule;
use crate::diagnostics::{Diagnostic, Severity};
use crate::source::Span;

pub(crate) const RULE: Rule = Rule {
    code: "eds::unclosed-section",
    severity: Severity::Warning,
    holds: "A section name ends with a bracket.",
    explain: "Without the closing bracket other readers take the section for a key or swallow the lines after it. The \
              rest of the line is taken for the name.",
    help: "",
    check: None,
};

pub(crate) fn found(span: Span) -> Diagnostic {
    RULE.finding("the section name has no closing bracket").at(span, "read as the name")
}
