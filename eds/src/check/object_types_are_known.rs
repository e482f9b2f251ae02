//! ObjectType is one of the object codes of CiA 301.

use super::Rule;
use crate::diagnostics::{Diagnostic, Severity};
use crate::source::Span;

pub(crate) const RULE: Rule = Rule {
    code: "eds::bad-object-type",
    severity: Severity::Warning,
    holds: "ObjectType is one of the object codes of CiA 301.",
    explain: "NULL 0, DOMAIN 2, DEFTYPE 5, DEFSTRUCT 6, VAR 7, ARRAY 8, RECORD 9 (CiA 301, table 42). Another code is \
              read as if the key were absent.",
    help: "",
    check: None,
};

pub(crate) fn found(code: u8, span: Span) -> Diagnostic {
    RULE.finding(format!("there is no object type {code}")).at(span, "read as absent")
}
