//! A decimal number has no leading zero.

use super::Rule;
use crate::diagnostics::{Diagnostic, Severity};
use crate::source::Span;

pub(crate) const RULE: Rule = Rule {
    code: "eds::octal-number",
    severity: Severity::Warning,
    holds: "A decimal number has no leading zero.",
    explain: "CiA 306-1 follows C: a leading zero means octal, so 010 is eight. People who pad numbers with zeros mean \
              decimal. The standard is followed where all digits are octal; an overlay can say what was meant.",
    help: "an overlay can say what is meant: `default = 10` with a reason",
    check: None,
};

pub(crate) fn found(key: &str, text: &str, octal: bool, span: Span) -> Diagnostic {
    let value = crate::number::integer(text).map_or(0, |read| read.value);
    let finding = if octal {
        RULE.finding(format!("`{key}` has a leading zero, which makes it octal"))
    } else {
        RULE.finding(format!("`{key}` has a leading zero, but is not octal"))
    };
    finding.at(span, format!("read as decimal {value}"))
}
