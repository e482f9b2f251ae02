//! Every object that is described is in a list.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};

pub(crate) const RULE: Rule = Rule {
    code: "eds::object-not-listed",
    severity: Severity::Warning,
    holds: "Every object that is described is in a list.",
    explain: "CiA 306-1 lets a reader ignore objects that no list names, and several do. They are read here.",
    help: "name it in `[OptionalObjects]`, or from 2000h to 5FFFh in `[ManufacturerObjects]`",
    check: Some(check),
};

/// So many places are shown.
const MAX_PLACES: usize = 4;

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    let unlisted = context.objects().filter(|(_, facts)| facts.listed.is_none() && !facts.implied);
    let unlisted: Vec<_> = unlisted.map(|(object, _)| object).collect();
    let indices = super::listed(&unlisted, |object| format!("{:04X}", object.index));
    let message = match unlisted.len() {
        0 => return,
        1 => format!("the object {indices} is in none of the lists"),
        number => format!("{number} objects are in none of the lists: {indices}"),
    };
    let mut finding = RULE.finding(message);
    for (at, object) in unlisted.iter().take(MAX_PLACES).enumerate() {
        let place = object.span;
        finding = if at == 0 { finding.at(place, "other readers do not see it") } else { finding.and(place, "nor it") };
    }
    out.push(finding);
}
