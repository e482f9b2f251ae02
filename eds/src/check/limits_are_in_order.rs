//! The low limit is not above the high limit.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::model::Value;
use crate::object::Key;

pub(crate) const RULE: Rule = Rule {
    code: "eds::limits-reversed",
    severity: Severity::Warning,
    holds: "The low limit is not above the high limit.",
    explain: "No value can lie between reversed limits. Often a limit of a signed type was written as an unsigned \
              number, or one line was lost.",
    help: "",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    for entry in context.device.entries() {
        let Some((low, high)) = entry.low.as_ref().zip(entry.high.as_ref()) else { continue };
        let reversed = match (low, high) {
            (Value::Integer(low), Value::Integer(high)) => low > high,
            (Value::Real(low), Value::Real(high)) => low > high,
            (Value::NodeIdPlus(low), Value::NodeIdPlus(high)) => low > high,
            _ => false,
        };
        if reversed {
            let finding = RULE.finding(format!("the limits of {:04X}:{:02X} are reversed", entry.index, entry.sub));
            let finding = finding.at(context.entry_span(entry, Key::LowLimit), "the low one");
            let finding = finding.and(context.entry_span(entry, Key::HighLimit), "the high one");
            out.push(finding.help(super::OVERLAY_LIMITS));
        }
    }
}
