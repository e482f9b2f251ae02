//! The objects of a list are numbered from 1 without gap.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};

pub(crate) const RULE: Rule = Rule {
    code: "eds::list-gap",
    severity: Severity::Warning,
    holds: "The objects of a list are numbered from 1 without gap.",
    explain: "Readers that count up from 1 stop at the first gap and lose what comes after it.",
    help: "",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    for list in &context.facts.lists {
        let gap = list.entries.iter().zip(1..).find(|(listed, number)| listed.number != *number);
        if let Some((listed, number)) = gap {
            let finding = RULE.finding(format!("the list has no number {number}"));
            out.push(finding.at(listed.span, format!("this is number {}", listed.number)));
        }
    }
}
