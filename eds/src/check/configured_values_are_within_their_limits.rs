//! The values of a DCF lie between the limits.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::object::Key;

pub(crate) const RULE: Rule = Rule {
    code: "eds::value-outside-limits",
    severity: Severity::Warning,
    holds: "The values of a DCF lie between the limits.",
    explain: "A device refuses a value outside its limits, and the download of the configuration fails with it.",
    help: "",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    for entry in context.device.entries() {
        super::outside_limits(&RULE, context, entry, Key::ParameterValue, entry.configured.as_ref(), out);
    }
}
