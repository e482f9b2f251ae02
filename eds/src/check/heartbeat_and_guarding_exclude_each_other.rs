//! Heartbeat and node guarding are not both active by default.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::model::Value;
use crate::object::Key;

pub(crate) const RULE: Rule = Rule {
    code: "cia301::two-error-controls",
    severity: Severity::Warning,
    holds: "Heartbeat and node guarding are not both active by default.",
    explain: "A device uses one error control at a time (CiA 301); with a heartbeat time other than 0 it does not \
              answer guarding.",
    help: "an overlay can correct the default: `default = 0` with a reason",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    let active = |index: u16| {
        let entry = context.device.entry(index, 0)?;
        crate::pdo::held(entry).and_then(Value::as_integer).filter(|&time| time > 0).map(|_| entry)
    };
    if let (Some(heartbeat), Some(guarding), Some(_)) = (active(0x1017), active(0x100C), active(0x100D)) {
        let finding = RULE.finding("heartbeat and node guarding are both active by default");
        let finding = finding.at(context.entry_span(heartbeat, Key::DefaultValue), "the heartbeat");
        out.push(finding.and(context.entry_span(guarding, Key::DefaultValue), "the guard time"));
    }
}
