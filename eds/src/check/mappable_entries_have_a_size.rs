//! What can be mapped into a PDO has a fixed size of at most 64 bits.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::object::Key;
use crate::types::DataType;

pub(crate) const RULE: Rule = Rule {
    code: "eds::unmappable-type",
    severity: Severity::Warning,
    holds: "What can be mapped into a PDO has a fixed size of at most 64 bits.",
    explain: "A PDO has eight bytes (CiA 301, 7.2.2). Strings and domains cannot be mapped.",
    help: "an overlay can correct it: `pdo_mapping = false` with a reason",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    for entry in context.device.entries().filter(|entry| entry.pdo_mapping) {
        if entry.data_type.bits().is_none() && !matches!(entry.data_type, DataType::Other(_)) {
            let finding = RULE.finding(format!("{} cannot be mapped into a PDO", entry.data_type));
            let finding = finding.at(context.entry_span(entry, Key::PdoMapping), "says that it can");
            out.push(finding.and(context.entry_span(entry, Key::DataType), "the data type"));
        }
    }
}
