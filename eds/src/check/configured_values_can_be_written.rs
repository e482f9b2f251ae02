//! The values of a DCF can be written.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::object::Key;

pub(crate) const RULE: Rule = Rule {
    code: "eds::value-not-writable",
    severity: Severity::Note,
    holds: "The values of a DCF can be written.",
    explain: "A value for what cannot be written is not downloaded; it tells what the device had.",
    help: "an overlay can correct it: `access = \"rw\"` with a reason",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    for entry in context.device.entries().filter(|entry| entry.configured.is_some() && !entry.access.writable()) {
        if entry.configured != entry.default {
            let message = format!("{:04X}:{:02X} is {}", entry.index, entry.sub, entry.access.name());
            out.push(RULE.finding(message).at(context.entry_span(entry, Key::ParameterValue), "cannot be written"));
        }
    }
}
