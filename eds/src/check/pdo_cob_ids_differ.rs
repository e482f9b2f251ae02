//! No two PDOs have the same COB-ID.

use std::collections::BTreeMap;

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::model::{Pdo, Value};

pub(crate) const RULE: Rule = Rule {
    code: "pdo::cob-id-collision",
    severity: Severity::Warning,
    holds: "No two PDOs have the same COB-ID.",
    explain: "Two devices, or two PDOs of one, that send with the same identifier disturb each other; two receive PDOs \
              with one COB-ID both take the frame.",
    help: "an overlay can give another COB-ID: `[[pdo]]` with `cob_id = \"$NODEID+0x280\"`",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    let mut seen: BTreeMap<(bool, i128), &Pdo> = BTreeMap::new();
    for pdo in &context.device.pdos {
        let (node, id) = match pdo.cob_id.as_ref() {
            Some(Value::Integer(id)) => (false, *id),
            Some(Value::NodeIdPlus(id)) => (true, i128::from(*id)),
            _ => continue,
        };
        let (valid, id) = (id & 0x8000_0000 == 0, id & 0x1FFF_FFFF);
        if !valid || (id == 0 && !node) {
            continue;
        }
        match seen.get(&(node, id)) {
            Some(first) => {
                let names = [super::pdo_name(first), super::pdo_name(pdo)];
                let finding = RULE.finding(format!("{} and {} have the same COB-ID", names[0], names[1]));
                let finding = finding.at(context.cob_id_span(pdo), "");
                out.push(finding.and(context.cob_id_span(first), "the same"));
            }
            None => {
                seen.insert((node, id), pdo);
            }
        }
    }
}
