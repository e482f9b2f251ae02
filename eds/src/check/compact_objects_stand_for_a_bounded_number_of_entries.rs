//! CompactSubObj stands for at most 100 000 entries in a file.

use super::Rule;
use crate::diagnostics::{Diagnostic, Severity};
use crate::source::Span;

pub(crate) const RULE: Rule = Rule {
    code: "eds::too-many-entries",
    severity: Severity::Error,
    holds: "CompactSubObj stands for at most 100 000 entries in a file.",
    explain: "A line of a few bytes can stand for 254 entries, so a small file could exhaust memory. The largest \
              devices known have some 5000 entries. Objects beyond the bound keep sub-index 0 only.",
    help: "",
    check: None,
};

pub(crate) fn found(index: u16, span: Span) -> Diagnostic {
    RULE.finding(format!("the entries of {index:04X} are too many for one file")).at(span, "not written out")
}
