//! The default COB-ID of EMCY is 80h plus the node-ID.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::model::Value;
use crate::object::Key;

pub(crate) const RULE: Rule = Rule {
    code: "cia301::emcy-cob-id",
    severity: Severity::Note,
    holds: "The default COB-ID of EMCY is 80h plus the node-ID.",
    explain: "CiA 301 (7.5.2.17) fixes the default of 1014h; managers that do not read 1014h listen there.",
    help: "an overlay can correct it: `default = \"$NODEID+0x80\"` with a reason",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    let Some(entry) = context.device.entry(0x1014, 0) else { return };
    let good = match &entry.default {
        None => true,
        Some(Value::NodeIdPlus(id)) => id & 0x1FFF_FFFF == 0x80,
        // With a node-ID worked in, as editors do.
        Some(Value::Integer(id)) => (0x81..=0xFF).contains(&(id & 0x1FFF_FFFF)) || id & 0x8000_0000 != 0,
        Some(_) => true,
    };
    if !good {
        let finding = RULE.finding("the COB-ID of EMCY is not $NODEID+0x80 by default");
        out.push(finding.at(context.entry_span(entry, Key::DefaultValue), ""));
    }
}
