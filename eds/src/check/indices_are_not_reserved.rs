//! The index of an object is not reserved.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};

pub(crate) const RULE: Rule = Rule {
    code: "eds::reserved-index",
    severity: Severity::Warning,
    holds: "The index of an object is not reserved.",
    explain: "CiA 301 (7.4.1) reserves 0000h, 0260h to 0FFFh and C000h to FFFFh.",
    help: "",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    for (object, _) in context.objects() {
        if matches!(object.index, 0 | 0x260..=0xFFF | 0xC000..) {
            out.push(RULE.finding(format!("the index {:04X} is reserved", object.index)).at(object.span, ""));
        }
    }
}
