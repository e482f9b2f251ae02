//! Every module that a DCF plugs in is one that the device supports.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::section::SectionKind;

pub(crate) const RULE: Rule = Rule {
    code: "eds::unsupported-module",
    severity: Severity::Warning,
    holds: "Every module that a DCF plugs in is one that the device supports.",
    explain: "`[ConnectedModules]` names modules by their number in `[SupportedModules]`.",
    help: "",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    let Some(section) = context.facts.section(SectionKind::ConnectedModules) else { return };
    for &number in &context.device.connected_modules {
        if context.device.modules.binary_search_by_key(&number, |module| module.number).is_err() {
            let finding = RULE.finding(format!("there is no module {number}"));
            out.push(finding.at(context.facts.syntax.name_span(section), "plugged in here"));
        }
    }
}
