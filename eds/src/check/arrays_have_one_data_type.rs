//! The entries of an array have one data type.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::model::ObjectKind;
use crate::object::Key;

pub(crate) const RULE: Rule = Rule {
    code: "eds::array-types",
    severity: Severity::Warning,
    holds: "The entries of an array have one data type.",
    explain: "What has several data types is a RECORD (CiA 301, table 42). Each entry keeps the data type that it \
              names.",
    help: "an overlay can correct it: `data_type = \"UNSIGNED16\"` with a reason",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    for (object, _) in context.objects().filter(|(object, _)| object.kind == ObjectKind::Array) {
        let Some(first) = object.entries.iter().find(|entry| entry.sub > 0) else { continue };
        let other = object.entries.iter().find(|entry| entry.sub > 0 && entry.data_type != first.data_type);
        if let Some(other) = other {
            let finding = RULE.finding(format!("the entries of the array {:04X} differ in type", object.index));
            let finding = finding.at(context.entry_span(other, Key::DataType), other.data_type.to_string());
            out.push(finding.and(context.entry_span(first, Key::DataType), first.data_type.to_string()));
        }
    }
}
