//! Every object and every entry has a name.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};

pub(crate) const RULE: Rule = Rule {
    code: "eds::missing-name",
    severity: Severity::Warning,
    holds: "Every object and every entry has a name.",
    explain: "Without `ParameterName` tools have only the address to show, and generated code only the address to go \
              by.",
    help: "",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    for (object, _) in context.objects() {
        if object.name.is_empty() {
            let finding = RULE.finding(format!("the object {:04X} has no name", object.index)).at(object.span, "");
            out.push(finding.help("an overlay can name it: `name = \"…\"`"));
        }
        for entry in object.entries.iter().filter(|entry| object.kind.has_subs() && entry.name.is_empty()) {
            let finding = RULE.finding(format!("the entry {:04X}:{:02X} has no name", entry.index, entry.sub));
            out.push(finding.at(entry.span, "").help("an overlay can name it: `name = \"…\"`"));
        }
    }
}
