//! Every supported module is described.

use std::collections::BTreeSet;

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::section::SectionKind;

pub(crate) const RULE: Rule = Rule {
    code: "eds::module-without-section",
    severity: Severity::Warning,
    holds: "Every supported module is described.",
    explain: "`[SupportedModules]` says how many modules there are; each has a section `[M1ModuleInfo]` and so on.",
    help: "",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    let sections = context.facts.syntax.sections.iter();
    let described: BTreeSet<u16> = sections.filter_map(|section| section.kind.module()).collect();
    let Some(section) = context.facts.section(SectionKind::SupportedModules) else { return };
    for module in context.device.modules.iter().filter(|module| !described.contains(&module.number)) {
        let finding = RULE.finding(format!("the module {} is not described", module.number));
        out.push(finding.at(context.facts.syntax.name_span(section), ""));
    }
}
