//! Names differ when blanks and signs are left out.

use std::collections::BTreeMap;

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::model::ObjectKind;
use crate::object::Key;
use crate::source::Span;

pub(crate) const RULE: Rule = Rule {
    code: "eds::same-name",
    severity: Severity::Note,
    holds: "Names differ when blanks and signs are left out.",
    explain: "Generated code turns names into identifiers, and `Speed (max)` and `Speed max` become the same. Such \
              names get their address added; an overlay gives better ones.",
    help: "",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    let mut objects = BTreeMap::new();
    for (object, _) in context.objects() {
        if let Some(first) = objects.insert(identifier(&object.name), object).filter(|_| !object.name.is_empty()) {
            let message = format!("the objects {:04X} and {:04X} have the same name", first.index, object.index);
            report(out, message, context.value_span(object.span, Key::ParameterName), first.span);
        }
        // The entries of an array are numbered; only those of a record go by their names.
        if object.kind != ObjectKind::Record {
            continue;
        }
        let mut entries = BTreeMap::new();
        for entry in object.entries.iter().filter(|entry| !entry.name.is_empty()) {
            if let Some(first) = entries.insert(identifier(&entry.name), entry) {
                let (index, a, b) = (entry.index, first.sub, entry.sub);
                let message = format!("the entries {index:04X}:{a:02X} and {index:04X}:{b:02X} have the same name");
                report(out, message, context.entry_span(entry, Key::ParameterName), first.span);
            }
        }
    }
}

fn report(out: &mut Diagnostics, message: String, span: Span, first: Span) {
    let finding = RULE.finding(message).at(span, "").and(first, "the other one");
    out.push(finding.help("an overlay can give another name: `name = \"…\"`"));
}

/// Letters and digits in lower case.
fn identifier(name: &str) -> String {
    name.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect()
}
