//! Every variable names its access type.

use super::Rule;
use crate::diagnostics::{Diagnostic, Severity};
use crate::source::Span;

pub(crate) const RULE: Rule = Rule {
    code: "eds::missing-access-type",
    severity: Severity::Warning,
    holds: "Every variable names its access type.",
    explain: "Without access type the entry is read as `rw`, and the device decides.",
    help: "",
    check: None,
};

pub(crate) fn found(span: Span) -> Diagnostic {
    RULE.finding("the entry names no access type")
        .at(span, "read as rw")
        .help("an overlay can name it: `access = \"ro\"` with a reason")
}
