//! The objects that the device profile demands are there.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::source::Span;

pub(crate) const RULE: Rule = Rule {
    code: "cia402::missing-object",
    severity: Severity::Warning,
    holds: "The objects that the device profile demands are there.",
    explain: "A drive of CiA 402 has a controlword (6040h) and a statusword (6041h).",
    help: "an overlay can name another profile: `profile = 401` under `[overlay]`",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    if context.device.profile != Some(402) {
        return;
    }
    // Multiple axes have the same objects 800h apart, and devices may begin with any.
    let axes = || (0..8).map(|axis| axis * 0x800);
    for (index, name) in [(0x6040, "controlword"), (0x6041, "statusword")] {
        if axes().all(|axis| context.device.object(index + axis).is_none()) {
            let device_type = context.device.object(0x1000).map_or(Span::eds(0, 0), |object| object.span);
            out.push(RULE.finding(format!("the {name} ({index:04X}) is missing")).at(device_type, "says CiA 402"));
        }
    }
}
