//! The COB-ID of SYNC is not one that CiA 301 keeps for something else.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::model::Value;
use crate::object::Key;

pub(crate) const RULE: Rule = Rule {
    code: "cia301::sync-cob-id",
    severity: Severity::Warning,
    holds: "The COB-ID of SYNC is not one that CiA 301 keeps for something else.",
    explain: "The default of 1005h is 80h (CiA 301, 7.5.2.5). Another one must not be among those that are restricted.",
    help: "an overlay can correct it: `default = 0x80` with a reason",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    let Some(entry) = context.device.entry(0x1005, 0) else { return };
    let Some(id) = entry.default.as_ref().and_then(Value::as_integer) else { return };
    if id & 0x2000_0000 == 0 && id & 0x7FF != 0 && super::is_restricted(id & 0x7FF) {
        let finding = RULE.finding(format!("the COB-ID {:03X}h of SYNC is restricted", id & 0x7FF));
        out.push(finding.at(context.entry_span(entry, Key::DefaultValue), ""));
    }
}
