//! The SDO client parameters name a server.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};

pub(crate) const RULE: Rule = Rule {
    code: "cia301::sdo-client",
    severity: Severity::Note,
    holds: "The SDO client parameters name a server.",
    explain: "1280h to 12FFh without sub-index 3 leave open which device the client talks to (CiA 301, 7.5.2.34).",
    help: "",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    let clients = context.objects().filter(|(object, _)| matches!(object.index, 0x1280..=0x12FF));
    for (object, _) in clients {
        if object.kind.has_subs() && object.entry(3).is_none() {
            out.push(
                RULE.finding(format!("{:04X} has no node-ID of the server (03)", object.index)).at(object.span, ""),
            );
        }
    }
}
