//! Arrays and records have sub-indices.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::object::Key;

pub(crate) const RULE: Rule = Rule {
    code: "eds::no-subs",
    severity: Severity::Warning,
    holds: "Arrays and records have sub-indices.",
    explain: "An array or record without sub-indices has nothing that could be read or written.",
    help: "",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    for (object, _) in context.objects() {
        if object.kind.has_subs() && object.entries.is_empty() {
            let message = format!("the {} {:04X} has no sub-indices", object.kind.name(), object.index);
            out.push(RULE.finding(message).at(context.value_span(object.span, Key::ObjectType), ""));
        }
    }
}
