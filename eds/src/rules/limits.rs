//! Rules about values, their data types, limits and access rights.

use super::context::{Context, place};
use super::remedy::toml;
use super::rule::{Out, note};
use crate::diagnostic::Diagnostic;
use crate::finding::{Finding, Kind, Repeated};
use crate::model::keys::Key;
use crate::model::types::{Class, DataType};
use crate::model::{AccessType, Entry, ObjectKind, Value};
use crate::parse::facts::Unlimited;
use crate::parse::number;
use crate::patch::{Change, Patch};
use crate::standard;
use lexican_cia::cia301;

fn above(a: &Value, b: &Value) -> bool {
    match (a, b) {
        (Value::Integer(a), Value::Integer(b)) => a > b,
        (Value::Real(a), Value::Real(b)) => a > b,
        (Value::NodeIdPlus(a), Value::NodeIdPlus(b)) => a > b,
        _ => false,
    }
}

pub(super) fn limits_reversed(cx: &Context<'_>, out: &mut Out<'_>) {
    for entry in cx.device.entries() {
        let Some((low, high)) = entry.low.as_ref().zip(entry.high.as_ref()) else { continue };
        if above(low, high) {
            let note = note(format!("the limits of {} are reversed", place(entry)));
            let note = note.at(cx.entry_span(entry, Key::LowLimit), "the low one");
            let note = note.and(cx.entry_span(entry, Key::HighLimit), "the high one");
            let holds = |low: &Value, high: &Value| {
                let inside = |value: &&Value| !above(low, value) && !above(value, high);
                !above(low, high) && [&entry.default, &entry.configured].into_iter().flatten().all(|v| inside(&v))
            };
            let corrected = |keys: String| cx.correct(entry, &keys);
            let narrow = narrower(cx, entry, low).filter(|(_, narrow)| holds(narrow, high));
            out.push(note.mend(match narrow {
                Some((bits, narrow)) => Some(format!(
                    "if the low limit is a negative number of {bits} bits, {}",
                    corrected(format!("low = {}", toml(&narrow)))
                )),
                None => holds(high, low).then(|| {
                    let swapped = corrected(format!("low = {}\nhigh = {}", toml(high), toml(low)));
                    format!("if they are only exchanged, {swapped}")
                }),
            }));
        }
    }
}

/// The low limit read as a negative number of 8 or 16 bits, where a longer signed type has only that many hexadecimal
/// digits.
fn narrower(cx: &Context<'_>, entry: &Entry, low: &Value) -> Option<(u8, Value)> {
    let low = low.as_integer().filter(|_| entry.data_type.class() == Class::Signed)?;
    let (_, line) = cx.line(cx.entry_span(entry, Key::LowLimit))?;
    let digits = line.split_once('=')?.1.trim().to_ascii_lowercase();
    let bits = 4 * u8::try_from(digits.strip_prefix("0x")?.len()).ok()?;
    let is_negative = matches!(bits, 8 | 16) && low >> (bits - 1) == 1;
    is_negative.then(|| (bits, Value::Integer(low - (1 << bits))))
}

pub(super) fn limit_outside_type(cx: &Context<'_>, out: &mut Out<'_>) {
    for entry in cx.device.entries() {
        for (key, value) in [(Key::LowLimit, &entry.low), (Key::HighLimit, &entry.high)] {
            let Some(note) = outside_type(cx, entry, key, value.as_ref()) else { continue };
            let range = cx.range(entry.data_type).zip(value.as_ref().and_then(Value::as_integer));
            // Only if the data type is the narrower one; otherwise the type is wrong.
            let nearest = range.and_then(|((low, high), value)| match key {
                Key::LowLimit => (value < low).then_some(Value::Integer(low)),
                _ => (value > high).then_some(Value::Integer(high)),
            });
            let word = if key == Key::LowLimit { "low" } else { "high" };
            let values = [&entry.default, &entry.configured];
            let standard = standard::object(entry.index, cx.device.profile).and_then(|it| it.data_type(entry.sub));
            let is_right_type = standard.is_none_or(|standard| standard == entry.data_type)
                && values.into_iter().all(|value| cx.fits(entry.data_type, value.as_ref()));
            let remedy = nearest.filter(|nearest| is_right_type && keeps_order(entry, key, nearest));
            let remedy = remedy.map(|nearest| cx.correct(entry, &format!("{word} = {}", toml(&nearest))));
            out.push(note.mend(remedy.map(|remedy| format!("as far as {} goes, {remedy}", entry.data_type))));
        }
    }
}

/// Whether values inside the limits stay inside after the limit `key` becomes `limit`.
fn keeps_order(entry: &Entry, key: Key, limit: &Value) -> bool {
    let others = [&entry.default, &entry.configured, if key == Key::LowLimit { &entry.high } else { &entry.low }];
    let beyond = |value: &&Value| if key == Key::LowLimit { above(limit, value) } else { above(value, limit) };
    !others.into_iter().flatten().any(|value| beyond(&value))
}

pub(super) fn default_outside_type(cx: &Context<'_>, out: &mut Out<'_>) {
    for entry in cx.device.entries() {
        for (key, value) in [(Key::DefaultValue, &entry.default), (Key::ParameterValue, &entry.configured)] {
            if let Some(note) = outside_type(cx, entry, key, value.as_ref()) {
                out.push(note);
            }
        }
    }
}

/// Reports a value outside the range of its data type.
fn outside_type(cx: &Context<'_>, entry: &Entry, key: Key, value: Option<&Value>) -> Option<Diagnostic> {
    if cx.fits(entry.data_type, value) {
        return None;
    }
    let range = cx.range(entry.data_type);
    let range = range.map_or(format!("{:e} to {:e}", f32::MIN, f32::MAX), |(low, high)| format!("{low} to {high}"));
    let note = note(format!("`{}` does not fit into {}", key.name(), entry.data_type));
    let note = note.at(cx.entry_span(entry, key), format!("{range} do"));
    Some(note.and(cx.entry_span(entry, Key::DataType), "the data type"))
}

pub(super) fn default_outside_limits(cx: &Context<'_>, out: &mut Out<'_>) {
    for entry in cx.device.entries() {
        outside_limits(cx, entry, Key::DefaultValue, entry.default.as_ref(), out);
    }
}

pub(super) fn value_outside_limits(cx: &Context<'_>, out: &mut Out<'_>) {
    for entry in cx.device.entries() {
        outside_limits(cx, entry, Key::ParameterValue, entry.configured.as_ref(), out);
    }
}

fn outside_limits(cx: &Context<'_>, entry: &Entry, key: Key, value: Option<&Value>, out: &mut Out<'_>) {
    let Some(value) = value else { return };
    // Reversed limits have their own rule.
    if let Some((low, high)) = entry.low.as_ref().zip(entry.high.as_ref())
        && above(low, high)
    {
        return;
    }
    let (limit, side, word) = if entry.low.as_ref().is_some_and(|low| above(low, value)) {
        (Key::LowLimit, "below the low limit", "low")
    } else if entry.high.as_ref().is_some_and(|high| above(value, high)) {
        (Key::HighLimit, "above the high limit", "high")
    } else {
        return;
    };
    let note = note(format!("`{}` is {side}", key.name())).at(cx.entry_span(entry, key), "");
    let note = note.and(cx.entry_span(entry, limit), "the limit");
    let wider = cx.fits(entry.data_type, Some(value));
    let wider = wider.then(|| cx.correct(entry, &format!("{word} = {}", toml(value))));
    out.push(note.mend(wider.map(|remedy| format!("if the device goes that far, {remedy}"))));
}

pub(super) fn zero_limits(cx: &Context<'_>, out: &mut Out<'_>) {
    const MAX_PLACES: usize = 3;
    let key = [Key::LowLimit, Key::HighLimit];
    let corrected = |at: &Unlimited| key.iter().any(|&key| cx.changes.correction(at.index, at.sub, key).is_some());
    let unlimited: Vec<&Unlimited> = cx.facts.unlimited.iter().filter(|at| !corrected(at)).collect();
    let message = match unlimited.as_slice() {
        [] => return,
        [only] => format!("the limits of {:04X}:{:02X} are both 0, which is read as none", only.index, only.sub),
        several => format!("the limits of {} entries are both 0, which is read as none", several.len()),
    };
    let places = unlimited.iter().take(MAX_PLACES).map(|at| at.limits[0]);
    let finding = note(message).at_each(places, "no limit", "nor here");
    let lines = unlimited.iter().flat_map(|at| at.limits).filter_map(|span| cx.line(span));
    let removed: Patch = lines.map(|(line, _)| Change::Remove(line, line)).collect();
    let finding = finding.fix(Some(removed));
    out.push(match finding.help {
        Some(_) => finding,
        None => finding.help("what can really be 0 only has `low = 0` and `high = 0` in an overlay, with a reason"),
    });
}

pub(super) fn real_bits(cx: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let Kind::RealBits(Repeated { key, count }) = &finding.kind else { return None };
    let (line, _) = cx.line(finding.span)?;
    let text = &cx.facts.syntax.source.text()[finding.span.start as usize..finding.span.end as usize];
    // More digits than the bits of a REAL32 have.
    let data_type = if text.len() > "0x12345678".len() { DataType::Real64 } else { DataType::Real32 };
    let Some(Value::Real(value)) = number::value(text, data_type).ok().flatten().map(|read| read.value) else {
        return None;
    };
    let decimal = if data_type == DataType::Real32 { format!("{:?}", value as f32) } else { format!("{value:?}") };
    let times = if *count == 1 { String::new() } else { format!(" ({count} times)") };
    let note = note(format!("`{key}` of a REAL is given by its bits{times}"));
    let note = note.at(finding.span, format!("read as {decimal}"));
    let remedy = (*count == 1).then(|| Patch::from_iter([Change::Line(line, format!("{key}={decimal}"))]));
    Some(note.help(
        remedy.map_or_else(|| "other readers may expect decimal numbers here".to_owned(), |remedy| remedy.to_string()),
    ))
}

pub(super) fn equal_limits(cx: &Context<'_>, out: &mut Out<'_>) {
    for entry in cx.device.entries().filter(|entry| entry.access.writable() && entry.low.is_some()) {
        // Storing and restoring parameters takes a single value by design.
        let is_command = matches!(entry.index, cia301::STORE_PARAMETERS | cia301::RESTORE_DEFAULT_PARAMETERS);
        // If the default is the same value, this is intended: the device has only this value.
        if entry.low == entry.high && entry.default != entry.low && !is_command {
            let note = note(format!("{} can have one value only", place(entry)));
            let note = note.at(cx.entry_span(entry, Key::LowLimit), "");
            out.push(note.and(cx.entry_span(entry, Key::HighLimit), "the same"));
        }
    }
}

pub(super) fn value_not_writable(cx: &Context<'_>, out: &mut Out<'_>) {
    for entry in cx.device.entries().filter(|entry| entry.configured.is_some() && !entry.access.writable()) {
        // Without a default there is nothing that the configured value could differ from.
        if entry.default.is_some() && entry.configured != entry.default {
            let span = cx.entry_span(entry, Key::ParameterValue);
            let note = note(format!("{} is {}", place(entry), entry.access.name())).at(span, "cannot be written");
            // In a table, removing the line would make its count wrong.
            let own =
                cx.facts.syntax.section_at(entry.span).and_then(|section| section.get(Key::ParameterValue.name()));
            let removed = own.and_then(|_| cx.remove(span));
            out.push(note.mend(removed.map(|remedy| format!("the value cannot be downloaded, so {remedy}"))));
        }
    }
}

pub(super) fn constant_without_default(cx: &Context<'_>, out: &mut Out<'_>) {
    for entry in cx.device.entries() {
        let number = entry.data_type.bits().is_some();
        if entry.access == AccessType::Const && entry.default.is_none() && entry.configured.is_none() && number {
            let note = note(format!("the constant {} has no value", place(entry)));
            let note = note.at(cx.entry_span(entry, Key::AccessType), "");
            let Some(sub) = highest_sub(cx, entry) else {
                out.push(note);
                continue;
            };
            let note = note.mend(Some(cx.correct(entry, &format!("default = {sub}"))));
            // If a default is given but could not be read, its value is unknown here.
            let absent = cx.entry_span(entry, Key::DefaultValue) == entry.span;
            out.push(note.fix(absent.then(|| cx.set_own(entry, Key::DefaultValue, &sub.to_string())).flatten()));
        }
    }
}

/// The highest sub-index, as sub-index 0 of an array or record says it.
fn highest_sub(cx: &Context<'_>, entry: &Entry) -> Option<u8> {
    let object = cx.device.object(entry.index)?;
    let list = matches!(object.kind, ObjectKind::Array | ObjectKind::Record) && entry.sub == 0;
    let counts = cia301::counts_entries(entry.index);
    let highest = object.entries.iter().rev().find(|entry| entry.sub != 0xFF)?;
    (list && !counts).then_some(highest.sub)
}

pub(super) fn unmappable_type(cx: &Context<'_>, out: &mut Out<'_>) {
    for entry in cx.device.entries().filter(|entry| entry.pdo_mapping) {
        if entry.data_type.bits().is_none() && !matches!(entry.data_type, DataType::Other(_)) {
            let note = note(format!("{} cannot be mapped into a PDO", entry.data_type));
            let note = note.at(cx.entry_span(entry, Key::PdoMapping), "says that it can");
            let note = note.and(cx.entry_span(entry, Key::DataType), "the data type");
            out.push(note.mend(not_mappable(cx, entry)));
        }
    }
}

pub(super) fn rwr_not_mappable(cx: &Context<'_>, out: &mut Out<'_>) {
    for entry in cx.device.entries().filter(|entry| !entry.pdo_mapping) {
        if matches!(entry.access, AccessType::Rwr | AccessType::Rww) {
            let note = note(format!("{} is {}, but not mappable", place(entry), entry.access.name()));
            let note = note.at(cx.entry_span(entry, Key::AccessType), "");
            out.push(note.help(cx.correct(entry, "access = \"rw\"")));
        }
    }
}

pub(super) fn mappable_parameter(cx: &Context<'_>, out: &mut Out<'_>) {
    let parameters = cx.device.entries().filter(|entry| !cia301::can_be_mapped(entry.index));
    for entry in parameters.filter(|entry| entry.pdo_mapping) {
        let note = note(format!("the parameter {} is mappable", place(entry)));
        out.push(note.at(cx.entry_span(entry, Key::PdoMapping), "").mend(not_mappable(cx, entry)));
    }
}

/// A remedy that removes the entry's mappability, if nothing needs it.
fn not_mappable(cx: &Context<'_>, entry: &Entry) -> Option<String> {
    let needed = cx.is_mapped(entry) || matches!(entry.access, AccessType::Rwr | AccessType::Rww);
    (!needed).then(|| cx.correct(entry, "pdo_mapping = false"))
}
