//! Rules about objects, their sub-indices, names, data types and access types.

use super::context::{Context, are, listed, place};
use super::remedy::{MAX_STEPS, overlay, overlays, quoted};
use super::rule::{Out, note};
use crate::diagnostic::Diagnostic;
use crate::finding::{Finding, Kind};
use crate::model::keys::Key;
use crate::model::types::DataType;
use crate::model::{Device, Entry, Object, ObjectKind, Value};
use crate::patch::{Change, Patch};
use crate::standard;
use crate::text::Span;
use lexican_cia::cia301;

pub(super) fn reserved_index(cx: &Context<'_>, out: &mut Out<'_>) {
    for object in cx.device.objects.iter().filter(|object| matches!(object.index, 0 | 0x260..=0xFFF | 0xC000..)) {
        out.push(note(format!("the index {:04X} is reserved", object.index)).at(object.span, ""));
    }
}

pub(super) fn missing_name(cx: &Context<'_>, out: &mut Out<'_>) {
    for (object, _) in cx.objects() {
        if object.name.is_empty() {
            let note = note(format!("the object {:04X} has no name", object.index)).at(object.span, "");
            let name = format!("[object.\"{0:04X}\"]\nname = \"Object {0:04X}h\"", object.index);
            out.push(note.help(format!("in an overlay:\n{name}")));
        }
        for entry in object.entries.iter().filter(|entry| object.kind.has_subs() && entry.name.is_empty()) {
            let note = note(format!("the entry {} has no name", place(entry))).at(entry.span, "");
            let name = format!("[object.\"{}\"]\nname = \"Sub-index {}\"", place(entry), entry.sub);
            out.push(note.help(format!("in an overlay:\n{name}")));
        }
    }
}

pub(super) fn long_name(cx: &Context<'_>, out: &mut Out<'_>) {
    for entry in cx.device.entries() {
        let length = entry.name.chars().count();
        if length > 241 {
            let short: String = entry.name.chars().take(60).collect();
            let name = format!("[object.\"{}\"]\nname = {}", cx.address(entry), quoted(short.trim_end()));
            let note = note(format!("the name has {length} characters"));
            let note = note.at(cx.entry_span(entry, Key::ParameterName), "");
            out.push(note.help(format!("in an overlay:\n{name}")));
        }
    }
}

/// An object, or the entry of one.
type Address = (u16, Option<u8>);

pub(super) fn same_name(cx: &Context<'_>, out: &mut Out<'_>) {
    let objects = cx.device.objects.iter().map(|object| (object.name.as_str(), (object.index, None)));
    same_names("objects", objects, cx, out);
    // The entries of an array are addressed by number; only those of a record by name.
    for record in cx.device.objects.iter().filter(|object| object.kind == ObjectKind::Record) {
        let entries = record.entries.iter().map(|entry| (entry.name.as_str(), (entry.index, Some(entry.sub))));
        same_names("entries", entries, cx, out);
    }
}

/// Reports each name that several objects have, once.
fn same_names<'a>(what: &str, names: impl Iterator<Item = (&'a str, Address)>, cx: &Context<'_>, out: &mut Out<'_>) {
    let names = names.map(|(name, address)| (identifier(name), address, name));
    // A name without letters gives no identifier; the address is used instead.
    let mut names: Vec<(String, Address, &str)> = names.filter(|(name, ..)| !name.is_empty()).collect();
    names.sort();
    for namesakes in names.chunk_by(|a, b| a.0 == b.0).filter(|namesakes| namesakes.len() > 1) {
        if namesakes.iter().all(|(_, (index, _), _)| cia301::COMMUNICATION.contains(index)) || is_on_axes(namesakes) {
            continue;
        }
        let listed = listed(namesakes, |(_, address, _)| shown(*address));
        let places = namesakes.iter().map(|(_, address, _)| name_span(cx, *address));
        let mut finding = note(format!("the {what} {listed} have the same name")).at_each(places, "", "");
        let other = |(_, address, name): &(String, Address, &str)| {
            let number = address.1.map_or(format!("{:04X}", address.0), |sub| format!("{sub:02X}"));
            (shown(*address), format!("{name} {number}"))
        };
        let others: Vec<(String, String)> = namesakes[1..].iter().map(other).collect();
        let is_free =
            |(_, name): &(String, String)| names.binary_search_by_key(&identifier(name), |n| n.0.clone()).is_err();
        if others.len() <= MAX_STEPS && others.iter().all(is_free) {
            let table =
                |(address, name): (String, String)| format!("\n[object.\"{address}\"]\nname = {}", quoted(&name));
            finding = finding.help(format!("in an overlay:{}", others.into_iter().map(table).collect::<String>()));
        }
        out.push(finding);
    }
}

/// Whether these are the same object of a profile on several axes. 67FFh is the device type of each axis, as 1000h is
/// of all.
fn is_on_axes(namesakes: &[(String, Address, &str)]) -> bool {
    let objects = || namesakes.iter().filter_map(|(_, (index, sub), _)| sub.is_none().then_some(*index));
    let of_axis = |index: u16| match index {
        cia301::DEVICE_TYPE => Some(0x7FF),
        0x6000..=0x9FFF => Some((index - 0x6000) % 0x800),
        _ => None,
    };
    let Some(first) = objects().next().filter(|_| objects().count() == namesakes.len()) else { return false };
    objects().all(|index| of_axis(index).is_some() && of_axis(index) == of_axis(first))
}

fn shown((index, sub): Address) -> String {
    match sub {
        Some(sub) => format!("{index:04X}:{sub:02X}"),
        None => format!("{index:04X}"),
    }
}

fn name_span(cx: &Context<'_>, (index, sub): Address) -> Span {
    let Some(object) = cx.device.object(index) else { return Span::default() };
    match sub.and_then(|sub| object.entry(sub)) {
        Some(entry) => cx.entry_span(entry, Key::ParameterName),
        None => cx.value_span(object.span, Key::ParameterName),
    }
}

/// The letters and digits of a name, in lower case.
fn identifier(name: &str) -> String {
    let of_byte = |byte: u8| byte.is_ascii_alphanumeric().then(|| char::from(byte.to_ascii_lowercase()));
    let mut identifier = String::with_capacity(name.len());
    match name.is_ascii() {
        true => identifier.extend(name.bytes().filter_map(of_byte)),
        false => identifier.extend(name.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase)),
    }
    identifier
}

pub(super) fn sub_without_object(cx: &Context<'_>, out: &mut Out<'_>) {
    for (object, _) in cx.objects().filter(|(_, facts)| !facts.header) {
        let note = note(format!("the section `[{:04X}]` is missing", object.index));
        out.push(note.at(object.span, "belongs to it"));
    }
}

pub(super) fn sub_count(cx: &Context<'_>, out: &mut Out<'_>) {
    for (object, facts) in cx.objects() {
        let found = || are(facts.subs.into(), "sub-index");
        let set = || cx.set(object.span, Key::SubNumber.name(), &facts.subs.to_string());
        match facts.sub_number {
            Some(said) if said != facts.subs && facts.compact == 0 && object.kind.has_subs() => {
                let span = cx.value_span(object.span, Key::SubNumber);
                let note = note(format!("there {}, not {said}", found())).at(span, "says otherwise");
                let last = object.entries.last().filter(|entry| entry.span != object.span);
                let note = last.into_iter().fold(note, |note, last| note.and(last.span, "the last one"));
                out.push(note.fix(set()));
            }
            None if facts.subs > 0 && facts.header => {
                let note = note(format!("there {}, but no `SubNumber`", found())).at(object.span, "");
                out.push(note.fix(set()));
            }
            _ => {}
        }
    }
}

pub(super) fn variable_with_subs(cx: &Context<'_>, out: &mut Out<'_>) {
    for (object, facts) in cx.objects() {
        if !object.kind.has_subs() || !facts.header || facts.declared == Some(object.kind) {
            continue;
        }
        let span = cx.value_span(object.span, Key::ObjectType);
        let message = match facts.declared {
            Some(kind) => format!("a {} has no sub-indices", kind.name()),
            None => "an object with sub-indices does not say whether it is an ARRAY or a RECORD".to_owned(),
        };
        let kind = format!("0x{:X}", object.kind.code());
        let note = note(message).at(span, format!("read as {}", object.kind.name()));
        out.push(note.mend(cx.set(object.span, Key::ObjectType.name(), &kind)));
    }
}

pub(super) fn no_subs(cx: &Context<'_>, out: &mut Out<'_>) {
    for object in cx.device.objects.iter().filter(|object| object.kind.has_subs() && object.entries.is_empty()) {
        let message = format!("the {} {:04X} has no sub-indices", object.kind.name(), object.index);
        let section = cx.facts.syntax.section_at(object.span);
        let has_type = section.and_then(|section| section.get(Key::DataType.name())).is_some();
        let single = has_type.then(|| cx.set(object.span, Key::ObjectType.name(), "0x7")).flatten();
        let single = single.map(|single| format!("if it is a single value, {single}"));
        out.push(note(message).at(cx.value_span(object.span, Key::ObjectType), "").mend(single));
    }
}

pub(super) fn missing_sub_0(cx: &Context<'_>, out: &mut Out<'_>) {
    for object in cx.device.objects.iter().filter(|object| object.kind != ObjectKind::DefStruct) {
        if object.kind.has_subs() && object.entries.first().is_some_and(|entry| entry.sub != 0) {
            let message = format!("the {} {:04X} has no sub-index 0", object.kind.name(), object.index);
            out.push(note(message).at(object.span, ""));
        }
    }
}

/// Sub-index 0 of all arrays and records.
fn counts(device: &Device) -> impl Iterator<Item = (&Object, &Entry)> {
    let lists = device.objects.iter().filter(|object| matches!(object.kind, ObjectKind::Array | ObjectKind::Record));
    lists.filter_map(|object| Some((object, object.entry(0)?)))
}

pub(super) fn sub_0_type(cx: &Context<'_>, out: &mut Out<'_>) {
    for (_, entry) in counts(cx.device) {
        if entry.data_type != DataType::Unsigned8 && !entry.data_type.is_unknown() {
            let note = note(format!("{} is {}", place(entry), entry.data_type));
            let note = note.at(cx.entry_span(entry, Key::DataType), "expected UNSIGNED8");
            // Only the device knows the length that it sends, so the data sheet is not changed.
            let corrected = || cx.correct(entry, "data_type = \"UNSIGNED8\"");
            let can = cx.can_become(entry, DataType::Unsigned8);
            out.push(note.mend(can.then(|| format!("if the device answers with one byte, {}", corrected()))));
        }
    }
}

pub(super) fn highest_sub(cx: &Context<'_>, out: &mut Out<'_>) {
    for (object, facts) in cx.objects() {
        let counts = cia301::counts_entries(object.index) || facts.compact > 0;
        if counts || !matches!(object.kind, ObjectKind::Array | ObjectKind::Record) {
            continue;
        }
        let highest = object.entries.iter().rev().find(|entry| entry.sub != 0xFF);
        let Some((count, highest)) = object.entry(0).zip(highest) else { continue };
        let Some(Value::Integer(said)) = count.default else { continue };
        // A writable sub-index 0 counts the entries in use.
        let counts_used = count.access.writable() && said < i128::from(highest.sub);
        if said != i128::from(highest.sub) && !counts_used {
            let note = note(format!("the highest sub-index is {}, not {said}", highest.sub));
            let note = note.at(cx.entry_span(count, Key::DefaultValue), "says otherwise");
            let note = note.and(highest.span, "the highest one");
            let can = cx.can_default(count, highest.sub.into());
            out.push(note.mend(can.then(|| cx.correct(count, &format!("default = {}", highest.sub)))));
        }
    }
}

pub(super) fn array_types(cx: &Context<'_>, out: &mut Out<'_>) {
    for array in cx.device.objects.iter().filter(|object| object.kind == ObjectKind::Array) {
        let Some(first) = array.entries.iter().find(|entry| entry.sub > 0) else { continue };
        let others = array.entries.iter().filter(|entry| entry.sub > 0 && entry.data_type != first.data_type);
        let others: Vec<&Entry> = others.collect();
        let Some(other) = others.first() else { continue };
        let note = note(format!("the entries of the array {:04X} differ in type", array.index));
        let note = note.at(cx.entry_span(other, Key::DataType), other.data_type.to_string());
        let note = note.and(cx.entry_span(first, Key::DataType), first.data_type.to_string());
        let can = others.len() <= MAX_STEPS && others.iter().all(|entry| cx.can_become(entry, first.data_type));
        let keys = format!("data_type = \"{}\"", first.data_type);
        let corrected = || overlays(others.iter().map(|entry| (place(entry), keys.clone())));
        out.push(note.mend(can.then(|| format!("if all are {}, {}", first.data_type, corrected()))));
    }
}

pub(super) fn decimal_sub_index(cx: &Context<'_>, out: &mut Out<'_>) {
    for (object, facts) in cx.objects().filter(|(_, facts)| facts.compact == 0) {
        let Some(ten) = object.entry(0x10) else { continue };
        let counted = object.entry(9).is_some() && (0x0A..=0x0F).all(|sub| object.entry(sub).is_none());
        if counted && facts.subs > 0 {
            let note = note("the sub-indices seem to be counted in decimal");
            out.push(note.at(ten.span, "this is sub-index 16, and 10 to 15 are missing"));
        }
    }
}

pub(super) fn compact_count(cx: &Context<'_>, out: &mut Out<'_>) {
    for (object, facts) in cx.objects().filter(|(_, facts)| facts.compact > 0xFE) {
        let span = cx.value_span(object.span, Key::CompactSubObj);
        let note = note(format!("an object cannot have {} sub-indices", facts.compact)).at(span, "");
        out.push(note.mend(cx.replace(span, "254")));
    }
}

pub(super) fn too_many_entries(_: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let Kind::TooManyEntries(index) = finding.kind else { return None };
    let note = note(format!("the entries of {index:04X} are too many for one file"));
    Some(note.at(finding.span, "not written out"))
}

pub(super) fn undescribed_type(cx: &Context<'_>, out: &mut Out<'_>) {
    for entry in cx.device.entries() {
        if let DataType::Other(code @ 0x40..=0x25F) = entry.data_type
            && cx.device.object(code).is_none()
        {
            let note = note(format!("the data type {code:04X}h is not described"));
            out.push(note.at(cx.entry_span(entry, Key::DataType), ""));
        }
    }
}

pub(super) fn broken_link(cx: &Context<'_>, out: &mut Out<'_>) {
    for object in &cx.device.objects {
        for &link in object.links.iter().filter(|&&link| cx.device.object(link).is_none()) {
            let message = format!("the object {:04X} links to {link:04X}, which is not there", object.index);
            out.push(note(message).at(object.span, ""));
        }
        for entry in &object.entries {
            if let Some((index, sub)) = entry.inverted.filter(|&(index, sub)| cx.device.entry(index, sub).is_none()) {
                let (of, at) = (entry.index, entry.sub);
                let message =
                    format!("{of:04X}:{at:02X} has {index:04X}:{sub:02X} for its inverse, which is not there");
                out.push(note(message).at(entry.span, ""));
            }
        }
    }
}

pub(super) fn nested_object(cx: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let Kind::NestedObject(kind) = finding.kind else { return None };
    let note = note(format!("a sub-index cannot be of object type {}", kind.name())).at(finding.span, "read as VAR");
    Some(note.fix(cx.replace(finding.span, "0x7")))
}

pub(super) fn bad_object_type(cx: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let Kind::BadObjectType(code) = finding.kind else { return None };
    let read = cx.facts.address_of(finding.span).and_then(|(index, sub)| match sub {
        Some(_) => Some(ObjectKind::Variable),
        None => Some(cx.device.object(index)?.kind),
    });
    let note = note(format!("there is no object type {code}")).at(finding.span, "read as absent");
    Some(note.mend(read.and_then(|kind| cx.replace(finding.span, &format!("0x{:X}", kind.code())))))
}

pub(super) fn missing_data_type(cx: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let Kind::MissingDataType = finding.kind else { return None };
    Some(note("the entry names no data type").at(finding.span, "").mend(standard_type(cx, finding.span)))
}

pub(super) fn unknown_data_type(cx: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let Kind::UnknownDataType(data_type) = finding.kind else { return None };
    let note = note(format!("there is no data type {data_type}")).at(finding.span, "");
    Some(note.mend(standard_type(cx, finding.span)))
}

/// The data type that the standard gives an entry.
fn standard_type(cx: &Context<'_>, span: Span) -> Option<String> {
    let (index, sub) = cx.facts.address_of(span)?;
    let entry = cx.device.entry(index, sub.unwrap_or(0))?;
    let data_type = standard::object(index, cx.device.profile)?.data_type(entry.sub)?;
    // `CompactSubObj` gives a data type to all entries but sub-index 0.
    entry.data_type.is_unknown().then_some(())?;
    Some(overlay(&cx.address(entry), &format!("data_type = \"{data_type}\"")))
}

pub(super) fn missing_access_type(cx: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let Kind::MissingAccessType = finding.kind else { return None };
    let note = note("the entry names no access type").at(finding.span, "read as rw");
    let said =
        cx.line(finding.span).map(|(line, _)| Patch::from_iter([Change::After(line, "AccessType=rw".to_owned())]));
    Some(note.mend(said.map(|said| format!("as it is read, {said}"))))
}

pub(super) fn bad_access_type(cx: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let Kind::BadAccessType { word, access, sure } = &finding.kind else { return None };
    let note = note(format!("there is no access type `{word}`"));
    let note = note.at(finding.span, format!("read as {}", access.name()));
    let said = cx.replace(finding.span, access.name());
    Some(match sure {
        true => note.fix(said),
        false => note.mend(said.map(|said| format!("as it is read, unless the manual has another one, {said}"))),
    })
}
