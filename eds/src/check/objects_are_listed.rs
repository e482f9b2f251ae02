//! Every object that is described is in a list.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};

pub(crate) const RULE: Rule = Rule {
    code: "eds::object-not-listed",
    severity: Severity::Warning,
    holds: "Every object that is described is in a list.",
    explain: "CiA 306-1 lets a reader ignore objects that no list names, and several do. They are read here.",
    help: "",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    for (object, facts) in context.objects() {
        if facts.listed.is_none() {
            let finding = RULE.finding(format!("the object {:04X} is in none of the lists", object.index));
            out.push(finding.at(object.span, "other readers do not see it"));
        }
    }
}
