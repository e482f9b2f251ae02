//! Every key is in a section.

use super::Rule;
use crate::diagnostics::{Diagnostic, Severity};
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
    let (message, span) = match &*section.pairs {
        [] => ("a section has no name".to_owned(), syntax.name_span(section)),
        pairs @ [first, ..] => {
            let keys = super::plural(pairs.len(), "key");
            (format!("{keys} before the first section or in one without name"), syntax.key_span(first))
        }
    };
    RULE.finding(message).at(span, "ignored")
}
