//! A COB-ID without bit 29 has 11 bits.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::model::Value;

pub(crate) const RULE: Rule = Rule {
    code: "pdo::cob-id-bits",
    severity: Severity::Warning,
    holds: "A COB-ID without bit 29 has 11 bits.",
    explain: "Bits 11 to 28 belong to identifiers of 29 bits, which bit 29 chooses (CiA 301, 7.5.2.35). A device \
              refuses the value or cuts it.",
    help: "an overlay can give another COB-ID: `[[pdo]]` with `cob_id = \"$NODEID+0x280\"`",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    for pdo in &context.device.pdos {
        let id = match pdo.cob_id.as_ref() {
            Some(Value::Integer(id)) => *id,
            Some(Value::NodeIdPlus(id)) => i128::from(*id),
            _ => continue,
        };
        if id & 0x2000_0000 == 0 && id & 0x1FFF_F800 != 0 {
            let finding = RULE.finding(format!("the COB-ID of {} has more than 11 bits", super::pdo_name(pdo)));
            out.push(finding.at(context.cob_id_span(pdo), "bit 29 is not set"));
        }
    }
}
