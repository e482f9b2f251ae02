//! Only arrays and records have sub-indices.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::object::Key;

pub(crate) const RULE: Rule = Rule {
    code: "eds::variable-with-subs",
    severity: Severity::Warning,
    holds: "Only arrays and records have sub-indices.",
    explain: "An object with sub-indices whose `ObjectType` is missing, or is that of a single value, is read as a \
              RECORD.",
    help: "",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    for (object, facts) in context.objects() {
        if !object.kind.has_subs() || !facts.header || facts.declared == Some(object.kind) {
            continue;
        }
        let span = context.value_span(object.span, Key::ObjectType);
        let message = match facts.declared {
            Some(kind) => format!("a {} has no sub-indices", kind.name()),
            None => "an object with sub-indices does not say whether it is an ARRAY or a RECORD".to_owned(),
        };
        out.push(RULE.finding(message).at(span, format!("read as {}", object.kind.name())));
    }
}
