//! SubNumber is the number of sub-indices.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::object::Key;

pub(crate) const RULE: Rule = Rule {
    code: "eds::sub-count",
    severity: Severity::Warning,
    holds: "SubNumber is the number of sub-indices.",
    explain: "SubNumber (CiA 306-1, 6.5.2) counts the sections of the sub-indices, 0 included. Readers that trust it \
              lose those beyond it.",
    help: "",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    for (object, facts) in context.objects() {
        let found = super::are(facts.subs.into(), "sub-index");
        match facts.sub_number {
            Some(said) if said != facts.subs && facts.compact == 0 && object.kind.has_subs() => {
                let span = context.value_span(object.span, Key::SubNumber);
                let finding = RULE.finding(format!("there {found}, not {said}")).at(span, "says otherwise");
                let last = object.entries.last().filter(|entry| entry.span != object.span);
                out.push(match last {
                    Some(last) => finding.and(last.span, "the last one"),
                    None => finding,
                });
            }
            None if facts.subs > 0 && facts.header => {
                let finding = RULE.finding(format!("there {found}, but no `SubNumber`"));
                out.push(finding.at(object.span, ""));
            }
            _ => {}
        }
    }
}
