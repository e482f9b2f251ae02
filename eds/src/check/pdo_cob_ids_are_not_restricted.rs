//! No PDO has a COB-ID that CiA 301 keeps for something else.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::model::Value;

pub(crate) const RULE: Rule = Rule {
    code: "pdo::restricted-cob-id",
    severity: Severity::Warning,
    holds: "No PDO has a COB-ID that CiA 301 keeps for something else.",
    explain: "NMT, SDO, error control and LSS have fixed identifiers (CiA 301, 7.3.5) that no PDO may use: 000h to \
              07Fh, 101h to 180h, 581h to 5FFh, 601h to 67Fh, 6E0h to 6FFh and 701h to 7FFh.",
    help: "an overlay can give another COB-ID: `[[pdo]]` with `cob_id = \"$NODEID+0x280\"`",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    for pdo in &context.device.pdos {
        let (id, node_ids) = match pdo.cob_id.as_ref() {
            Some(Value::Integer(id)) => (*id, 0..=0),
            Some(Value::NodeIdPlus(id)) => (i128::from(*id), 1..=127),
            _ => continue,
        };
        // Bit 31 switches the PDO off, bit 29 chooses identifiers of 29 bits.
        if id & 0xA000_0000 != 0 || (id & 0x7FF == 0 && node_ids == (0..=0)) {
            continue;
        }
        if node_ids.clone().all(|node_id| super::is_restricted((id & 0x7FF) + node_id)) {
            let finding = RULE.finding(format!("the COB-ID of {} is restricted", super::pdo_name(pdo)));
            let finding = finding.at(context.cob_id_span(pdo), "");
            // The identifiers of the predefined connection set are those of node-ID 0 in it (CiA 301, 7.3.3).
            let predefined = matches!(id & 0x7FF, 0x180 | 0x200 | 0x280 | 0x300 | 0x380 | 0x400 | 0x480 | 0x500);
            out.push(match predefined && node_ids == (0..=0) {
                true => finding.help(format!("the node-ID may be missing: `$NODEID+{id:#X}`")),
                false => finding,
            });
        }
    }
}
