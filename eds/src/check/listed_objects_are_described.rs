//! Every object that a list names is described by a section.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostic, Diagnostics, Severity};
use crate::source::Span;

pub(crate) const RULE: Rule = Rule {
    code: "eds::object-without-section",
    severity: Severity::Warning,
    holds: "Every object that a list names is described by a section.",
    explain: "Of an object without section nothing is known but that it exists. Often the list was copied from another \
              device.",
    help: "",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    for list in &context.facts.lists {
        for listed in &list.entries {
            if context.device.object(listed.index).is_none() {
                let message = format!("the object {:04X} is listed, but not described", listed.index);
                out.push(RULE.finding(message).at(listed.span, "ignored"));
            }
        }
    }
}

pub(crate) fn of_module(index: u16, span: Span) -> Diagnostic {
    RULE.finding(format!("the object {index:04X} of the module is listed, but not described")).at(span, "ignored")
}
