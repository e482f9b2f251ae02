//! Every quantity, enumeration and bit field that is defined is used.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::model::Meaning;
use crate::source::Span;

pub(crate) const RULE: Rule = Rule {
    code: "overlay::unused-name",
    severity: Severity::Warning,
    holds: "Every quantity, enumeration and bit field that is defined is used.",
    explain: "An unused table is left over, or its name is misspelt where it should be used.",
    help: "",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    let used = |meaning: Meaning| context.changes.uses.iter().any(|used| used.meaning == meaning);
    let mut unused = |kind: &str, name: &str, span: Span| {
        out.push(RULE.finding(format!("the {kind} `{name}` is not used")).at(span, ""));
    };
    for (name, quantity) in &context.device.quantities {
        if !used(Meaning::Quantity(name.clone())) {
            unused("quantity", name, quantity.span);
        }
    }
    for (name, enumeration) in &context.device.enumerations {
        if !used(Meaning::Enumeration(name.clone())) {
            unused("enumeration", name, enumeration.span);
        }
    }
    for (name, bit_field) in &context.device.bit_fields {
        if !used(Meaning::BitField(name.clone())) {
            unused("bit field", name, bit_field.span);
        }
    }
}
