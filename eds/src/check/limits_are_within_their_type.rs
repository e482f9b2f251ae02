//! Limits are numbers of the data type.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::object::Key;

pub(crate) const RULE: Rule = Rule {
    code: "eds::limit-outside-type",
    severity: Severity::Warning,
    holds: "Limits are numbers of the data type.",
    explain: "A limit that the data type cannot have limits nothing. Either the limit or the data type is wrong.",
    help: "an overlay can correct it: `default`, `low`, `high` or `data_type` with a reason",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    for entry in context.device.entries() {
        for (key, value) in [(Key::LowLimit, &entry.low), (Key::HighLimit, &entry.high)] {
            super::outside_type(&RULE, context, entry, key, value.as_ref(), out);
        }
    }
}
