//! The default SDO has the COB-IDs 600h and 580h plus the node-ID.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::model::Value;
use crate::object::Key;

pub(crate) const RULE: Rule = Rule {
    code: "cia301::sdo-cob-id",
    severity: Severity::Warning,
    holds: "The default SDO has the COB-IDs 600h and 580h plus the node-ID.",
    explain: "They are fixed (CiA 301, 7.5.2.33): a manager must reach every device before it knows anything of it.",
    help: "an overlay can correct it: `default = \"$NODEID+0x600\"` with a reason",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    for (sub, base) in [(1, 0x600), (2, 0x580)] {
        let Some(entry) = context.device.entry(0x1200, sub) else { continue };
        let good = match &entry.default {
            Some(Value::NodeIdPlus(id)) => *id == base,
            Some(Value::Integer(id)) => (0..=127).contains(&(id - i128::from(base))),
            _ => true,
        };
        if !good {
            let finding = RULE.finding(format!("the COB-ID of the default SDO is not $NODEID+{base:#X}"));
            out.push(finding.at(context.entry_span(entry, Key::DefaultValue), ""));
        }
    }
}
