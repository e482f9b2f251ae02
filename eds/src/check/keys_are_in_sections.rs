//! Every key is in a section.

use super::Rule;
use crate::diagnostics::{Diagnostic, Severity};
use crate::source::Span;
use crate::syntax::{Section, Syntax};

pub(crate) const RULE: Rule = Rule {
    code: "eds::key-outside-section",
    severity: Severity::Warning,
    holds: "Every key is in a section.",
    explain: "What a key means depends on its section, so keys before the first section cannot be used.",
    help: "",
    check: None,
};

pub(crate) fn found(syntax: &Syntax<'_>, section: &Section<'_>) -> Diagnostic {
    let span = section.pairs.first().map_or(Span::default(), |pair| syntax.key_span(pair));
    RULE.finding(format!(
        "{} before the first section or in one without name",
        super::plural(section.pairs.len(), "key")
    ))
    .at(span, "ignored")
}
