//! The device has heartbeat or node guarding.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::source::Span;

pub(crate) const RULE: Rule = Rule {
    code: "cia301::no-error-control",
    severity: Severity::Warning,
    holds: "The device has heartbeat or node guarding.",
    explain: "CiA 301 demands one of them: the heartbeat producer time 1017h, or guard time 100Ch and life time factor \
              100Dh. Without it nobody notices that the device is gone.",
    help: "",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    let there = |index: u16| context.device.object(index).is_some();
    if !context.device.objects.is_empty() && !there(0x1017) && !there(0x100C) {
        let span = context.device.objects.first().map_or(Span::default(), |object| object.span);
        out.push(RULE.finding("the device has neither heartbeat (1017) nor node guarding (100C, 100D)").at(span, ""));
    }
}
