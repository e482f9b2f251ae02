//! A condition asks for an entry that exists and is a number.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};

pub(crate) const RULE: Rule = Rule {
    code: "overlay::unknown-condition",
    severity: Severity::Error,
    holds: "A condition asks for an entry that exists and is a number.",
    explain: "Generated code and the tools read the entry to decide which unit or range applies.",
    help: "",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    for (condition, span) in &context.changes.conditions {
        match context.device.entry(condition.index, condition.sub) {
            Some(entry) if entry.data_type.range().is_some() => {}
            Some(entry) => out.push(RULE.finding(format!("{} is no number", entry.data_type)).at(*span, "")),
            None => {
                let message = format!("the data sheet has no {:04X}:{:02X}", condition.index, condition.sub);
                out.push(RULE.finding(message).at(*span, ""));
            }
        }
    }
}
