//! `lexican eds dump`: the object dictionary as a table.

use std::io::Write;

use lexican_eds::model::{Condition, Device, Entry, Meaning, Object, Value};
use serde_json::{Value as Json, json};

use crate::device::DeviceArgs;
use crate::output::{Failure, Outcome};

/// Prints the object dictionary of a data sheet
///
/// One row per entry that an SDO can address; the headers of arrays and records are no rows. Exit code 1
/// when the data sheet has errors: what could be read of it is printed all the same.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    #[command(flatten)]
    device: DeviceArgs,

    /// How to print it
    #[arg(long, value_enum, default_value_t = Format::Csv)]
    format: Format,
}

#[derive(clap::ValueEnum, Clone, Copy, Debug)]
enum Format {
    /// Comma-separated values, with a header
    Csv,
    /// JSON, with everything that the overlay knows
    Json,
    /// A Markdown table, for people
    Md,
}

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    let loaded = args.device.load()?;
    let text = match args.format {
        Format::Csv => csv(&loaded.device),
        Format::Json => format!("{:#}\n", json(&loaded.device)),
        Format::Md => markdown(&loaded.device),
    };
    let mut stdout = std::io::stdout().lock();
    stdout.write_all(text.as_bytes())?;
    stdout.flush()?;
    Ok(if loaded.show_errors() { Outcome::Found } else { Outcome::Clean })
}

const COLUMNS: [&str; 10] = [
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

fn csv(device: &Device) -> String {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let rows = device.objects.iter().flat_map(|object| object.entries.iter().map(|entry| row(object, entry)));
    let written =
        writer.write_record(COLUMNS).and_then(|()| rows.into_iter().try_for_each(|row| writer.write_record(row)));
    written.expect("every row has as many columns as the header, and memory does not fail");
    let bytes = writer.into_inner().expect("memory does not fail");
    String::from_utf8(bytes).expect("only texts were written")
}

fn row(object: &Object, entry: &Entry) -> [String; 10] {
    [
        format!("{:04X}", entry.index),
        format!("{:02X}", entry.sub),
        entry.name.clone(),
        object.kind.name().to_owned(),
        entry.data_type.to_string(),
        entry.access.name().to_owned(),
        if entry.pdo_mapping { "yes" } else { "no" }.to_owned(),
        entry.default.as_ref().map(text).unwrap_or_default(),
        entry.low.as_ref().map(text).unwrap_or_default(),
        entry.high.as_ref().map(text).unwrap_or_default(),
    ]
}

/// A value as the data sheet could have it, numbers in decimal.
fn text(value: &Value) -> String {
    match value {
        Value::Integer(number) => number.to_string(),
        Value::Real(number) => number.to_string(),
        Value::Text(text) => text.clone(),
        Value::Bytes(bytes) => bytes.iter().map(|byte| format!("{byte:02X}")).collect(),
        Value::NodeIdPlus(0) => "$NODEID".to_owned(),
        Value::NodeIdPlus(offset) if *offset < 0 => format!("$NODEID-0x{:X}", -offset),
        Value::NodeIdPlus(offset) => format!("$NODEID+0x{offset:X}"),
    }
}

fn json(device: &Device) -> Json {
    let objects: Vec<_> = device
        .objects
        .iter()
        .map(|object| {
            json!({
                "index": format!("{:04X}", object.index),
                "name": object.name,
                "object_type": object.kind.name(),
                "description": object.description,
                "entries": object.entries.iter().map(|entry| json_entry(device, entry)).collect::<Vec<_>>(),
            })
        })
        .collect();
    json!({
        "vendor_name": device.info.vendor_name,
        "vendor_number": device.info.vendor_number,
        "product_name": device.info.product_name,
        "product_number": device.info.product_number,
        "revision_number": device.info.revision_number,
        "bit_rates_kbit": device.info.bit_rates_kbit,
        "objects": objects,
    })
}

fn json_entry(device: &Device, entry: &Entry) -> Json {
    json!({
        "index": format!("{:04X}", entry.index),
        "subindex": format!("{:02X}", entry.sub),
        "name": entry.name,
        "data_type": entry.data_type.to_string(),
        "access": entry.access.name(),
        "pdo_mapping": entry.pdo_mapping,
        "default": entry.default.as_ref().map(json_value),
        "low_limit": entry.low.as_ref().map(json_value),
        "high_limit": entry.high.as_ref().map(json_value),
        "configured": entry.configured.as_ref().map(json_value),
        "meaning": json_meaning(device, &entry.meaning),
        "ranges": entry.ranges.iter().map(|range| json!({
            "when": condition(&range.when), "low": json_integer(range.low), "high": json_integer(range.high),
        })).collect::<Vec<_>>(),
        "persistent": entry.persistent,
        "description": entry.description,
    })
}

fn json_value(value: &Value) -> Json {
    match value {
        Value::Integer(number) => json_integer(*number),
        Value::Real(number) => json!(number),
        other => Json::String(text(other)),
    }
}

/// A number where JSON has it, else its digits.
fn json_integer(number: i128) -> Json {
    i64::try_from(number)
        .map(Json::from)
        .or_else(|_| u64::try_from(number).map(Json::from))
        .unwrap_or_else(|_| Json::String(number.to_string()))
}

fn json_meaning(device: &Device, meaning: &Meaning) -> Json {
    match meaning {
        Meaning::Plain => Json::Null,
        Meaning::Quantity(name) => {
            let units = device.quantities.get(name).map(|quantity| quantity.units.as_slice()).unwrap_or_default();
            let units: Vec<_> = units
                .iter()
                .map(|unit| {
                    let when = unit.when.as_ref().map(condition);
                    json!({ "symbol": unit.symbol, "num": unit.num, "den": unit.den, "when": when })
                })
                .collect();
            json!({ "quantity": name, "units": units })
        }
        Meaning::Enumeration(name) => {
            let values = device.enumerations.get(name).map(|it| it.values.as_slice()).unwrap_or_default();
            let values: Vec<_> =
                values.iter().map(|it| json!({ "value": json_integer(it.value), "name": it.name })).collect();
            json!({ "enumeration": name, "values": values })
        }
        Meaning::BitField(name) => {
            let fields = device.bit_fields.get(name).map(|it| it.fields.as_slice()).unwrap_or_default();
            let fields: Vec<_> = fields
                .iter()
                .map(|it| json!({ "low": it.value.low, "high": it.value.high, "name": it.name }))
                .collect();
            json!({ "bit_field": name, "fields": fields })
        }
    }
}

fn condition(when: &Condition) -> String {
    let operator = if when.equal { "==" } else { "!=" };
    format!("{:04X}:{:02X} {operator} {}", when.index, when.sub, when.value)
}

fn markdown(device: &Device) -> String {
    let info = &device.info;
    let mut out = String::new();
    let title = [info.vendor_name.as_deref(), info.product_name.as_deref()].into_iter().flatten();
    out += &format!("# {}\n", escaped(&title.collect::<Vec<_>>().join(" ")));
    for object in &device.objects {
        out += &format!("\n## {:04X} {} ({})\n\n", object.index, escaped(&object.name), object.kind.name());
        if let Some(description) = &object.description {
            out += &format!("{}\n\n", escaped(description));
        }
        out += "| Sub | Name | Type | Access | PDO | Default | Limits | Meaning |\n";
        out += "|----:|------|------|--------|-----|---------|--------|---------|\n";
        for entry in &object.entries {
            out += &markdown_row(device, entry);
        }
    }
    out
}

fn markdown_row(device: &Device, entry: &Entry) -> String {
    let limits = match (&entry.low, &entry.high) {
        (None, None) => String::new(),
        (low, high) => {
            let side = |value: &Option<Value>| value.as_ref().map(text).unwrap_or_default();
            format!("{} … {}", side(low), side(high))
        }
    };
    format!(
        "| {:02X} | {} | {} | {} | {} | {} | {limits} | {} |\n",
        entry.sub,
        escaped(&entry.name),
        entry.data_type,
        entry.access.name(),
        if entry.pdo_mapping { "yes" } else { "" },
        escaped(&entry.default.as_ref().map(text).unwrap_or_default()),
        escaped(&meaning(device, entry)),
    )
}

fn meaning(device: &Device, entry: &Entry) -> String {
    match &entry.meaning {
        Meaning::Plain => String::new(),
        Meaning::Quantity(name) => {
            let units = device.quantities.get(name).map(|quantity| quantity.units.as_slice()).unwrap_or_default();
            let one = |unit: &lexican_eds::model::Unit| {
                let scale = if unit.den == 1 { unit.num.to_string() } else { format!("{}/{}", unit.num, unit.den) };
                let scale = if scale == "1" { String::new() } else { scale + " " };
                let when = unit.when.as_ref().map(|when| format!(" when {}", condition(when))).unwrap_or_default();
                format!("{scale}{}{when}", unit.symbol)
            };
            units.iter().map(one).collect::<Vec<_>>().join("; ")
        }
        Meaning::Enumeration(name) => {
            let values = device.enumerations.get(name).map(|it| it.values.as_slice()).unwrap_or_default();
            values.iter().map(|it| format!("{} = {}", it.value, it.name)).collect::<Vec<_>>().join("; ")
        }
        Meaning::BitField(name) => {
            let fields = device.bit_fields.get(name).map(|it| it.fields.as_slice()).unwrap_or_default();
            let one = |it: &lexican_eds::model::Named<lexican_eds::model::Bits>| match (it.value.low, it.value.high) {
                (low, high) if low == high => format!("bit {low}: {}", it.name),
                (low, high) => format!("bits {low} to {high}: {}", it.name),
            };
            fields.iter().map(one).collect::<Vec<_>>().join("; ")
        }
    }
}

/// Text that is no markup in a table of Markdown.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '|' | '\\' | '`' | '*' | '_' | '<' | '>' | '[' | ']' | '#' => out.extend(['\\', letter]),
            '\n' | '\r' => out.push(' '),
            letter => out.push(letter),
        }
    }
    out
}
