//! Data types are those of CiA 301 or of the device itself.

use super::Rule;
use crate::diagnostics::{Diagnostic, Severity};
use crate::source::Span;
use crate::types::DataType;

pub(crate) const RULE: Rule = Rule {
    code: "eds::unknown-data-type",
    severity: Severity::Warning,
    holds: "Data types are those of CiA 301 or of the device itself.",
    explain: "Data types have the indices 0001h to 025Fh (CiA 301, 7.4.1). Others are kept as a number, and nothing \
              can be generated for them.",
    help: "",
    check: None,
};

pub(crate) fn found(data_type: DataType, span: Span) -> Diagnostic {
    RULE.finding(format!("there is no data type {data_type}"))
        .at(span, "")
        .help("an overlay can name the right one: `data_type = \"UNSIGNED16\"` with a reason")
}
