//! The device supports at least one bit rate.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::section::SectionKind;

pub(crate) const RULE: Rule = Rule {
    code: "eds::no-bit-rate",
    severity: Severity::Warning,
    holds: "The device supports at least one bit rate.",
    explain: "Every `BaudRate_` is 0 or missing, so no bus could have the device on it.",
    help: "",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    let Some(section) = context.facts.section(SectionKind::DeviceInfo) else { return };
    if context.device.info.bit_rates_kbit.is_empty() {
        let span = context.facts.syntax.name_span(section);
        out.push(RULE.finding("the device supports no bit rate").at(span, "no `BaudRate_` is 1"));
    }
}
