//! Defaults and limits are values of the data type.

use super::Rule;
use crate::diagnostics::{Diagnostic, Severity};
use crate::source::Span;
use crate::types::DataType;

pub(crate) const RULE: Rule = Rule {
    code: "eds::bad-value",
    severity: Severity::Warning,
    holds: "Defaults and limits are values of the data type.",
    explain: "A value that its data type cannot have is read as absent. Either the value or the data type is wrong; an \
              overlay mends both.",
    help: "",
    check: None,
};

pub(crate) fn found(key: &str, text: &str, data_type: DataType, span: Span) -> Diagnostic {
    let is_hexadecimal = text.bytes().all(|b| b.is_ascii_hexdigit());
    let hint = if is_hexadecimal { "; hexadecimal numbers begin with `0x`" } else { "" };
    RULE.finding(format!("`{key}` is not a value of its data type"))
        .at(span, format!("expected {data_type}{hint}"))
        .help("an overlay can give the value, or the right data type")
}
