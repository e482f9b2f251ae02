//! A name has at most 241 characters.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::object::Key;

pub(crate) const RULE: Rule = Rule {
    code: "eds::long-name",
    severity: Severity::Note,
    holds: "A name has at most 241 characters.",
    explain: "CiA 306-1 (6.5.2) limits `ParameterName` to 241 characters; other readers may cut it there.",
    help: "an overlay can give another name: `name = \"Speed\"`",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    for entry in context.device.entries() {
        let length = entry.name.chars().count();
        if length > 241 {
            let span = context.entry_span(entry, Key::ParameterName);
            out.push(RULE.finding(format!("the name has {length} characters")).at(span, ""));
        }
    }
}
