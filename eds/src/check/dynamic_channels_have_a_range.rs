//! A segment of dynamic channels has a range of indices.

use super::Rule;
use crate::diagnostics::{Diagnostic, Severity};
use crate::source::Span;

pub(crate) const RULE: Rule = Rule {
    code: "eds::bad-channel",
    severity: Severity::Warning,
    holds: "A segment of dynamic channels has a range of indices.",
    explain: "`RangeN` names the first and the last index: `0xA080-0xA0BF` (CiA 302-4). Without it the segment is of \
              no use.",
    help: "",
    check: None,
};

pub(crate) fn found(span: Span) -> Diagnostic {
    RULE.finding("the segment has no range of indices").at(span, "the segment is ignored")
}
