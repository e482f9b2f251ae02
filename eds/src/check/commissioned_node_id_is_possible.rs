//! The node-ID of a DCF is 1 to 127.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::section::SectionKind;

pub(crate) const RULE: Rule = Rule {
    code: "eds::bad-node-id",
    severity: Severity::Warning,
    holds: "The node-ID of a DCF is 1 to 127.",
    explain: "CiA 301 has node-IDs from 1 to 127; 255 marks a device that waits for LSS.",
    help: "",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    let node_id = context.device.commissioning.as_ref().and_then(|commissioning| commissioning.node_id);
    let Some(node_id) = node_id.filter(|id| !matches!(id, 1..=127 | 255)) else { return };
    let section = context.facts.section(SectionKind::Commissioning);
    let Some(pair) = section.and_then(|section| section.get("NodeID")) else { return };
    out.push(RULE.finding(format!("{node_id} is no node-ID")).at(context.facts.syntax.value_span(pair), ""));
}
