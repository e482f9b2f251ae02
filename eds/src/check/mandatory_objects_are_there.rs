//! The objects that CiA 301 demands of every device are there.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::model::ObjectList;
use crate::source::Span;

pub(crate) const RULE: Rule = Rule {
    code: "cia301::missing-object",
    severity: Severity::Warning,
    holds: "The objects that CiA 301 demands of every device are there.",
    explain: "Every device has a device type (1000h), an error register (1001h) and an identity (1018h).",
    help: "",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    if context.device.objects.is_empty() {
        return;
    }
    for (index, name) in [(0x1000, "device type"), (0x1001, "error register"), (0x1018, "identity")] {
        if context.device.object(index).is_none() {
            let list = context.facts.lists.iter().find(|list| list.list == ObjectList::Mandatory);
            let span = list.map_or(Span::eds(0, 0), |list| list.span);
            out.push(RULE.finding(format!("the {name} ({index:04X}) is missing")).at(span, ""));
        }
    }
}
