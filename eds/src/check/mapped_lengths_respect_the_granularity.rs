//! Mapped lengths are multiples of the granularity.

use super::{Context, Rule, plural};
use crate::diagnostics::{Diagnostics, Severity};

pub(crate) const RULE: Rule = Rule {
    code: "pdo::granularity",
    severity: Severity::Note,
    holds: "Mapped lengths are multiples of the granularity.",
    explain: "`Granularity` in `[DeviceInfo]` is the smallest piece in bits that a PDO of this device maps. Tools that \
              trust it refuse what is smaller.",
    help: "`Granularity` is the largest number of bits that all mapped lengths are multiples of",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    let Some(granularity) = context.device.info.granularity.filter(|&granularity| granularity > 1) else { return };
    let Some(span) = context.device_info("Granularity") else { return };
    let odd: Vec<_> = context.mapped().filter(|(_, _, mapped)| mapped.bits % granularity != 0).collect();
    let Some(&(pdo, number, first)) = odd.first() else { return };
    let (are, first_of_them) = if odd.len() == 1 { ("is", "") } else { ("are", ", the first of them") };
    let what = plural(odd.len(), "mapped length");
    let finding = RULE.finding(format!("{what} {are} no multiple of the granularity of {granularity} bits"));
    let common = context.mapped().fold(0, |common, (_, _, mapped)| greatest_common_divisor(common, mapped.bits));
    let finding = finding.at(span, format!("{common} would agree with all mapped lengths"));
    let bits = plural(first.bits.into(), "bit");
    out.push(finding.and(context.mapping_span(pdo, number), format!("{bits}{first_of_them}")));
}

fn greatest_common_divisor(a: u8, b: u8) -> u8 {
    if b == 0 { a } else { greatest_common_divisor(b, a % b) }
}
