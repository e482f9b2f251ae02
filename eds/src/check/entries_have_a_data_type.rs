//! Every variable names its data type.

use super::Rule;
use crate::diagnostics::{Diagnostic, Severity};
use crate::source::Span;

pub(crate) const RULE: Rule = Rule {
    code: "eds::missing-data-type",
    severity: Severity::Warning,
    holds: "Every variable names its data type.",
    explain: "Without data type nobody can read or write the value but as raw bytes. A DOMAIN needs none.",
    help: "",
    check: None,
};

pub(crate) fn found(span: Span) -> Diagnostic {
    RULE.finding("the entry names no data type")
        .at(span, "")
        .help("an overlay can name it: `data_type = \"UNSIGNED16\"` with a reason")
}
