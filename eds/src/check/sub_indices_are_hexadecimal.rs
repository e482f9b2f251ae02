//! The sub-index in the name of a section is hexadecimal.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};

pub(crate) const RULE: Rule = Rule {
    code: "eds::decimal-sub-index",
    severity: Severity::Warning,
    holds: "The sub-index in the name of a section is hexadecimal.",
    explain: "After `[2000sub9]` comes `[2000subA]`; `[2000sub10]` is sub-index 16. A gap from 0Ah to 0Fh looks as if \
              somebody had counted in decimal.",
    help: "",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    for (object, facts) in context.objects().filter(|(_, facts)| facts.compact == 0) {
        let Some(ten) = object.entry(0x10) else { continue };
        let counted = object.entry(9).is_some() && (0x0A..=0x0F).all(|sub| object.entry(sub).is_none());
        if counted && facts.subs > 0 {
            let finding = RULE.finding("the sub-indices seem to be counted in decimal");
            out.push(finding.at(ten.span, "this is sub-index 16, and 10 to 15 are missing"));
        }
    }
}
