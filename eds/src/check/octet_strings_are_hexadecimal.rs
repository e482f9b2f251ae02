//! The value of an OCTET_STRING is in hexadecimal.

use super::Rule;
use crate::diagnostics::{Diagnostic, Severity};
use crate::source::Span;

pub(crate) const RULE: Rule = Rule {
    code: "eds::octet-string",
    severity: Severity::Note,
    holds: "The value of an OCTET_STRING is in hexadecimal.",
    explain: "CiA 306-1 writes the octets as pairs of hexadecimal digits. Text is kept as text.",
    help: "an overlay can correct it: `default = 1` with a reason",
    check: None,
};

pub(crate) fn found(key: &str, span: Span) -> Diagnostic {
    RULE.finding(format!("`{key}` of an OCTET_STRING is not hexadecimal")).at(span, "kept as text")
}
