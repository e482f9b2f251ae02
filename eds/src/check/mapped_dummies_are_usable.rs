//! Dummies that a PDO maps are in DummyUsage.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::types::DataType;

pub(crate) const RULE: Rule = Rule {
    code: "pdo::unusable-dummy",
    severity: Severity::Warning,
    holds: "Dummies that a PDO maps are in DummyUsage.",
    explain: "A data type can be mapped to leave a gap when `[DummyUsage]` says so (CiA 306-1), and only into receive \
              PDOs.",
    help: "an overlay can describe the PDO: `[[pdo]]` with `direction`, `number` and `mapping`",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    for (pdo, number, mapped) in context.mapped().filter(|(_, _, mapped)| super::is_dummy(*mapped)) {
        let data_type = DataType::from_code(mapped.index);
        if !context.device.dummies.contains(&data_type) {
            let finding = RULE.finding(format!("{data_type} is mapped as a dummy, but `[DummyUsage]` forbids it"));
            out.push(finding.at(context.mapping_span(pdo, number), ""));
        }
    }
}
