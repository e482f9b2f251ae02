//! A heartbeat consumer time names a node-ID up to 127.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::model::Value;
use crate::object::Key;

pub(crate) const RULE: Rule = Rule {
    code: "cia301::heartbeat-consumer",
    severity: Severity::Warning,
    holds: "A heartbeat consumer time names a node-ID up to 127.",
    explain: "Bits 16 to 23 of 1016h are the node-ID, bits 0 to 15 the time in ms; the rest is 0 (CiA 301, 7.5.2.19).",
    help: "an overlay can correct it: `default = 1` with a reason",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    let Some(object) = context.device.object(0x1016) else { return };
    for entry in object.entries.iter().filter(|entry| entry.sub > 0) {
        let Some(value) = crate::pdo::held(entry).and_then(Value::as_integer) else { continue };
        if value >> 16 > 127 {
            let finding = RULE.finding(format!("1016:{:02X} watches a node-ID that does not exist", entry.sub));
            out.push(finding.at(context.entry_span(entry, Key::DefaultValue), ""));
        }
    }
}
