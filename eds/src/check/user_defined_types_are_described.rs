//! Data types that the device defines are described.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::object::Key;
use crate::types::DataType;

pub(crate) const RULE: Rule = Rule {
    code: "eds::undescribed-type",
    severity: Severity::Warning,
    holds: "Data types that the device defines are described.",
    explain: "From 0040h on data types are objects of the device itself (CiA 301, 7.4.1). Without their description \
              the size of a value is unknown.",
    help: "",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    for entry in context.device.entries() {
        if let DataType::Other(code @ 0x40..=0x25F) = entry.data_type
            && context.device.object(code).is_none()
        {
            let finding = RULE.finding(format!("the data type {code:04X}h is not described"));
            let finding = finding.at(context.entry_span(entry, Key::DataType), "");
            out.push(finding.help("an overlay can name a data type of CiA 301 of the same size"));
        }
    }
}
