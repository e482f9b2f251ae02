//! Arrays and records have a sub-index 0.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::model::ObjectKind;

pub(crate) const RULE: Rule = Rule {
    code: "eds::missing-sub-0",
    severity: Severity::Warning,
    holds: "Arrays and records have a sub-index 0.",
    explain: "Sub-index 0 holds the highest sub-index (CiA 301, 7.4.3). Tools that read it first find nothing.",
    help: "",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    for (object, _) in context.objects().filter(|(object, _)| object.kind != ObjectKind::DefStruct) {
        if object.kind.has_subs() && object.entries.first().is_some_and(|entry| entry.sub != 0) {
            let message = format!("the {} {:04X} has no sub-index 0", object.kind.name(), object.index);
            out.push(RULE.finding(message).at(object.span, ""));
        }
    }
}
