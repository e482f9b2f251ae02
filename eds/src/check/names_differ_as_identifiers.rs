//! Names differ when blanks and signs are left out.

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

/// So many places of one name are shown.
const MAX_PLACES: usize = 4;

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    let objects = context.device.objects.iter().map(|object| (object.name.as_str(), (object.index, None)));
    report("objects", objects, context, out);
    // The entries of an array are numbered; only those of a record go by their names.
    for record in context.device.objects.iter().filter(|object| object.kind == ObjectKind::Record) {
        let entries = record.entries.iter().map(|entry| (entry.name.as_str(), (entry.index, Some(entry.sub))));
        report("entries", entries, context, out);
    }
}

/// An object, or the entry of one.
type Address = (u16, Option<u8>);

/// One finding for each name that several have.
fn report<'a>(
    what: &str,
    names: impl Iterator<Item = (&'a str, Address)>,
    context: &Context<'_>,
    out: &mut Diagnostics,
) {
    let names = names.map(|(name, address)| (identifier(name), address));
    // Without a letter a name becomes no identifier; the address is the name then.
    let mut names: Vec<(String, Address)> = names.filter(|(name, _)| !name.is_empty()).collect();
    names.sort();
    for namesakes in names.chunk_by(|a, b| a.0 == b.0).filter(|namesakes| namesakes.len() > 1) {
        let listed = super::listed(namesakes, |(_, address)| shown(*address));
        let mut finding = RULE.finding(format!("the {what} {listed} have the same name"));
        for (at, (_, address)) in namesakes.iter().take(MAX_PLACES).enumerate() {
            let span = name_span(context, *address);
            finding = if at == 0 { finding.at(span, "") } else { finding.and(span, "") };
        }
        out.push(finding.help("an overlay can give other names: `name = \"…\"`"));
    }
}

fn shown((index, sub): Address) -> String {
    match sub {
        Some(sub) => format!("{index:04X}:{sub:02X}"),
        None => format!("{index:04X}"),
    }
}

fn name_span(context: &Context<'_>, (index, sub): Address) -> Span {
    let Some(object) = context.device.object(index) else { return Span::default() };
    match sub.and_then(|sub| object.entry(sub)) {
        Some(entry) => context.entry_span(entry, Key::ParameterName),
        None => context.value_span(object.span, Key::ParameterName),
    }
}

/// Letters and digits in lower case.
fn identifier(name: &str) -> String {
    name.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect()
}
