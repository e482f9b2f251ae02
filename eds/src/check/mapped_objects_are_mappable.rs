//! What a PDO maps can be mapped.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::object::Key;

pub(crate) const RULE: Rule = Rule {
    code: "pdo::not-mappable",
    severity: Severity::Warning,
    holds: "What a PDO maps can be mapped.",
    explain: "`PDOMapping` of the entry is 0, so the device should refuse the mapping that it has by default.",
    help: "",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    for (pdo, number, mapped) in context.mapped() {
        let Some(entry) = context.device.entry(mapped.index, mapped.sub) else { continue };
        if !entry.pdo_mapping && !super::is_dummy(mapped) {
            let finding = RULE.finding(format!("{:04X}:{:02X} is mapped, but not mappable", mapped.index, mapped.sub));
            let finding = finding.at(context.mapping_span(pdo, number), "mapped here");
            let finding = finding.and(context.entry_span(entry, Key::PdoMapping), "says that it cannot");
            out.push(finding.help("an overlay can say which is right: `pdo_mapping = true` with a reason"));
        }
    }
}
