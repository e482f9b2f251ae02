//! A sub-index is a VAR or a DOMAIN.

use super::Rule;
use crate::diagnostics::{Diagnostic, Severity};
use crate::model::ObjectKind;
use crate::source::Span;

pub(crate) const RULE: Rule = Rule {
    code: "eds::nested-object",
    severity: Severity::Warning,
    holds: "A sub-index is a VAR or a DOMAIN.",
    explain: "CANopen has two levels only, objects and sub-indices (CiA 301, 7.4.3). The entry is read as a VAR.",
    help: "",
    check: None,
};

pub(crate) fn found(kind: ObjectKind, span: Span) -> Diagnostic {
    RULE.finding(format!("a sub-index cannot be of object type {}", kind.name())).at(span, "read as VAR")
}
