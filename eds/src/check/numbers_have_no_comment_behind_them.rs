//! No comment follows a number on its line.

use super::Rule;
use crate::diagnostics::{Diagnostic, Severity};
use crate::source::Span;

pub(crate) const RULE: Rule = Rule {
    code: "eds::inline-comment",
    severity: Severity::Warning,
    holds: "No comment follows a number on its line.",
    explain: "In CiA 306-1 a comment has a line of its own. Other readers refuse the number or take it for text.",
    help: "",
    check: None,
};

pub(crate) fn found(key: &str, span: Span) -> Diagnostic {
    RULE.finding(format!("a comment follows the value of `{key}`")).at(span, "the comment is ignored")
}
