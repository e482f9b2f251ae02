//! Completion.

use lexican_eds::Span;
use lexican_eds::model::{AccessType, Device, Entry, ObjectKind};
use lexican_eds::outline::{Outline, Section};
use lexican_eds::overlay::keys_of;
use lexican_eds::rules::rules;
use lexican_eds::types::DataType;
use lexican_machine::Machine;
use lexican_toolbox::values::{DeviceValues, address, choices, name};
use serde_json::{Value, json};

use crate::document::{Document, Kind};
use crate::hover::{device_of, object};
use crate::keys;
use crate::place::{Part, Place, place};

/// A completion item.
#[derive(Clone, Default)]
struct Offer {
    /// The text to insert.
    text: String,
    label: String,
    detail: String,
    /// May be empty.
    documentation: String,
}

/// The most items at once: a device has thousands of entries, and editors ask again at each letter.
const MOST: usize = 1000;

/// The `CompletionList` at an offset.
pub(crate) fn completion(document: &Document, offset: u32) -> Value {
    let (word, mut offers) = match document.kind {
        Kind::Sheet => of_sheet(document, offset),
        Kind::Overlay | Kind::Machine => of_toml(document, offset as usize),
        Kind::Other => None,
    }
    .unwrap_or((Span::eds(offset, offset), Vec::new()));
    let typed = document.source().get(Span { end: offset, ..word }).to_ascii_lowercase();
    offers.retain(|offer| [&offer.label, &offer.text].iter().any(|text| text.to_ascii_lowercase().contains(&typed)));
    let (range, is_incomplete) = (document.range(word), offers.len() > MOST);
    let items = offers.into_iter().take(MOST).map(|Offer { text, label, detail, documentation }| {
        // Editors filter by this text, so users may type either the name or the number.
        let (filter, edit) = (format!("{text} {label}"), json!({ "range": range, "newText": text }));
        let mut item = json!({ "label": label, "detail": detail, "filterText": filter, "textEdit": edit });
        // Some clients show an empty box for an empty text.
        if !documentation.is_empty() {
            item["documentation"] = documentation.into();
        }
        item
    });
    json!({ "isIncomplete": is_incomplete, "items": items.collect::<Vec<_>>() })
}

fn word(text: impl Into<String>, detail: impl Into<String>) -> Offer {
    let text = text.into();
    Offer { label: text.clone(), text, detail: detail.into(), ..Offer::default() }
}

fn number(label: &str, text: String) -> Offer {
    Offer { label: label.to_owned(), detail: text.clone(), text, ..Offer::default() }
}

/// The items for a section, a key or a value in a data sheet.
fn of_sheet(document: &Document, offset: u32) -> Option<(Span, Vec<Offer>)> {
    let source = document.source();
    let outline = Outline::new(source);
    let line = source.line_at(offset);
    let (text, (start, end)) = (source.line(line), source.line_range(line));
    let indent = start + (text.len() - text.trim_start().len()) as u32;
    if text.trim_start().starts_with('[') {
        let has = |name: &str| outline.sections.iter().any(|it| source.get(it.name).eq_ignore_ascii_case(name));
        let mut names: Vec<_> = outline.mentions().map(|it| format!("{:04X}", it.index)).collect();
        names.retain(|name| !has(name));
        names.dedup();
        let offer = |name: String| Offer { text: format!("[{name}]"), label: name, ..Offer::default() };
        return Some((Span::eds(indent, end), names.into_iter().map(offer).collect()));
    }
    let section = outline.section_at(line)?;
    let before = source.get(Span::eds(indent.min(offset), offset));
    if let Some((key, value)) = before.split_once('=') {
        let start = offset - value.trim_start().len() as u32;
        return Some((Span::eds(start, end), values(&document.device, &outline, section, key.trim())));
    }
    let here = section.pairs.iter().find(|(key, _)| source.line_at(key.start) == line);
    let has = |key: &str| section.pairs.iter().any(|(other, _)| source.get(*other).eq_ignore_ascii_case(key));
    let keys = section.known_keys().iter().filter(|key| !has(key));
    let equals = if here.is_some() { "" } else { "=" };
    let offers = keys.map(|key| Offer { text: format!("{key}{equals}"), ..word(*key, "") });
    Some((Span::eds(indent, here.map_or(end, |(key, _)| key.end)), offers.collect()))
}

/// The items for the value of a key in a data sheet.
fn values(device: &Device, outline: &Outline<'_>, section: &Section, key: &str) -> Vec<Offer> {
    match key.to_ascii_lowercase().as_str() {
        "objecttype" => ObjectKind::ALL.iter().map(|it| number(it.name(), format!("0x{:X}", it.code()))).collect(),
        "datatype" => DataType::ALL.iter().map(|it| number(it.name(), format!("0x{:04X}", it.code()))).collect(),
        "accesstype" => AccessType::ALL.iter().map(|it| word(it.name(), "")).collect(),
        "pdomapping" => ["0", "1"].map(|flag| word(flag, "")).into(),
        _ if section.is_mapping(key) => {
            let mapped = |entry: &Entry| {
                let bits = device.bits(entry.data_type).filter(|_| entry.pdo_mapping)?;
                let text = format!("0x{:04X}{:02X}{bits:02X}", entry.index, entry.sub);
                Some(number(&format!("{} {}", address(entry), name(device, entry)), text))
            };
            device.entries().filter_map(mapped).collect()
        }
        _ if section.is_list() => {
            // A listed object is mentioned by its list as well as by its section.
            let listed = outline.mentions().filter(|it| it.sub.is_none() && !it.is_section());
            let listed: Vec<_> = listed.map(|it| it.index).collect();
            let objects = device.objects.iter().filter(|object| !listed.contains(&object.index));
            objects.map(|it| number(&format!("{:04X} {}", it.index, it.name), format!("0x{:04X}", it.index))).collect()
        }
        _ => Vec::new(),
    }
}

/// The items for a table, a key or a value in an overlay or machine.
fn of_toml(document: &Document, offset: usize) -> Option<(Span, Vec<Offer>)> {
    let text = document.source().text();
    let place = place(text, offset)?;
    let mut offers = match document.kind {
        Kind::Overlay => of_overlay(&document.device, &place),
        _ => of_machine(document, &place, &text[place.word.start..offset]),
    };
    // Texts need quotes, and so do keys with other characters than letters, digits, hyphens and underscores.
    let is_quoted = text[..place.word.start].ends_with(['"', '\'']);
    let is_bare = |text: &str| text.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"-_".contains(&byte));
    let is_plain = |text: &str| place.part != Part::Value && is_bare(text);
    for offer in offers.iter_mut().filter(|offer| !is_quoted && !is_plain(&offer.text)) {
        offer.text = format!("\"{}\"", offer.text);
    }
    Some((Span::eds(place.word.start as u32, place.word.end as u32), offers))
}

fn of_overlay(device: &Device, place: &Place) -> Vec<Offer> {
    let path: Vec<&str> = place.path.iter().map(String::as_str).collect();
    let entries = || device.entries().map(|entry| of_entry(device, entry)).collect();
    let keys = |table: &str| keys_of(table).iter().map(|key| word(*key, "")).collect();
    match (place.part, path.as_slice()) {
        (Part::Header, []) => keys(""),
        (Part::Header | Part::Key, ["object"]) => entries(),
        (Part::Key, [_, .., list]) if !keys_of(list).is_empty() => keys(list),
        (Part::Key, [table, ..]) => keys(table),
        (Part::Value, [.., "data_type"]) => DataType::ALL.iter().map(|it| word(it.name(), "")).collect(),
        (Part::Value, [.., "access"]) => AccessType::ALL.iter().map(|it| word(it.name(), "")).collect(),
        (Part::Value, [.., "quantity"]) => device.quantities.keys().map(|name| word(name, "")).collect(),
        (Part::Value, [.., "enumeration"]) => device.enumerations.keys().map(|name| word(name, "")).collect(),
        (Part::Value, [.., "bit_field"]) => device.bit_fields.keys().map(|name| word(name, "")).collect(),
        (Part::Value, [.., "accept"]) => rules().iter().map(|rule| word(rule.code, rule.holds)).collect(),
        (Part::Value, [.., "mapping" | "object" | "when"]) => entries(),
        _ => Vec::new(),
    }
}

/// An entry in the notation of overlays and machines.
fn of_entry(device: &Device, entry: &Entry) -> Offer {
    let has_subs = device.object(entry.index).is_some_and(|object| object.kind.has_subs());
    let text = if has_subs { address(entry).to_string() } else { format!("{:04X}", entry.index) };
    let label = format!("{text} {}", name(device, entry));
    Offer { label, detail: entry.data_type.to_string(), text, ..Offer::default() }
}

fn of_machine(document: &Document, place: &Place, typed: &str) -> Vec<Offer> {
    let path: Vec<&str> = place.path.iter().map(String::as_str).collect();
    if let (Part::Value, [_, _, "settings" | "limits", key]) = (place.part, path.as_slice()) {
        let Some((device, at, _)) = object(document, place, key) else { return Vec::new() };
        let entry = device.entry(at.index(), at.sub());
        let unit = entry.and_then(|entry| DeviceValues::new(device).unit(entry));
        let number = typed.split_whitespace().next().unwrap_or("1");
        let names = entry.into_iter().flat_map(|entry| choices(device, entry));
        return names.chain(unit.map(|unit| format!("{number} {}", unit.symbol))).map(|text| word(text, "")).collect();
    }
    if let Some((device, rest)) = device_of(document, place, typed) {
        let before = typed.strip_suffix(rest).unwrap_or_default();
        let offer = |offer: Offer| Offer { text: format!("{before}{}", offer.text), ..offer };
        return device.entries().map(|entry| offer(of_entry(device, entry))).collect();
    }
    let known = keys::known(place);
    if !known.is_empty() {
        return known.into_iter().map(|(text, said)| Offer { documentation: said, ..word(text, "") }).collect();
    }
    let nodes = document.machine.iter().flat_map(Machine::buses).flat_map(|machine| &machine.nodes);
    let names = |end: &str| nodes.map(|node| word(format!("{}{end}", *node.name), "")).collect::<Vec<_>>();
    match (place.part, path.as_slice()) {
        (Part::Key, ["wire"]) | (Part::Value, ["wire", ..] | ["bench", ..]) => {
            [names("."), vec![word("manager", "")]].concat()
        }
        (Part::Header | Part::Key, ["simulate"]) | (Part::Value, ["fault", "from"]) => names(""),
        _ => Vec::new(),
    }
}
