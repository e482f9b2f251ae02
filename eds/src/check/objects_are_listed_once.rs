//! An object is listed once.

use std::collections::BTreeMap;

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::source::Span;

pub(crate) const RULE: Rule = Rule {
    code: "eds::listed-twice",
    severity: Severity::Warning,
    holds: "An object is listed once.",
    explain: "Readers that build an object for each line of a list build two.",
    help: "",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    let mut seen: BTreeMap<u16, Span> = BTreeMap::new();
    for listed in context.facts.lists.iter().flat_map(|list| &list.entries) {
        match seen.get(&listed.index) {
            Some(&first) => {
                let finding = RULE.finding(format!("the object {:04X} is listed again", listed.index));
                out.push(finding.at(listed.span, "").and(first, "first here"));
            }
            None => {
                seen.insert(listed.index, listed.span);
            }
        }
    }
}
