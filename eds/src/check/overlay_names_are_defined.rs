//! Every quantity, enumeration and bit field that is used is defined.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::model::Meaning;

pub(crate) const RULE: Rule = Rule {
    code: "overlay::undefined-name",
    severity: Severity::Error,
    holds: "Every quantity, enumeration and bit field that is used is defined.",
    explain: "The name must be that of a table `[quantity.…]`, `[enumeration.…]` or `[bit_field.…]` of the overlay, in \
              the same case.",
    help: "",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    for used in &context.changes.uses {
        let (kind, name, defined) = match &used.meaning {
            Meaning::Plain => continue,
            Meaning::Quantity(name) => ("quantity", name, context.device.quantities.contains_key(name)),
            Meaning::Enumeration(name) => ("enumeration", name, context.device.enumerations.contains_key(name)),
            Meaning::BitField(name) => ("bit_field", name, context.device.bit_fields.contains_key(name)),
        };
        if !defined {
            let finding = RULE.finding(format!("there is no {} `{name}`", kind.replace('_', " "))).at(used.span, "");
            out.push(finding.help(format!("add `[{kind}.{name}]` to the overlay")));
        }
    }
}
