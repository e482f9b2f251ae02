//! CompactSubObj is at most 254.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::object::Key;

pub(crate) const RULE: Rule = Rule {
    code: "eds::compact-count",
    severity: Severity::Warning,
    holds: "CompactSubObj is at most 254.",
    explain: "Sub-indices go from 0 to FEh (CiA 301, 7.4.3). What is beyond is not read.",
    help: "",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    for (object, facts) in context.objects().filter(|(_, facts)| facts.compact > 0xFE) {
        let span = context.value_span(object.span, Key::CompactSubObj);
        out.push(RULE.finding(format!("an object cannot have {} sub-indices", facts.compact)).at(span, ""));
    }
}
