//! CompactPDO says all that is needed of the PDOs that are left out.

use super::{Context, Rule};
use crate::compact_pdo::DEFINED_BITS;
use crate::diagnostics::{Diagnostic, Diagnostics, Severity};
use crate::source::Span;

pub(crate) const RULE: Rule = Rule {
    code: "eds::bad-compact-pdo",
    severity: Severity::Warning,
    holds: "CompactPDO says all that is needed of the PDOs that are left out.",
    explain: "Bits 0 to 5 of `CompactPDO` (CiA 306-1, 6.4) are sub-indices 1 to 6 of the communication parameters that \
              are left out; without the first two a PDO has no COB-ID or no transmission type (CiA 301, 7.5.2.35). \
              `NrOfRXPDO` and `NrOfTXPDO` say how many PDOs there are, and with a `Granularity` of 0 their mappings \
              could not be written, so that they had to be in the file.",
    help: "set bits 0 and 1, and say in `NrOfRXPDO` and `NrOfTXPDO` how many PDOs there are",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    let bits = context.device.info.compact_pdo;
    let Some(span) = context.device_info("CompactPDO").filter(|_| bits != 0) else { return };
    if bits & !DEFINED_BITS != 0 {
        let message = "`CompactPDO` has bits beyond the six of a communication parameter";
        out.push(RULE.finding(message).at(span, format!("0x{:X} is ignored", bits & !DEFINED_BITS)));
    }
    if context.device.pdos.is_empty() {
        out.push(no_pdos(context, span));
    }
    if !context.objects().any(|(_, facts)| facts.implied) {
        return;
    }
    for (bit, what) in [(0, "COB-ID"), (1, "transmission type")] {
        if bits & 1 << bit == 0 {
            let message = format!("PDOs that are left out have no {what}");
            out.push(RULE.finding(message).at(span, format!("bit {bit} is 0")));
        }
    }
    if let (Some(0), Some(granularity)) = (context.device.info.granularity, context.device_info("Granularity")) {
        let finding = RULE.finding("the mappings of the PDOs that are left out are not known").at(span, "");
        out.push(finding.and(granularity, "they cannot be written"));
    }
}

fn no_pdos(context: &Context<'_>, span: Span) -> Diagnostic {
    let mut finding = RULE.finding("`CompactPDO` describes PDOs, but there are none").at(span, "");
    for key in ["NrOfRXPDO", "NrOfTXPDO"] {
        if let Some(span) = context.device_info(key) {
            finding = finding.and(span, "");
        }
    }
    finding
}
