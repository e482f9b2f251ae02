//! The limits of what can be written differ.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::object::Key;

pub(crate) const RULE: Rule = Rule {
    code: "eds::equal-limits",
    severity: Severity::Note,
    holds: "The limits of what can be written differ.",
    explain: "When both limits are the same, one value only can be written. Editors write 0 and 0 where nothing was \
              entered.",
    help: "",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    for entry in context.device.entries().filter(|entry| entry.access.writable() && entry.low.is_some()) {
        if entry.low == entry.high {
            let finding = RULE.finding(format!("{:04X}:{:02X} can have one value only", entry.index, entry.sub));
            let finding = finding.at(context.entry_span(entry, Key::LowLimit), "");
            let finding = finding.and(context.entry_span(entry, Key::HighLimit), "the same");
            out.push(finding.help(super::OVERLAY_LIMITS));
        }
    }
}
