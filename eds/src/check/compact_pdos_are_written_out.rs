//! PDO parameters are written out.

use super::{Context, Rule, plural};
use crate::diagnostics::{Diagnostics, Severity};

pub(crate) const RULE: Rule = Rule {
    code: "eds::compact-pdo",
    severity: Severity::Note,
    holds: "PDO parameters are written out.",
    explain: "`CompactPDO` (CiA 306-1, 6.4) lets a data sheet leave out PDO parameters: they have the sub-indices that \
              its bits name, the COB-IDs of the predefined connection set, and empty mappings. They are added here; \
              many readers do not see them.",
    help: "",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    let Some(span) = context.device_info("CompactPDO") else { return };
    let implied = context.objects().filter(|(_, facts)| facts.implied).count();
    if implied > 0 {
        let finding = RULE.finding(format!("`CompactPDO` stands for {}", plural(implied, "PDO parameter")));
        out.push(finding.at(span, "they are added"));
    }
}
