//! Numbers are spelled as CiA 306 spells them.

use super::Rule;
use crate::diagnostics::{Diagnostic, Severity};
use crate::source::Span;

pub(crate) const RULE: Rule = Rule {
    code: "eds::odd-number",
    severity: Severity::Note,
    holds: "Numbers are spelled as CiA 306 spells them.",
    explain: "`true`, `NULL`, `1.0f`, `1F80h` or the name of a data type mean one thing only and are read so, but \
              other readers refuse them.",
    help: "",
    check: None,
};

pub(crate) fn found(key: &str, text: &str, span: Span) -> Diagnostic {
    RULE.finding(format!("`{text}` is an odd spelling for `{key}`")).at(span, "")
}
