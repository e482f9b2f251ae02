//! A PDO has a communication and a mapping parameter.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};

pub(crate) const RULE: Rule = Rule {
    code: "pdo::half-described",
    severity: Severity::Warning,
    holds: "A PDO has a communication and a mapping parameter.",
    explain: "1400h and 1600h belong together, and so do 1800h and 1A00h: one says when, the other what (CiA 301, \
              7.5.2.35).",
    help: "an overlay can describe the PDO: `[[pdo]]` with `direction`, `number` and `mapping`",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    for pdo in &context.device.pdos {
        let communication = crate::pdo::communication_parameter(pdo.direction, pdo.number);
        let mapping = crate::pdo::mapping_parameter(pdo.direction, pdo.number);
        let (there, missing) = match (context.device.object(communication), context.device.object(mapping)) {
            (Some(object), None) => (object, mapping),
            (None, Some(object)) => (object, communication),
            _ => continue,
        };
        let finding = RULE.finding(format!("{} has no {missing:04X}", super::pdo_name(pdo)));
        out.push(finding.at(there.span, "belongs to it"));
    }
}
