//! Nothing but a comment follows a section name on its line.

use super::Rule;
use crate::diagnostics::{Diagnostic, Severity};
use crate::source::Span;

pub(crate) const RULE: Rule = Rule {
    code: "eds::text-after-section",
    severity: Severity::Warning,
    holds: "Nothing but a comment follows a section name on its line.",
    explain: "Some readers refuse the file, others take the text for a key. It is ignored here.",
    help: "",
    check: None,
};

pub(crate) fn found(span: Span) -> Diagnostic {
    RULE.finding("there is text behind the section name").at(span, "ignored")
}
