//! Mapped lengths are multiples of the granularity.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};

pub(crate) const RULE: Rule = Rule {
    code: "pdo::granularity",
    severity: Severity::Note,
    holds: "Mapped lengths are multiples of the granularity.",
    explain: "`Granularity` in `[DeviceInfo]` is the smallest piece in bits that a PDO of this device maps.",
    help: "an overlay can describe the PDO: `[[pdo]]` with `direction`, `number` and `mapping`",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    let Some(granularity) = context.device.info.granularity.filter(|&granularity| granularity > 1) else { return };
    for (pdo, number, mapped) in context.mapped() {
        if mapped.bits % granularity != 0 {
            let finding =
                RULE.finding(format!("{} bits are no multiple of the granularity of {granularity}", mapped.bits));
            out.push(finding.at(context.mapping_span(pdo, number), ""));
        }
    }
}
