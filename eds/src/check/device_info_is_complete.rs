//! DeviceInfo says who made what, and what it can do.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::section::SectionKind;

pub(crate) const RULE: Rule = Rule {
    code: "eds::missing-device-info",
    severity: Severity::Note,
    holds: "DeviceInfo says who made what, and what it can do.",
    explain: "CiA 306-1 (6.4) requires these keys. What is missing is read as unknown, or as not supported.",
    help: "",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    const REQUIRED: [&str; 7] =
        ["VendorName", "VendorNumber", "ProductName", "ProductNumber", "Granularity", "NrOfRXPDO", "NrOfTXPDO"];
    let Some(section) = context.facts.section(SectionKind::DeviceInfo) else { return };
    let missing: Vec<&str> = REQUIRED.into_iter().filter(|key| section.get(key).is_none()).collect();
    if !missing.is_empty() {
        let finding = RULE.finding(format!("`[DeviceInfo]` does not say {}", missing.join(", ")));
        out.push(finding.at(context.facts.syntax.name_span(section), ""));
    }
}
