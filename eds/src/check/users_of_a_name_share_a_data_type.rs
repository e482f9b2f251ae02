//! All users of a quantity, enumeration or bit field have the same data type.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::overlay::Use;

pub(crate) const RULE: Rule = Rule {
    code: "overlay::mixed-types",
    severity: Severity::Error,
    holds: "All users of a quantity, enumeration or bit field have the same data type.",
    explain: "Each becomes one type in generated code, with one size on the bus. Give the entries of another data type \
              a table of their own.",
    help: "",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    let data_type = |used: &Use| context.device.entry(used.index, used.sub).map(|entry| entry.data_type);
    let mut first: Vec<&Use> = Vec::new();
    for used in &context.changes.uses {
        let Some(earlier) = first.iter().find(|earlier| earlier.meaning == used.meaning) else {
            first.push(used);
            continue;
        };
        if let (Some(a), Some(b)) = (data_type(earlier), data_type(used))
            && a != b
        {
            out.push(
                RULE.finding("entries of different data types share a meaning")
                    .at(used.span, format!("{:04X}:{:02X} is {b}", used.index, used.sub))
                    .and(earlier.span, format!("{:04X}:{:02X} is {a}", earlier.index, earlier.sub)),
            );
        }
    }
}
