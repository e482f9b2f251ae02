//! Sub-index 0 of a mapping is the number of objects that are mapped.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::model::Value;

pub(crate) const RULE: Rule = Rule {
    code: "pdo::mapping-count",
    severity: Severity::Warning,
    holds: "Sub-index 0 of a mapping is the number of objects that are mapped.",
    explain: "The default of sub-index 0 says how many of the words after it count (CiA 301, 7.5.2.36): at most 64, \
              and each must be there.",
    help: "an overlay can describe the PDO: `[[pdo]]` with `direction`, `number` and `mapping`",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    for pdo in &context.device.pdos {
        let Some(object) = context.device.object(crate::pdo::mapping_parameter(pdo.direction, pdo.number)) else {
            continue;
        };
        let count = object.entry(0).and_then(|entry| crate::pdo::held(entry));
        let Some(Value::Integer(count)) = count else { continue };
        // 254 and 255 mark multiplexed PDOs.
        if matches!(count, 254 | 255) || *count == pdo.mapping.len() as i128 {
            continue;
        }
        if context
            .changes
            .pdos
            .iter()
            .any(|extra| (extra.pdo.direction, extra.pdo.number) == (pdo.direction, pdo.number))
        {
            continue;
        }
        let found = super::plural(pdo.mapping.len(), "object");
        let finding = RULE.finding(format!("{} maps {found}, not {count}", super::pdo_name(pdo)));
        out.push(finding.at(context.mapping_span(pdo, 0), "says otherwise"));
    }
}
