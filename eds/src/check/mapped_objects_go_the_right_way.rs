//! Receive PDOs write what can be written, transmit PDOs read what can be read.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::model::{AccessType, Direction};
use crate::object::Key;

pub(crate) const RULE: Rule = Rule {
    code: "pdo::wrong-direction",
    severity: Severity::Warning,
    holds: "Receive PDOs write what can be written, transmit PDOs read what can be read.",
    explain: "An entry that is `ro` cannot be set by a receive PDO, and one that is `wo` cannot be sent; `rwr` is for \
              transmit PDOs and `rww` for receive PDOs.",
    help: "an overlay can correct the access type: `access = \"rww\"` with a reason, or describe the PDO: `[[pdo]]`",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    for (pdo, number, mapped) in context.mapped() {
        let Some(entry) = context.device.entry(mapped.index, mapped.sub) else { continue };
        let wrong = match pdo.direction {
            Direction::Receive => matches!(entry.access, AccessType::Ro | AccessType::Const | AccessType::Rwr),
            Direction::Transmit => matches!(entry.access, AccessType::Wo | AccessType::Rww),
        };
        if wrong {
            let access = entry.access.name();
            let message =
                format!("{} maps {:04X}:{:02X}, which is {access}", super::pdo_name(pdo), entry.index, entry.sub);
            let finding = RULE.finding(message).at(context.mapping_span(pdo, number), "mapped here");
            out.push(finding.and(context.entry_span(entry, Key::AccessType), "the access type"));
        }
    }
}
