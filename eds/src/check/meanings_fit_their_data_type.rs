//! The values, bits and ranges that an overlay names fit the data type.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::model::{Bits, Meaning, Named};
use crate::types::DataType;

pub(crate) const RULE: Rule = Rule {
    code: "overlay::meaning-outside-type",
    severity: Severity::Error,
    holds: "The values, bits and ranges that an overlay names fit the data type.",
    explain: "A value that the data type cannot have, or a bit beyond its last, is a slip in the overlay or a wrong \
              data type in the data sheet.",
    help: "",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    for used in &context.changes.uses {
        let Some(entry) = context.device.entry(used.index, used.sub) else { continue };
        let Some((low, high)) = entry.data_type.range() else {
            if !matches!(entry.data_type, DataType::Real32 | DataType::Real64) {
                out.push(RULE.finding(format!("{} is no number", entry.data_type)).at(used.span, ""));
            }
            continue;
        };
        let what = match &used.meaning {
            Meaning::Enumeration(name) => context.device.enumerations.get(name).and_then(|enumeration| {
                let outside = |value: &&Named<i128>| !(low..=high).contains(&value.value);
                enumeration
                    .values
                    .iter()
                    .find(outside)
                    .map(|value| (format!("the value {}", value.value), enumeration.span))
            }),
            Meaning::BitField(name) => context.device.bit_fields.get(name).and_then(|bit_field| {
                let bits = entry.data_type.bits()?;
                let outside = |field: &&Named<Bits>| field.value.high >= bits;
                bit_field.fields.iter().find(outside).map(|field| (format!("bit {}", field.value.high), bit_field.span))
            }),
            _ => None,
        };
        if let Some((what, span)) = what {
            let finding = RULE.finding(format!("{} has no room for {what}", entry.data_type));
            out.push(finding.at(used.span, "used here").and(span, "defined here"));
        }
    }
}
