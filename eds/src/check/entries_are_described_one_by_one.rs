//! Every entry has a section of its own.

use super::{Context, Rule, plural};
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

/// So many places are shown.
const MAX_PLACES: usize = 3;

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    let compact: Vec<_> = context.objects().filter(|(_, facts)| facts.compact > 0).map(|(object, _)| object).collect();
    let entries = plural(compact.iter().map(|object| object.entries.len()).sum(), "entry");
    let message = match compact.as_slice() {
        [] => return,
        [only] => format!("the section of {:04X} stands for {entries}", only.index),
        several => format!("the sections of {} stand for {entries}", plural(several.len(), "object")),
    };
    let mut finding = RULE.finding(message);
    for (at, object) in compact.iter().take(MAX_PLACES).enumerate() {
        let span = context.value_span(object.span, Key::CompactSubObj);
        finding = if at == 0 { finding.at(span, "") } else { finding.and(span, "") };
    }
    out.push(finding);
}
