//! The entries of a device as a table: what people compare with a manual.

use std::borrow::Cow;
use std::fmt::Write as _;

use serde_json::{Value as Json, json};

use crate::model::{Device, Entry, Object, Value};

/// The columns of [`csv`] and [`md`].
pub const COLUMNS: [&str; 10] = [
    "index",
    "subindex",
    "name",
    "object_type",
    "data_type",
    "access",
    "pdo_mapping",
    "default",
    "low_limit",
    "high_limit",
];

/// One row for each entry, with [`COLUMNS`] as the first line: index and sub-index as 4 and 2 hexadecimal digits,
/// the types by their names in CiA 301, `pdo_mapping` 0 or 1, numbers in decimal, COB-IDs as `$NODEID+0x180`.
#[must_use]
pub fn csv(device: &Device) -> String {
    let mut out = COLUMNS.join(",") + "\n";
    for row in rows(device) {
        let cells: Vec<Cow<'_, str>> = row.iter().map(|cell| quoted(cell)).collect();
        out += &cells.join(",");
        out.push('\n');
    }
    out
}

/// The same as a table in Markdown, for people: entries of arrays and records with the name of their object.
#[must_use]
pub fn md(device: &Device) -> String {
    let mut out = format!("| {} |\n|{}\n", COLUMNS.join(" | "), " --- |".repeat(COLUMNS.len()));
    let entries = device.objects.iter().flat_map(|object| object.entries.iter().map(move |entry| (object, entry)));
    for (object, entry) in entries {
        let mut row = row(object, entry);
        if object.kind.has_subs() {
            row[2] = format!("{}: {}", object.name, entry.name);
        }
        let cells = row.map(|cell| cell.replace('\\', "\\\\").replace('|', "\\|").replace(char::is_control, " "));
        let _ = writeln!(out, "| {} |", cells.join(" | "));
    }
    out
}

/// The device with its objects, PDOs and what the overlay says of them. Numbers are numbers where JSON can hold
/// them; indices are texts of 4 hexadecimal digits.
#[must_use]
pub fn json(device: &Device) -> Json {
    json!({
        "vendor_name": device.info.vendor_name,
        "vendor_number": device.info.vendor_number,
        "product_name": device.info.product_name,
        "product_number": device.info.product_number,
        "revision_number": device.info.revision_number,
        "profile": device.profile,
        "objects": device.objects.iter().map(object_json).collect::<Vec<_>>(),
        "pdos": device.pdos.iter().map(|pdo| json!({
            "direction": match pdo.direction {
                crate::model::Direction::Receive => "receive",
                crate::model::Direction::Transmit => "transmit",
            },
            "number": pdo.number,
            "cob_id": pdo.cob_id.as_ref().map(value_text),
            "transmission_type": pdo.transmission_type,
            "dynamic": pdo.dynamic,
            "mapping": pdo.mapping.iter().map(|mapped| json!({
                "index": format!("{:04X}", mapped.index),
                "subindex": format!("{:02X}", mapped.sub),
                "bits": mapped.bits,
            })).collect::<Vec<_>>(),
        })).collect::<Vec<_>>(),
    })
}

/// A value as text: numbers in decimal, `$NODEID+0x180`, octets as hexadecimal digits.
#[must_use]
pub fn value_text(value: &Value) -> String {
    match value {
        Value::Integer(number) => number.to_string(),
        Value::Real(number) => number.to_string(),
        Value::Text(text) => text.clone(),
        Value::Bytes(bytes) => bytes.iter().map(|byte| format!("{byte:02X}")).collect(),
        Value::NodeIdPlus(0) => "$NODEID".to_owned(),
        Value::NodeIdPlus(offset) if *offset < 0 => format!("$NODEID+{offset}"),
        Value::NodeIdPlus(offset) => format!("$NODEID+0x{offset:X}"),
    }
}

fn rows(device: &Device) -> impl Iterator<Item = [String; COLUMNS.len()]> {
    device.objects.iter().flat_map(|object| object.entries.iter().map(move |entry| row(object, entry)))
}

fn row(object: &Object, entry: &Entry) -> [String; COLUMNS.len()] {
    let text = |value: &Option<Value>| value.as_ref().map(value_text).unwrap_or_default();
    [
        format!("{:04X}", entry.index),
        format!("{:02X}", entry.sub),
        entry.name.clone(),
        object.kind.name().to_owned(),
        entry.data_type.to_string(),
        entry.access.name().to_owned(),
        u8::from(entry.pdo_mapping).to_string(),
        text(&entry.default),
        text(&entry.low),
        text(&entry.high),
    ]
}

fn object_json(object: &Object) -> Json {
    json!({
        "index": format!("{:04X}", object.index),
        "name": object.name,
        "object_type": object.kind.name(),
        "description": object.description,
        "entries": object.entries.iter().map(entry_json).collect::<Vec<_>>(),
    })
}

fn entry_json(entry: &Entry) -> Json {
    use crate::model::Meaning;
    let (quantity, enumeration, bit_field) = match &entry.meaning {
        Meaning::Plain => (None, None, None),
        Meaning::Quantity(name) => (Some(name), None, None),
        Meaning::Enumeration(name) => (None, Some(name), None),
        Meaning::BitField(name) => (None, None, Some(name)),
    };
    json!({
        "subindex": format!("{:02X}", entry.sub),
        "name": entry.name,
        "data_type": entry.data_type.to_string(),
        "access": entry.access.name(),
        "pdo_mapping": entry.pdo_mapping,
        "default": entry.default.as_ref().map(value_json),
        "low_limit": entry.low.as_ref().map(value_json),
        "high_limit": entry.high.as_ref().map(value_json),
        "configured": entry.configured.as_ref().map(value_json),
        "denotation": entry.denotation,
        "description": entry.description,
        "quantity": quantity,
        "enumeration": enumeration,
        "bit_field": bit_field,
        "persistent": entry.persistent,
    })
}

fn value_json(value: &Value) -> Json {
    match value {
        Value::Integer(number) => i64::try_from(*number)
            .map(Json::from)
            .or_else(|_| u64::try_from(*number).map(Json::from))
            .unwrap_or_else(|_| Json::from(number.to_string())),
        Value::Real(number) => json!(number),
        other => Json::from(value_text(other)),
    }
}

/// A cell of a CSV file (RFC 4180).
fn quoted(cell: &str) -> Cow<'_, str> {
    if cell.contains(['"', ',', '\r', '\n']) {
        Cow::Owned(format!("\"{}\"", cell.replace('"', "\"\"")))
    } else {
        Cow::Borrowed(cell)
    }
}
