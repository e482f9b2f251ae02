//! Every section is one that CiA 306 knows.

use super::Rule;
use crate::diagnostics::{Diagnostic, Severity};
use crate::source::Span;

pub(crate) const RULE: Rule = Rule {
    code: "eds::unknown-section",
    severity: Severity::Warning,
    holds: "Every section is one that CiA 306 knows.",
    explain: "Vendors add sections for their own tools; CiA 306-1 lets other readers ignore them. A misspelt name of \
              an object looks the same, so each is named.",
    help: "see whether it is misspelt; what the tool of a vendor has added does no harm",
    check: None,
};

pub(crate) fn found(name: &str, keys: usize, span: Span) -> Diagnostic {
    RULE.finding(format!("the section `{name}` with {} is unknown", super::plural(keys, "key"))).at(span, "ignored")
}
