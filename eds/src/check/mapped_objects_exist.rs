//! What a PDO maps is in the data sheet.

use std::collections::BTreeMap;

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::model::Pdo;

pub(crate) const RULE: Rule = Rule {
    code: "pdo::missing-object",
    severity: Severity::Warning,
    holds: "What a PDO maps is in the data sheet.",
    explain: "A mapping names entries by index, sub-index and length. What is not there cannot be decoded.",
    help: "an overlay can describe the PDO: `[[pdo]]` with `direction`, `number` and `mapping`",
    check: Some(check),
};

/// So many places of one object are shown.
const MAX_PLACES: usize = 4;

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    let mut missing: BTreeMap<(u16, u8), Vec<(&Pdo, u8)>> = BTreeMap::new();
    for (pdo, number, mapped) in context.mapped() {
        let there = context.device.entry(mapped.index, mapped.sub).is_some();
        if !there && !super::is_dummy(mapped) {
            missing.entry((mapped.index, mapped.sub)).or_default().push((pdo, number));
        }
    }
    for ((index, sub), places) in missing {
        let names: Vec<String> = places.iter().map(|(pdo, _)| super::pdo_name(pdo)).collect();
        let names = super::listed(&names, String::clone);
        let mut finding = RULE.finding(format!("there is no {index:04X}:{sub:02X} for {names} to map"));
        for (at, &(pdo, number)) in places.iter().take(MAX_PLACES).enumerate() {
            let span = context.mapping_span(pdo, number);
            finding = if at == 0 { finding.at(span, "mapped here") } else { finding.and(span, "and here") };
        }
        out.push(finding);
    }
}
