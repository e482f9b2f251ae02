//! A PDO maps at most 64 bits.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};

pub(crate) const RULE: Rule = Rule {
    code: "pdo::too-long",
    severity: Severity::Warning,
    holds: "A PDO maps at most 64 bits.",
    explain: "A CAN frame has eight bytes (CiA 301, 7.2.2). A device refuses a longer mapping.",
    help: "an overlay can describe the PDO: `[[pdo]]` with `direction`, `number` and `mapping`",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    for pdo in &context.device.pdos {
        let bits: u32 = pdo.mapping.iter().map(|mapped| u32::from(mapped.bits)).sum();
        if bits > 64 {
            let finding = RULE.finding(format!("{} maps {bits} bits", super::pdo_name(pdo)));
            out.push(finding.at(context.mapping_span(pdo, 0), "at most 64 fit into a frame"));
        }
    }
}
