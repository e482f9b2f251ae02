//! Rules about overlays.

use super::context::Context;
use super::rule::{Out, note};
use crate::diagnostic::Diagnostic;
use crate::finding::{Finding, Kind};
use crate::model::types::DataType;
use crate::model::{Bits, Entry, Enumeration, Meaning, Named, Value};
use crate::overlay::{Accepted, Use};
use crate::text::Span;

pub(super) fn syntax(_: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let Kind::OverlaySyntax(message) = &finding.kind else { return None };
    Some(note(format!("the overlay is not TOML: {message}")).at(finding.span, ""))
}

pub(super) fn format(_: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    match finding.kind {
        Kind::OverlayWithoutFormat => {
            let note = note("the overlay does not name its format").at(finding.span, "");
            Some(note.help("begin with `[overlay]` and `format = 1`"))
        }
        Kind::OverlayFormat(format) => {
            let message = format!("the overlay has format {format}; this version knows format 1");
            Some(note(message).at(finding.span, ""))
        }
        _ => None,
    }
}

pub(super) fn unknown_key(_: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    match &finding.kind {
        Kind::OverlayKey { key, known } => {
            let note = note(format!("the key `{key}` is unknown here")).at(finding.span, "");
            Some(note.help(format!("the keys here are {known}")))
        }
        Kind::OverlayKeyOfRecord(key) => {
            let note = note(format!("`{key}` belongs to an entry of the record")).at(finding.span, "");
            Some(note.help("name the entry: `[object.\"2410:05\"]`"))
        }
        _ => None,
    }
}

pub(super) fn bad_value(_: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let Kind::OverlayValue { expected } = &finding.kind else { return None };
    Some(note(format!("expected {expected}")).at(finding.span, ""))
}

pub(super) fn unknown_object(_: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let Kind::OverlayObject(address) = &finding.kind else { return None };
    Some(note(format!("the data sheet has no `{address}`")).at(finding.span, ""))
}

pub(super) fn missing_reason(_: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let Kind::OverlayReason(address) = &finding.kind else { return None };
    let note = note(format!("the correction of `{address}` has no reason")).at(finding.span, "");
    Some(note.help("add `reason = \"…\"`"))
}

pub(super) fn no_effect(cx: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let Kind::OverlayNoEffect { index, sub, key } = finding.kind else { return None };
    let is_list = cx.device.object(index).is_some_and(|object| object.kind.has_subs());
    let place = if is_list { format!(" for {index:04X}:{sub:02X}") } else { String::new() };
    let note = note(format!("the data sheet has the same `{}`{place}", key.name()));
    Some(note.at(finding.span, "this changes nothing"))
}

pub(super) fn two_meanings(_: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let Kind::OverlayMeanings { first } = finding.kind else { return None };
    Some(note("the entry has two meanings").at(finding.span, "second").and(first, "first"))
}

pub(super) fn range_reversed(_: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let Kind::OverlayRange = finding.kind else { return None };
    Some(note("`low` is above `high`").at(finding.span, ""))
}

pub(super) fn duplicate_value(_: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let Kind::OverlayDuplicateValue { values: [(a, b), (c, d)] } = &finding.kind else { return None };
    Some(note(format!("two values are the same: {a} `{b}` and {c} `{d}`")).at(finding.span, "ignored"))
}

pub(super) fn overlapping_bits(_: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let Kind::OverlayBits { names: [a, b] } = &finding.kind else { return None };
    Some(note(format!("two fields overlap: `{a}` and `{b}`")).at(finding.span, "ignored"))
}

pub(super) fn units(_: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let Kind::OverlayUnits { units } = finding.kind else { return None };
    let message = if units == 0 { "the quantity has no unit" } else { "a unit among several has no condition" };
    Some(note(message).at(finding.span, "").help("`when = \"2412:00 == 0\"` says when a unit applies"))
}

pub(super) fn duplicate_parameter(_: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let Kind::OverlayDuplicateParameter { number, first } = &finding.kind else { return None };
    let note =
        note(format!("two parameters have the number {number}")).at(finding.span, "ignored").and(*first, "first");
    Some(note.help("give it its own number, or say of both when they apply: `when = \"6060:00 == 1\"`"))
}

/// Reports an accepted finding that does not occur or whose rule does not exist; returns the code of the rule as well.
pub(super) fn accepted_in_vain(accepted: &Accepted, is_rule: bool) -> (&'static str, Diagnostic) {
    let Accepted { code, span, .. } = accepted;
    if is_rule {
        return ("overlay::accepted-in-vain", note(format!("there is no finding of {code} to accept")).at(*span, ""));
    }
    let expected = "expected the code of a rule, such as \"cia301::data-type\"";
    ("overlay::bad-value", note(expected).at(*span, ""))
}

pub(super) fn undefined_name(cx: &Context<'_>, out: &mut Out<'_>) {
    for used in &cx.changes.uses {
        let (kind, name, defined) = match &used.meaning {
            Meaning::Plain => continue,
            Meaning::Quantity(name) => ("quantity", name, cx.device.quantities.contains_key(name)),
            Meaning::Enumeration(name) => ("enumeration", name, cx.device.enumerations.contains_key(name)),
            Meaning::BitField(name) => ("bit_field", name, cx.device.bit_fields.contains_key(name)),
        };
        if !defined {
            let note = note(format!("there is no {} `{name}`", kind.replace('_', " "))).at(used.span, "");
            out.push(note.help(format!("add `[{kind}.{name}]` to the overlay")));
        }
    }
    for parameter in cx.device.parameters() {
        let named = enumeration_of(cx, &parameter.entry).map_or(&[][..], |enumeration| &enumeration.values);
        let unknown = |value: &&Named<i128>| named.iter().all(|known| known.name != value.name);
        if let Some(value) = parameter.values.iter().find(unknown) {
            let message = format!("`{}` is no value of what parameter {} equals", value.name, parameter.number);
            let names: Vec<String> = named.iter().map(|known| format!("`{}`", known.name)).collect();
            let help = match names.as_slice() {
                [] => "only values of an enumeration have other numbers: give the object one".to_owned(),
                names => format!("its values are {}", names.join(", ")),
            };
            out.push(note(message).at(parameter.span, "").help(help));
        }
    }
}

fn enumeration_of<'a>(cx: &Context<'a>, entry: &Entry) -> Option<&'a Enumeration> {
    let Meaning::Enumeration(name) = &entry.meaning else { return None };
    cx.device.enumerations.get(name)
}

/// The entry that uses a meaning: an entry of the data sheet, or a parameter without object.
fn user<'a>(cx: &Context<'a>, used: &Use) -> Option<&'a Entry> {
    let is_here = |entry: &&Entry| (entry.index, entry.sub) == (used.index, used.sub);
    let of_parameters = || cx.device.parameters().map(|parameter| &parameter.entry).find(is_here);
    cx.device.entry(used.index, used.sub).or_else(of_parameters)
}

pub(super) fn parameter_outside_type(cx: &Context<'_>, out: &mut Out<'_>) {
    for parameter in cx.device.parameters() {
        let (entry, carried) = (&parameter.entry, parameter.data_type);
        let whole = entry.data_type.range();
        let Some(((lowest, highest), of_object)) = carried.range().zip(whole) else {
            let unfit = if whole.is_none() { entry.data_type } else { carried };
            let note = note(format!("parameter {} is no integer: {unfit}", parameter.number)).at(parameter.span, "");
            out.push(note.help("leave it out: other interfaces carry integers only"));
            continue;
        };
        let limit = |limit: &Option<Value>, otherwise| limit.as_ref().and_then(Value::as_integer).unwrap_or(otherwise);
        let ends = [limit(&entry.low, of_object.0), limit(&entry.high, of_object.1)];
        // Numbers of the parameter replace those of the object.
        let own = parameter.values.iter().map(|value| value.value);
        let mut numbers = own.chain(ends.into_iter().filter(|_| parameter.values.is_empty()));
        if let Some(number) = numbers.find(|number| !(lowest..=highest).contains(number)) {
            let message = format!("{carried} has no room for the number {number} of parameter {}", parameter.number);
            out.push(note(message).at(parameter.span, "").help("give it a wider `data_type`, or a smaller range"));
        }
    }
}

pub(super) fn parameter_range(cx: &Context<'_>, out: &mut Out<'_>) {
    for parameter in cx.device.parameters() {
        let Some(object) = cx.device.entry(parameter.entry.index, parameter.entry.sub) else { continue };
        let outside = |here: &Option<Value>, there: &Option<Value>, is_beyond: fn(i128, i128) -> bool| {
            let [here, there] = [here, there].map(|value| value.as_ref().and_then(Value::as_integer));
            here.zip(there).filter(|(here, there)| is_beyond(*here, *there))
        };
        let low = outside(&parameter.entry.low, &object.low, |here, there| here < there);
        let high = outside(&parameter.entry.high, &object.high, |here, there| here > there);
        if let Some((here, there)) = low.or(high) {
            let address = format!("{:04X}:{:02X}", object.index, object.sub);
            let message = format!("parameter {} goes to {here}, {address} only to {there}", parameter.number);
            let note = note(message).at(parameter.span, "");
            out.push(note.help(format!("take {there}, or correct the limit of {address} with a reason")));
        }
    }
}

pub(super) fn unused_name(cx: &Context<'_>, out: &mut Out<'_>) {
    let used = |meaning: Meaning| cx.changes.uses.iter().any(|used| used.meaning == meaning);
    let mut unused = |kind: &str, name: &str, span: Span| {
        out.push(note(format!("the {kind} `{name}` is not used")).at(span, ""));
    };
    for (name, quantity) in &cx.device.quantities {
        if !used(Meaning::Quantity(name.clone())) {
            unused("quantity", name, quantity.span);
        }
    }
    for (name, enumeration) in &cx.device.enumerations {
        if !used(Meaning::Enumeration(name.clone())) {
            unused("enumeration", name, enumeration.span);
        }
    }
    for (name, bit_field) in &cx.device.bit_fields {
        if !used(Meaning::BitField(name.clone())) {
            unused("bit field", name, bit_field.span);
        }
    }
}

pub(super) fn mixed_types(cx: &Context<'_>, out: &mut Out<'_>) {
    let data_type = |used: &Use| user(cx, used).map(|entry| entry.data_type);
    let mut first: Vec<&Use> = Vec::new();
    for used in &cx.changes.uses {
        let Some(earlier) = first.iter().find(|earlier| earlier.meaning == used.meaning) else {
            first.push(used);
            continue;
        };
        if let (Some(a), Some(b)) = (data_type(earlier), data_type(used))
            && a != b
        {
            let note = note("entries of different data types share a meaning");
            let note = note.at(used.span, format!("{:04X}:{:02X} is {b}", used.index, used.sub));
            out.push(note.and(earlier.span, format!("{:04X}:{:02X} is {a}", earlier.index, earlier.sub)));
        }
    }
}

pub(super) fn meaning_outside_type(cx: &Context<'_>, out: &mut Out<'_>) {
    for used in &cx.changes.uses {
        let Some(entry) = user(cx, used) else { continue };
        let Some((low, high)) = entry.data_type.range() else {
            if !matches!(entry.data_type, DataType::Real32 | DataType::Real64) {
                out.push(note(format!("{} is no number", entry.data_type)).at(used.span, ""));
            }
            continue;
        };
        let what = match &used.meaning {
            Meaning::Enumeration(name) => cx.device.enumerations.get(name).and_then(|enumeration| {
                let outside = |value: &&Named<i128>| !(low..=high).contains(&value.value);
                let value = enumeration.values.iter().find(outside)?;
                Some((format!("the value {}", value.value), enumeration.span))
            }),
            Meaning::BitField(name) => cx.device.bit_fields.get(name).and_then(|bit_field| {
                let bits = entry.data_type.bits()?;
                let outside = |field: &&Named<Bits>| field.value.high >= bits;
                let field = bit_field.fields.iter().find(outside)?;
                Some((format!("bit {}", field.value.high), bit_field.span))
            }),
            _ => None,
        };
        if let Some((what, span)) = what {
            let note = note(format!("{} has no room for {what}", entry.data_type));
            out.push(note.at(used.span, "used here").and(span, "defined here"));
        }
    }
}

pub(super) fn unknown_condition(cx: &Context<'_>, out: &mut Out<'_>) {
    for (condition, span) in &cx.changes.conditions {
        match cx.device.entry(condition.index, condition.sub) {
            Some(entry) if entry.data_type.range().is_some() => {}
            Some(entry) => out.push(note(format!("{} is no number", entry.data_type)).at(*span, "")),
            None => {
                let message = format!("the data sheet has no {:04X}:{:02X}", condition.index, condition.sub);
                out.push(note(message).at(*span, ""));
            }
        }
    }
}
