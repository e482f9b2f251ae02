//! A key and its value are separated by an equals sign.

use super::Rule;
use crate::diagnostics::{Diagnostic, Severity};
use crate::source::Span;
use crate::syntax::Separator;

pub(crate) const RULE: Rule = Rule {
    code: "eds::no-equals-sign",
    severity: Severity::Warning,
    holds: "A key and its value are separated by an equals sign.",
    explain: "A colon or a blank instead is read as an equals sign where the line leaves no doubt. Other readers lose \
              the line, or take the next one for a part of it.",
    help: "",
    check: None,
};

pub(crate) fn found(span: Span, separator: Separator) -> Diagnostic {
    let what = if separator == Separator::Colon { "a colon" } else { "a blank" };
    RULE.finding(format!("{what} stands for the equals sign")).at(span, "read as a key")
}
