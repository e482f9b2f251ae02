//! What is const has a default.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::model::AccessType;
use crate::object::Key;

pub(crate) const RULE: Rule = Rule {
    code: "eds::constant-without-default",
    severity: Severity::Note,
    holds: "What is const has a default.",
    explain: "A constant never changes, so the data sheet can say its value (CiA 306-1, 6.5.2).",
    help: "an overlay can correct it: `default = 1` with a reason",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    for entry in context.device.entries() {
        let number = entry.data_type.bits().is_some();
        if entry.access == AccessType::Const && entry.default.is_none() && entry.configured.is_none() && number {
            let finding = RULE.finding(format!("the constant {:04X}:{:02X} has no value", entry.index, entry.sub));
            out.push(finding.at(context.entry_span(entry, Key::AccessType), ""));
        }
    }
}
