//! Where a number belongs there is one.

use super::Rule;
use crate::diagnostics::{Diagnostic, Severity};
use crate::source::Span;

pub(crate) const RULE: Rule = Rule {
    code: "eds::bad-number",
    severity: Severity::Warning,
    holds: "Where a number belongs there is one.",
    explain: "Numbers are decimal, hexadecimal with `0x` or octal with a leading zero (CiA 306-1). The key is read as \
              absent.",
    help: "an overlay can correct what belongs to an entry: `default`, `low` and `high` with a reason",
    check: None,
};

pub(crate) fn found(key: &str, span: Span) -> Diagnostic {
    RULE.finding(format!("`{key}` is not a number")).at(span, "read as absent")
}
