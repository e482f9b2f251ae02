//! NrOfEntries, Lines and the like are what there is.

use super::Rule;
use crate::diagnostics::{Diagnostic, Severity};
use crate::source::Span;

pub(crate) const RULE: Rule = Rule {
    code: "eds::entry-count",
    severity: Severity::Warning,
    holds: "NrOfEntries, Lines and the like are what there is.",
    explain: "Readers that trust the number lose what is beyond it. All entries that there are are read.",
    help: "",
    check: None,
};

pub(crate) fn found(said: usize, found: usize, span: Span) -> Diagnostic {
    RULE.finding(format!("there {}, not {said}", super::are(found, "entry"))).at(span, "says otherwise")
}
