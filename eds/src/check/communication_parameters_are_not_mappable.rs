//! Communication parameters are not mapped into PDOs.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::object::Key;

pub(crate) const RULE: Rule = Rule {
    code: "eds::mappable-parameter",
    severity: Severity::Note,
    holds: "Communication parameters are not mapped into PDOs.",
    explain: "Of the communication profile area only the error register 1001h and a few status words make sense in a \
              PDO.",
    help: "an overlay can correct it: `pdo_mapping = false` with a reason",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    let parameters = context.device.entries().filter(|entry| matches!(entry.index, 0x1005..=0x1007 | 0x1010..=0x1BFF));
    for entry in parameters.filter(|entry| entry.pdo_mapping) {
        let finding = RULE.finding(format!("the parameter {:04X}:{:02X} is mappable", entry.index, entry.sub));
        out.push(finding.at(context.entry_span(entry, Key::PdoMapping), ""));
    }
}
