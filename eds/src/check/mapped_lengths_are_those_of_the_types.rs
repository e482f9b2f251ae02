//! A mapping takes as many bits as the data type has.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::object::Key;
use crate::types::DataType;

pub(crate) const RULE: Rule = Rule {
    code: "pdo::wrong-length",
    severity: Severity::Warning,
    holds: "A mapping takes as many bits as the data type has.",
    explain: "Eight bits of the mapping word are the length (CiA 301, 7.5.2.36). A device that maps another length \
              than the data type has refuses it, or shifts all that follows.",
    help: "an overlay can correct the data type: `data_type` with a reason, or describe the PDO: `[[pdo]]`",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    for (pdo, number, mapped) in context.mapped() {
        let entry = context.device.entry(mapped.index, mapped.sub);
        let data_type = match entry {
            Some(entry) => entry.data_type,
            None => DataType::from_code(mapped.index),
        };
        let Some(bits) = context.device.bits(data_type).filter(|&bits| bits != mapped.bits) else { continue };
        // A BOOLEAN in a byte of its own is common and harmless.
        if data_type == DataType::Boolean && mapped.bits == 8 {
            continue;
        }
        let finding = RULE.finding(format!("{data_type} has {bits} bits, not {}", mapped.bits));
        let finding = finding.at(context.mapping_span(pdo, number), "mapped here");
        out.push(match entry {
            Some(entry) => finding.and(context.entry_span(entry, Key::DataType), "the data type"),
            None => finding,
        });
    }
}
