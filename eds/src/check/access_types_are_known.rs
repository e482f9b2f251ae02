//! Access types are ro, wo, rw, rwr, rww or const.

use super::Rule;
use crate::diagnostics::{Diagnostic, Severity};
use crate::model::AccessType;
use crate::source::Span;

pub(crate) const RULE: Rule = Rule {
    code: "eds::bad-access-type",
    severity: Severity::Warning,
    holds: "Access types are ro, wo, rw, rwr, rww or const.",
    explain: "CiA 306-1 (6.5.2) knows six words, in any case. Others are read as what they seem to mean.",
    help: "",
    check: None,
};

pub(crate) fn found(word: &str, access: AccessType, sure: bool, span: Span) -> Diagnostic {
    let finding =
        RULE.finding(format!("there is no access type `{word}`")).at(span, format!("read as {}", access.name()));
    if sure { finding } else { finding.help("an overlay can name the right one: `access = \"ro\"` with a reason") }
}
