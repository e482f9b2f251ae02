//! PDO parameters are written out.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::section::SectionKind;

pub(crate) const RULE: Rule = Rule {
    code: "eds::compact-pdo",
    severity: Severity::Note,
    holds: "PDO parameters are written out.",
    explain: "`CompactPDO` (CiA 306-1, 6.4) lets a data sheet leave out PDO parameters that follow from their number. \
              Only what is written out is read; an overlay can describe the other PDOs.",
    help: "",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    if context.device.info.compact_pdo == 0 {
        return;
    }
    let section = context.facts.section(SectionKind::DeviceInfo);
    let Some(pair) = section.and_then(|section| section.get("CompactPDO")) else { return };
    let span = context.facts.syntax.value_span(pair);
    out.push(
        RULE.finding("PDO parameters may be left out of this data sheet").at(span, "only those written out are read"),
    );
}
