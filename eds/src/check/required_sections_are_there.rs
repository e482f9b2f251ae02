//! FileInfo, DeviceInfo and MandatoryObjects are there.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::section::SectionKind;
use crate::source::Span;

pub(crate) const RULE: Rule = Rule {
    code: "eds::missing-section",
    severity: Severity::Warning,
    holds: "FileInfo, DeviceInfo and MandatoryObjects are there.",
    explain: "CiA 306-1 requires the three sections; other readers refuse the file without them. What they say is \
              unknown then, and objects are read from their sections all the same.",
    help: "",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    let required = [
        (SectionKind::FileInfo, "FileInfo"),
        (SectionKind::DeviceInfo, "DeviceInfo"),
        (SectionKind::MandatoryObjects, "MandatoryObjects"),
    ];
    for (kind, name) in required {
        if context.facts.section(kind).is_none() {
            out.push(RULE.finding(format!("the section `[{name}]` is missing")).at(Span::eds(0, 0), ""));
        }
    }
}
