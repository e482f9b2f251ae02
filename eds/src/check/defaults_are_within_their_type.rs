//! Defaults are numbers of the data type.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::object::Key;

pub(crate) const RULE: Rule = Rule {
    code: "eds::default-outside-type",
    severity: Severity::Warning,
    holds: "Defaults are numbers of the data type.",
    explain: "A device cannot hold a default that its data type cannot have. Either the default or the data type is \
              wrong.",
    help: "an overlay can correct it: `default`, `low`, `high` or `data_type` with a reason",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    for entry in context.device.entries() {
        super::outside_type(&RULE, context, entry, Key::DefaultValue, entry.default.as_ref(), out);
        super::outside_type(&RULE, context, entry, Key::ParameterValue, entry.configured.as_ref(), out);
    }
}
