//! Names and values are given to sub-indices that exist.

use super::Rule;
use crate::diagnostics::{Diagnostic, Severity};
use crate::source::Span;

pub(crate) const RULE: Rule = Rule {
    code: "eds::value-without-entry",
    severity: Severity::Warning,
    holds: "Names and values are given to sub-indices that exist.",
    explain: "`[xxxxName]`, `[xxxxValue]` and `[xxxxDenotation]` belong to sub-indices of the object; the key is the \
              sub-index in decimal.",
    help: "",
    check: None,
};

pub(crate) fn found(index: u16, sub: u32, span: Span) -> Diagnostic {
    RULE.finding(format!("the object {index:04X} has no sub-index {sub}")).at(span, "ignored")
}
