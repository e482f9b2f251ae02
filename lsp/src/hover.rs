//! Hover: the object at a position, and rules with findings there.

use lexican_eds::dump::{facts, value_text};
use lexican_eds::model::{Device, Entry, Value};
use lexican_eds::outline::Outline;
use lexican_eds::{Span, rules, standard};
use lexican_runtime::NodeId;
use lexican_runtime::object::Address;
use lexican_toolbox::values::lookup::resolve;
use lexican_toolbox::values::{DeviceValues, address, name, resolved};
use serde_json::{Value as Json, json};

use crate::document::{Document, Kind};
use crate::findings::shown;
use crate::keys;
use crate::place::{Place, place};

/// The `Hover` at an offset.
pub(crate) fn hover(document: &Document, offset: u32) -> Option<Json> {
    let (place, what) = what(document, offset).unzip();
    let here = shown(document).filter(|(_, place)| (place.start..=place.end).contains(&offset));
    let mut codes: Vec<_> = here.map(|(finding, _)| finding.code).collect();
    codes.dedup();
    let rules = codes.into_iter().filter_map(rules::rule);
    let rules = rules.map(|rule| format!("`{}`: **{}** {}", rule.code, rule.holds, rule.why));
    let texts: Vec<_> = what.into_iter().chain(rules).collect();
    let contents = json!({ "kind": "markdown", "value": texts.join("\n\n---\n\n") });
    let range = document.range(place.unwrap_or(Span::eds(offset, offset)));
    (!texts.is_empty()).then(|| json!({ "contents": contents, "range": range }))
}

fn what(document: &Document, offset: u32) -> Option<(Span, String)> {
    let source = document.source();
    if document.kind == Kind::Sheet {
        let outline = Outline::new(source);
        if let Some(it) = outline.mention_at(offset) {
            return Some((it.span, of_object(&document.device, it.index, it.sub)?));
        }
        let section = outline.section_at(source.line_at(offset))?;
        let (key, value) = section.pairs.iter().find(|(key, value)| (key.start..=value.end).contains(&offset))?;
        let (index, sub) = section.object?;
        return Some((Span::eds(key.start, value.end), of_object(&document.device, index, sub)?));
    }
    let place = place(source.text(), offset as usize)?;
    let word = &source.text()[place.word.clone()];
    let span = Span::eds(place.word.start as u32, place.word.end as u32);
    let Some((device, address, sub)) = object(document, &place, word) else {
        let is_known = document.kind == Kind::Machine && !word.is_empty();
        return Some((span, is_known.then(|| keys::description(&place, word))??));
    };
    Some((span, of_object(device, address.index(), sub)?))
}

/// The object that a word of an overlay or machine means, with its device, and the sub-index if the object has several.
pub(crate) fn object<'d>(
    document: &'d Document,
    place: &Place,
    word: &str,
) -> Option<(&'d Device, Address, Option<u8>)> {
    let (device, named) = match document.kind {
        // A condition begins with its object.
        Kind::Overlay => (&document.device, resolve(None, word.split_whitespace().next()?).ok()?),
        _ => {
            let (device, word) = device_of(document, place, word)?;
            (device, resolve(Some(device), word).ok()?)
        }
    };
    let has_subs = device.object(named.index())?.kind.has_subs();
    let is_whole = has_subs && named.sub() == 0 && !word.contains([':', '/']);
    Some((device, named, (!is_whole).then_some(named.sub())))
}

/// The device that a word of a machine refers to, and the rest of the word: of the node before its point, else of the
/// node whose table it is in.
pub(crate) fn device_of<'d, 'w>(document: &'d Document, place: &Place, word: &'w str) -> Option<(&'d Device, &'w str)> {
    let is_of_node = |key: &String| ["settings", "limits", "tpdo", "rpdo"].contains(&key.as_str());
    let (name, word) = match place.path.first()?.as_str() {
        "node" | "simulate" if place.path.get(2).is_some_and(is_of_node) => (place.path[1].as_str(), word),
        "wire" | "bench" => word.split_once('.')?,
        _ => return None,
    };
    let node = document.machine.as_ref()?.buses().find_map(|machine| machine.node(name))?;
    Some((node.device()?, word))
}

/// An object with its entries, or a single entry.
fn of_object(device: &Device, index: u16, sub: Option<u8>) -> Option<String> {
    let object = device.object(index)?;
    let entry = object.entry(sub.unwrap_or(0)).filter(|_| sub.is_some() || !object.kind.has_subs());
    let mut lines = match entry {
        Some(entry) => {
            let facts = facts(object, entry).skip(3).map(|(column, text)| fact(device, entry, column, text));
            [vec![format!("**{} {}**\n", address(entry), name(device, entry))], facts.collect()].concat()
        }
        None => {
            let head = format!("**{index:04X} {}** ({})\n", object.name, object.kind.name());
            std::iter::once(head).chain(object.entries.iter().map(|entry| summary(device, entry))).collect()
        }
    };
    let standard = standard::object(index, device.profile).and_then(|standard| standard.meaning);
    let said = [object.description.as_deref(), entry.and_then(|entry| entry.description.as_deref())];
    let mut said: Vec<_> = said.into_iter().flatten().chain(standard.map(|meaning| meaning.description)).collect();
    said.dedup();
    lines.extend(said.iter().map(|said| format!("\n{said}")));
    Some(lines.join("\n"))
}

/// A column of an entry.
fn fact(device: &Device, entry: &Entry, column: &str, text: String) -> String {
    let value = match column {
        "default" => &entry.default,
        "low_limit" => &entry.low,
        "high_limit" => &entry.high,
        "configured" => &entry.configured,
        _ => &None,
    };
    format!("- {column}: {}", value.as_ref().map_or(text, |value| of_value(device, entry, value)))
}

fn summary(device: &Device, entry: &Entry) -> String {
    let default = entry.default.as_ref().map(|default| format!(", {}", of_value(device, entry, default)));
    let (data_type, access) = (entry.data_type, entry.access.name());
    format!("- `{:02X}` {}: {data_type}, {access}{}", entry.sub, entry.name, default.unwrap_or_default())
}

/// A value, with its unit or name, for the node-ID of a DCF.
fn of_value(device: &Device, entry: &Entry, value: &Value) -> String {
    let node = device.commissioning.as_ref().and_then(|it| NodeId::new(it.node_id?));
    let value_here = node.map_or_else(|| value.clone(), |node| resolved(value, node));
    let (plain, described) = (value_text(value), DeviceValues::new(device).describe(entry, &value_here));
    if described == plain { plain } else { format!("{plain} = {described}") }
}
