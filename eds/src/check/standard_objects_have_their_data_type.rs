//! Objects of CiA 301 and of the profile have the data type of the standard.

use super::standard;
use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::model::Entry;
use crate::object::Key;

pub(crate) const RULE: Rule = Rule {
    code: "cia301::data-type",
    severity: Severity::Warning,
    holds: "Objects of CiA 301 and of the profile have the data type of the standard.",
    explain: "A tool that knows the standard transfers as many bytes as the standard says. Where the data sheet is \
              wrong and not the device, an overlay corrects it.",
    help: "",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    for (object, _) in context.objects() {
        let Some(standard) = standard::object(object.index, context.device.profile) else { continue };
        let differs = |entry: &&Entry| {
            let expected = standard.data_type(entry.sub);
            expected.is_some_and(|expected| entry.data_type != expected && !entry.data_type.is_unknown())
        };
        let different: Vec<&Entry> = object.entries.iter().filter(differs).collect();
        let Some((&first, others)) = different.split_first() else { continue };
        let Some(expected) = standard.data_type(first.sub) else { continue };
        let place = format!("{:04X}:{:02X}", first.index, first.sub);
        let finding = RULE.finding(format!("{place} is {}, in {} {expected}", first.data_type, standard.source));
        let more = match others.len() {
            0 => String::new(),
            count => format!("and {} more", super::plural(count, "sub-index")),
        };
        let finding = finding.at(context.entry_span(first, Key::DataType), more);
        out.push(finding.help(format!(
            "if the device follows the standard: `data_type = \"{expected}\"` with a reason; else `accept = [\"{}\"]`",
            RULE.code
        )));
    }
}
