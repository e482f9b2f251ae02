//! Transmission types are those of CiA 301.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::model::Direction;

pub(crate) const RULE: Rule = Rule {
    code: "pdo::transmission-type",
    severity: Severity::Warning,
    holds: "Transmission types are those of CiA 301.",
    explain: "0 to 240 are synchronous, 252 and 253 answer remote requests (transmit PDOs only), 254 and 255 are \
              event-driven (CiA 301, 7.5.2.35); the others are reserved.",
    help: "an overlay can give another one: `[[pdo]]` with `transmission_type = 255`",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    for pdo in &context.device.pdos {
        let Some(transmission_type) = pdo.transmission_type else { continue };
        let reserved = match pdo.direction {
            Direction::Receive => matches!(transmission_type, 241..=253),
            Direction::Transmit => matches!(transmission_type, 241..=251),
        };
        if reserved {
            let finding =
                RULE.finding(format!("{} has the transmission type {transmission_type}", super::pdo_name(pdo)));
            out.push(finding.at(context.pdo_span(pdo, 2), "reserved"));
        }
    }
}
