//! Sub-index 0 of an array or record is an UNSIGNED8.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::model::ObjectKind;
use crate::object::Key;
use crate::types::DataType;

pub(crate) const RULE: Rule = Rule {
    code: "eds::sub-0-type",
    severity: Severity::Warning,
    holds: "Sub-index 0 of an array or record is an UNSIGNED8.",
    explain: "The highest sub-index has one byte (CiA 301, 7.4.3). A device answers with one byte whatever the data \
              sheet says.",
    help: "an overlay can correct it: `data_type = \"UNSIGNED8\"` with a reason",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    let with_subs =
        context.objects().filter(|(object, _)| matches!(object.kind, ObjectKind::Array | ObjectKind::Record));
    for entry in with_subs.filter_map(|(object, _)| object.entry(0)) {
        if entry.data_type != DataType::Unsigned8 && !entry.data_type.is_unknown() {
            let finding = RULE.finding(format!("{:04X}:00 is {}", entry.index, entry.data_type));
            out.push(finding.at(context.entry_span(entry, Key::DataType), "expected UNSIGNED8"));
        }
    }
}
