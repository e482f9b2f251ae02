//! Every sub-index belongs to an object with a section.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};

pub(crate) const RULE: Rule = Rule {
    code: "eds::sub-without-object",
    severity: Severity::Warning,
    holds: "Every sub-index belongs to an object with a section.",
    explain: "Without the section of the object its name and type are unknown. It is read as a RECORD without name.",
    help: "",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    for (object, facts) in context.objects() {
        if !facts.header {
            let finding = RULE.finding(format!("the section `[{:04X}]` is missing", object.index));
            out.push(finding.at(object.span, "belongs to it"));
        }
    }
}
