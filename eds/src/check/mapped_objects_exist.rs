//! What a PDO maps is in the data sheet.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};

pub(crate) const RULE: Rule = Rule {
    code: "pdo::missing-object",
    severity: Severity::Warning,
    holds: "What a PDO maps is in the data sheet.",
    explain: "A mapping names entries by index, sub-index and length. What is not there cannot be decoded.",
    help: "an overlay can describe the PDO: `[[pdo]]` with `direction`, `number` and `mapping`",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    for (pdo, number, mapped) in context.mapped() {
        let there = context.device.entry(mapped.index, mapped.sub).is_some();
        if !there && !super::is_dummy(mapped) {
            let finding = RULE.finding(format!("there is no {:04X}:{:02X} to map", mapped.index, mapped.sub));
            out.push(finding.at(context.mapping_span(pdo, number), "mapped here"));
        }
    }
}
