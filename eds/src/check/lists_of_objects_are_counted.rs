//! SupportedObjects is the number of objects in its list.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};

pub(crate) const RULE: Rule = Rule {
    code: "eds::list-count",
    severity: Severity::Warning,
    holds: "SupportedObjects is the number of objects in its list.",
    explain: "Readers that trust the number lose the objects beyond it. All objects that are listed or described are \
              read.",
    help: "",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    for list in &context.facts.lists {
        match list.said {
            Some((said, span)) if said as usize != list.entries.len() => {
                let found = super::plural(list.entries.len(), "object");
                out.push(RULE.finding(format!("the list has {found}, not {said}")).at(span, "says otherwise"));
            }
            None if !list.entries.is_empty() => {
                out.push(RULE.finding("the list does not say how many objects it has").at(list.span, ""));
            }
            _ => {}
        }
    }
}
