//! The bit rate of a DCF is one that the device supports.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::section::SectionKind;

pub(crate) const RULE: Rule = Rule {
    code: "eds::unsupported-bit-rate",
    severity: Severity::Warning,
    holds: "The bit rate of a DCF is one that the device supports.",
    explain: "The bit rate under `[DeviceComissioning]` must be one whose `BaudRate_` in `[DeviceInfo]` is 1.",
    help: "",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    let supported = &context.device.info.bit_rates_kbit;
    let bit_rate = context.device.commissioning.as_ref().and_then(|commissioning| commissioning.bit_rate_kbit);
    let Some(bit_rate) = bit_rate.filter(|rate| !supported.is_empty() && !supported.contains(rate)) else { return };
    let section = context.facts.section(SectionKind::Commissioning);
    let Some(pair) = section.and_then(|section| section.get("Baudrate")) else { return };
    let span = context.facts.syntax.value_span(pair);
    out.push(RULE.finding(format!("the device does not support {bit_rate} kbit/s")).at(span, ""));
}
