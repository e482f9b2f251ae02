//! Guard time and life time factor come together.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};

pub(crate) const RULE: Rule = Rule {
    code: "cia301::half-guarding",
    severity: Severity::Warning,
    holds: "Guard time and life time factor come together.",
    explain: "The life time is the product of 100Ch and 100Dh (CiA 301, 7.5.2.11); one without the other means \
              nothing.",
    help: "",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    for (one, other) in [(0x100C, 0x100D), (0x100D, 0x100C)] {
        if let (Some(object), None) = (context.device.object(one), context.device.object(other)) {
            out.push(RULE.finding(format!("there is {one:04X}, but no {other:04X}")).at(object.span, ""));
        }
    }
}
