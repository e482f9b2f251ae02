//! Every entry has a section of its own.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::object::Key;

pub(crate) const RULE: Rule = Rule {
    code: "eds::compact-entries",
    severity: Severity::Note,
    holds: "Every entry has a section of its own.",
    explain: "`CompactSubObj` describes all entries of an object at once. They are written out here, so the device has \
              more entries than the file has sections; other readers may see none of them.",
    help: "",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    for (object, facts) in context.objects().filter(|(_, facts)| facts.compact > 0) {
        let entries = super::plural(object.entries.len(), "entry");
        let finding = RULE.finding(format!("the section of {:04X} stands for {entries}", object.index));
        let own = super::plural(facts.subs, "section");
        out.push(finding.at(context.value_span(object.span, Key::CompactSubObj), format!("{own} of their own")));
    }
}
