//! The default of sub-index 0 is the highest sub-index.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::model::{ObjectKind, Value};
use crate::object::Key;

pub(crate) const RULE: Rule = Rule {
    code: "eds::highest-sub",
    severity: Severity::Warning,
    holds: "The default of sub-index 0 is the highest sub-index.",
    explain: "Sub-index 0 says how far to read (CiA 301, 7.4.3). The number of faults in 1003h and the number of \
              objects in a mapping are not meant.",
    help: "an overlay can correct it: `default` of sub-index 00, with a reason",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    for (object, facts) in context.objects() {
        let counts = matches!(object.index, 0x1003 | 0x1600..=0x17FF | 0x1A00..=0x1BFF) || facts.compact > 0;
        if counts || !matches!(object.kind, ObjectKind::Array | ObjectKind::Record) {
            continue;
        }
        let highest = object.entries.iter().rev().find(|entry| entry.sub != 0xFF);
        let Some((count, highest)) = object.entry(0).zip(highest) else { continue };
        let Some(Value::Integer(said)) = count.default else { continue };
        if said != i128::from(highest.sub) {
            let finding = RULE.finding(format!("the highest sub-index is {}, not {said}", highest.sub));
            let span = context.entry_span(count, Key::DefaultValue);
            let finding = finding.at(span, "says otherwise").and(highest.span, "the highest one");
            let overlay = format!("`[object.\"{:04X}:00\"]`, `default = {}` with a reason", object.index, highest.sub);
            out.push(finding.help(format!("an overlay can correct it: {overlay}")));
        }
    }
}
