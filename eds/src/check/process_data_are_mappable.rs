//! What is rwr or rww can be mapped.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::model::AccessType;
use crate::object::Key;

pub(crate) const RULE: Rule = Rule {
    code: "eds::rwr-not-mappable",
    severity: Severity::Note,
    holds: "What is rwr or rww can be mapped.",
    explain: "`rwr` and `rww` say into which PDOs an entry can be mapped (CiA 306-1, 6.5.2), which makes no sense when \
              it cannot.",
    help: "an overlay can correct it: `pdo_mapping = true`, or `access = \"rw\"`, with a reason",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    for entry in context.device.entries().filter(|entry| !entry.pdo_mapping) {
        if matches!(entry.access, AccessType::Rwr | AccessType::Rww) {
            let message = format!("{:04X}:{:02X} is {}, but not mappable", entry.index, entry.sub, entry.access.name());
            out.push(RULE.finding(message).at(context.entry_span(entry, Key::AccessType), ""));
        }
    }
}
