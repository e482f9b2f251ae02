//! Objects are in the list that their index belongs to.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::model::ObjectList;

pub(crate) const RULE: Rule = Rule {
    code: "eds::wrong-list",
    severity: Severity::Warning,
    holds: "Objects are in the list that their index belongs to.",
    explain: "2000h to 5FFFh are the manufacturer's; mandatory are 1000h, 1001h and 1018h, and what a profile demands \
              (CiA 306-1).",
    help: "",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    for list in &context.facts.lists {
        for listed in &list.entries {
            let manufacturers = matches!(listed.index, 0x2000..=0x5FFF);
            if manufacturers != (list.list == ObjectList::Manufacturer) {
                let right = if manufacturers { "the manufacturer's" } else { "not the manufacturer's" };
                let finding = RULE.finding(format!("the object {:04X} is {right}", listed.index));
                out.push(finding.at(listed.span, "").and(list.span, "in this list"));
            }
        }
    }
}
