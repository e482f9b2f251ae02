//! No key comes twice in a section.

use super::Rule;
use crate::diagnostics::{Diagnostic, Severity};
use crate::source::Span;

pub(crate) const RULE: Rule = Rule {
    code: "eds::duplicate-key",
    severity: Severity::Warning,
    holds: "No key comes twice in a section.",
    explain: "Readers differ in which one they take. The first one counts here, as with the functions of Windows that \
              data sheets were made for.",
    help: "",
    check: None,
};

pub(crate) fn found(key: &str, same: bool, first: Span, second: Span) -> Diagnostic {
    let same = if same { "with the same value" } else { "with another value" };
    RULE.finding(format!("the key `{key}` comes again {same}")).at(second, "ignored").and(first, "this one counts")
}
