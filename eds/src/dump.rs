//! A device as CSV, Markdown or JSON, to compare with a manual.

use std::borrow::Cow;
use std::fmt::Write as _;

use serde_json::{Value as Json, json};

use crate::model::{Device, Entry, Object, Parameter, Value};

/// The columns of [`csv`] and [`md`].
pub const COLUMNS: [&str; 12] = [
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
    "configured",
    "obj_flags",
];

/// One row for each entry; the first line names the [`COLUMNS`]. Index and sub-index have 4 and 2 hexadecimal digits,
/// data types their names in CiA 301, `pdo_mapping` is 0 or 1, numbers are decimal, COB-IDs as `$NODEID+0x180`;
/// `obj_flags` are those of the object.
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

/// The same as a Markdown table, where entries of arrays and records also show the name of their object. Tables of the
/// device as a whole and of the parameters of each other interface follow.
#[must_use]
pub fn md(device: &Device) -> String {
    let mut out = format!("| {} |\n|{}\n", COLUMNS.join(" | "), " --- |".repeat(COLUMNS.len()));
    let entries = device.objects.iter().flat_map(|object| object.entries.iter().map(move |entry| (object, entry)));
    for (object, entry) in entries {
        let mut row = row(object, entry);
        if object.kind.has_subs() {
            row[2] = format!("{}: {}", object.name, entry.name);
        }
        let cells = row.map(|text| cell(&text));
        let _ = writeln!(out, "| {} |", cells.join(" | "));
    }
    out += "\n| key | value |\n| --- | --- |\n";
    for (key, value) in device_facts(device) {
        let _ = writeln!(out, "| {key} | {} |", cell(&value));
    }
    for (name, interface) in &device.interfaces {
        let _ = write!(out, "\n| {name} | object | name | data_type | access |\n|{}\n", " --- |".repeat(5));
        for parameter in &interface.parameters {
            let (number, name) = (cell(&parameter.number.to_string()), cell(&parameter.entry.name));
            let (object, access) = (object_text(parameter), parameter.entry.access.name());
            let _ = writeln!(out, "| {number} | {object} | {name} | {} | {access} |", parameter.data_type);
        }
    }
    out
}

/// `607D:02`; empty for a parameter without object.
fn object_text(parameter: &Parameter) -> String {
    parameter.object().map(|(index, sub)| format!("{index:04X}:{sub:02X}")).unwrap_or_default()
}

/// The keys of `[DeviceInfo]` and `[DeviceComissioning]` that have a value.
fn device_facts(device: &Device) -> Vec<(&'static str, String)> {
    let info = &device.info;
    let number = |number: Option<u32>| number.map(|number| format!("0x{number:X}"));
    let flag = |flag: bool| flag.then(|| "1".to_owned());
    let some = |number: Option<u16>| number.map(|number| number.to_string());
    let bit_rates: Vec<String> = info.bit_rates_kbit.iter().map(u16::to_string).collect();
    let mut facts = vec![
        ("VendorName", info.vendor_name.clone()),
        ("VendorNumber", number(info.vendor_number)),
        ("ProductName", info.product_name.clone()),
        ("ProductNumber", number(info.product_number)),
        ("RevisionNumber", number(info.revision_number)),
        ("OrderCode", info.order_code.clone()),
        ("BaudRate", Some(bit_rates.join(", "))),
        ("SimpleBootUpMaster", flag(info.simple_boot_up_master)),
        ("SimpleBootUpSlave", flag(info.simple_boot_up_slave)),
        ("Granularity", some(info.granularity.map(u16::from))),
        ("DynamicChannelsSupported", flag(info.dynamic_channels)),
        ("GroupMessaging", flag(info.group_messaging)),
        ("NrOfRXPDO", some(info.receive_pdos)),
        ("NrOfTXPDO", some(info.transmit_pdos)),
        ("LSS_Supported", flag(info.lss)),
        ("CompactPDO", number(Some(info.compact_pdo).filter(|&bits| bits != 0))),
        ("CANopenSafetySupported", flag(info.safety)),
    ];
    facts.extend(info.reserved.iter().map(|(key, value)| (*key, Some(value.clone()))));
    if let Some(commissioning) = &device.commissioning {
        facts.extend([
            ("NodeID", some(commissioning.node_id.map(u16::from))),
            ("NodeName", commissioning.node_name.clone()),
            ("NodeRefd", commissioning.node_designator.clone()),
            ("Baudrate", some(commissioning.bit_rate_kbit)),
            ("NetNumber", commissioning.net_number.map(|number| number.to_string())),
            ("NetworkName", commissioning.network_name.clone()),
            ("NetRefd", commissioning.network_designator.clone()),
            ("CANopenManager", commissioning.manager.and_then(flag)),
            ("LSS_SerialNumber", number(commissioning.serial_number)),
        ]);
    }
    facts.into_iter().filter_map(|(key, value)| Some((key, value?))).collect()
}

fn cell(text: &str) -> String {
    text.replace('\\', "\\\\").replace('|', "\\|").replace(char::is_control, " ")
}

/// The device with its objects, PDOs and what the overlay adds. Indices are texts of 4 hexadecimal digits; numbers
/// beyond what JSON can hold are texts.
#[must_use]
pub fn json(device: &Device) -> Json {
    json!({
        "vendor_name": device.info.vendor_name,
        "vendor_number": device.info.vendor_number,
        "product_name": device.info.product_name,
        "product_number": device.info.product_number,
        "revision_number": device.info.revision_number,
        "order_code": device.info.order_code,
        "bit_rates_kbit": device.info.bit_rates_kbit,
        "simple_boot_up_master": device.info.simple_boot_up_master,
        "simple_boot_up_slave": device.info.simple_boot_up_slave,
        "granularity": device.info.granularity,
        "dynamic_channels": device.info.dynamic_channels,
        "group_messaging": device.info.group_messaging,
        "receive_pdos": device.info.receive_pdos,
        "transmit_pdos": device.info.transmit_pdos,
        "lss": device.info.lss,
        "commissioning": device.commissioning.as_ref().map(|commissioning| json!({
            "node_id": commissioning.node_id,
            "node_name": commissioning.node_name,
            "node_designator": commissioning.node_designator,
            "bit_rate_kbit": commissioning.bit_rate_kbit,
            "net_number": commissioning.net_number,
            "network_name": commissioning.network_name,
            "network_designator": commissioning.network_designator,
            "manager": commissioning.manager,
            "serial_number": commissioning.serial_number,
        })),
        "profile": device.profile,
        "sdo_writes_four_bytes": device.sdo_writes_four_bytes,
        "objects": device.objects.iter().map(object_json).collect::<Vec<_>>(),
        "interfaces": device.interfaces.iter().map(|(name, interface)| json!({
            "name": name,
            "description": interface.description,
            "parameters": interface.parameters.iter().map(parameter_json).collect::<Vec<_>>(),
        })).collect::<Vec<_>>(),
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

/// The columns of an entry that are not empty, with their names.
pub fn facts(object: &Object, entry: &Entry) -> impl Iterator<Item = (&'static str, String)> {
    COLUMNS.into_iter().zip(row(object, entry)).filter(|(_, text)| !text.is_empty())
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
        text(&entry.configured),
        object.flags.to_string(),
    ]
}

fn object_json(object: &Object) -> Json {
    json!({
        "index": format!("{:04X}", object.index),
        "name": object.name,
        "object_type": object.kind.name(),
        "flags": object.flags,
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
        "designator": entry.designator,
        "description": entry.description,
        "quantity": quantity,
        "enumeration": enumeration,
        "bit_field": bit_field,
        "first_character_high": entry.first_character_high,
        "persistent": entry.persistent,
    })
}

fn parameter_json(parameter: &Parameter) -> Json {
    json!({
        "number": parameter.number.to_string(),
        "object": parameter.object().map(|_| object_text(parameter)),
        "elements": parameter.elements,
        "name": parameter.entry.name,
        "data_type": parameter.data_type.to_string(),
        "access": parameter.entry.access.name(),
        "low_limit": parameter.entry.low.as_ref().map(value_json),
        "high_limit": parameter.entry.high.as_ref().map(value_json),
        "values": parameter.values.iter().map(|value| json!({
            "number": value_json(&Value::Integer(value.value)),
            "name": value.name,
        })).collect::<Vec<_>>(),
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
