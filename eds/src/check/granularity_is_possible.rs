//! The granularity is at most 64 bits.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};

pub(crate) const RULE: Rule = Rule {
    code: "eds::bad-granularity",
    severity: Severity::Warning,
    holds: "The granularity is at most 64 bits.",
    explain: "Granularity (CiA 306-1, 6.4) is the smallest piece in bits that a PDO can map, from 1 to 64; 0 means \
              that mappings cannot be changed.",
    help: "",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    let Some(granularity) = context.device.info.granularity.filter(|&granularity| granularity > 64) else { return };
    let Some(span) = context.device_info("Granularity") else { return };
    out.push(RULE.finding(format!("a granularity of {granularity} bits is longer than a PDO")).at(span, ""));
}
