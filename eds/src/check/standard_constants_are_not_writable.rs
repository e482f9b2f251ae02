//! What CiA 301 fixes cannot be written.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::object::Key;

pub(crate) const RULE: Rule = Rule {
    code: "cia301::writable",
    severity: Severity::Warning,
    holds: "What CiA 301 fixes cannot be written.",
    explain: "Device type, error register, identity and the entries of the error history are read-only in every device \
              (CiA 301, 7.5.2).",
    help: "an overlay can correct it: `access = \"ro\"` with a reason",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    for entry in context.device.entries() {
        let fixed = match entry.index {
            0x1000..=0x1002 | 0x1008..=0x100A | 0x1018 => true,
            0x1003 => entry.sub > 0,
            _ => false,
        };
        if fixed && entry.access.writable() {
            let message = format!("{:04X}:{:02X} is {}", entry.index, entry.sub, entry.access.name());
            out.push(RULE.finding(message).at(context.entry_span(entry, Key::AccessType), "read-only in CiA 301"));
        }
    }
}
