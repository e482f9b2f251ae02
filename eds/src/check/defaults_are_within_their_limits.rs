//! Defaults lie between the limits.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::object::Key;

pub(crate) const RULE: Rule = Rule {
    code: "eds::default-outside-limits",
    severity: Severity::Warning,
    holds: "Defaults lie between the limits.",
    explain: "A default outside its own limits could not be written back. One of the three numbers is wrong.",
    help: "",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    for entry in context.device.entries() {
        super::outside_limits(&RULE, context, entry, Key::DefaultValue, entry.default.as_ref(), out);
    }
}
