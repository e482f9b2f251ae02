//! The tokeniser and the search for places see the same sections and keys.

use super::Rule;
use crate::diagnostics::{Diagnostic, Severity};
use crate::source::Span;

pub(crate) const RULE: Rule = Rule {
    code: "eds::tokenizer",
    severity: Severity::Note,
    holds: "The tokeniser and the search for places see the same sections and keys.",
    explain: "Where they do not, the lines themselves are read. This is a mistake of the reader, not of the file; \
              please report it with the file.",
    help: "",
    check: None,
};

pub(crate) fn found() -> Diagnostic {
    RULE.finding("the tokeniser sees other sections or keys than there are lines").at(Span::eds(0, 0), "")
}
