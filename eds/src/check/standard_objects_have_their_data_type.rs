//! Objects of CiA 301 and of the profile have the data type of the standard.

use crate::diagnostics::{Diagnostics, Severity};
use crate::object::Key;
use super::{Context, Rule};
use super::standard;

pub(crate) const RULE: Rule = Rule {
    code: "cia301::data-type",
    severity: Severity::Warning,
    holds: "Objects of CiA 301 and of the profile have the data type of the standard.",
    explain: "A tool that knows the standard transfers as many bytes as the standard says. Where the data sheet is \
              wrong and not the device, an overlay corrects it.",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    for entry in context.device.entries() {
        let Some(standard) = standard::object(entry.index, context.device.profile) else { continue };
        let Some(expected) = standard.data_type(entry.sub) else { continue };
        if entry.data_type != expected && !entry.data_type.is_unknown() {
            let place = format!("{:04X}:{:02X}", entry.index, entry.sub);
            let finding = RULE.finding(format!("{place} is {}, in {} {expected}", entry.data_type, standard.source));
            let finding = finding.at(context.entry_span(entry, Key::DataType), "");
            out.push(finding.help(format!("if the device follows the standard: `data_type = \"{expected}\"` with a reason")));
        }
    }
}
