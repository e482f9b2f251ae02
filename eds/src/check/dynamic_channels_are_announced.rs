//! `DynamicChannelsSupported` and `[DynamicChannels]` agree.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::section::SectionKind;

pub(crate) const RULE: Rule = Rule {
    code: "eds::dynamic-channels",
    severity: Severity::Warning,
    holds: "`DynamicChannelsSupported` and `[DynamicChannels]` agree.",
    explain: "A device either has segments for network variables (CiA 302-4) and says so, or neither.",
    help: "",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    let announced = context.device.info.dynamic_channels;
    let described = context.facts.section(SectionKind::DynamicChannels);
    let device_info = context.facts.section(SectionKind::DeviceInfo);
    let syntax = &context.facts.syntax;
    if let (false, Some(section)) = (announced, described) {
        let finding = RULE.finding("there are dynamic channels, but `DynamicChannelsSupported` is 0");
        out.push(finding.at(syntax.name_span(section), ""));
    }
    if let (true, None, Some(section)) = (announced, described, device_info)
        && let Some(pair) = section.get("DynamicChannelsSupported")
    {
        let finding = RULE.finding("dynamic channels are announced, but `[DynamicChannels]` is missing");
        out.push(finding.at(syntax.value_span(pair), ""));
    }
}
