//! A line is empty, a comment, a section or a key with a value.

use super::Rule;
use crate::diagnostics::{Diagnostic, Severity};
use crate::source::Span;

pub(crate) const RULE: Rule = Rule {
    code: "eds::stray-text",
    severity: Severity::Warning,
    holds: "A line is empty, a comment, a section or a key with a value.",
    explain: "A line that is none of these says nothing that could be used. Often it is the rest of a text that an \
              editor has wrapped.",
    help: "",
    check: None,
};

pub(crate) fn found(span: Span) -> Diagnostic {
    RULE.finding("the line is neither section, key nor comment").at(span, "ignored")
}
