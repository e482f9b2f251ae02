//! The data sheet and its overlay against the tables that describe objects.

use lexican_eds::model::{Device, Entry, Meaning, Object, ObjectKind, Quantity, Value};
use lexican_eds::types::{Class, DataType};

use super::tables::rows;
use crate::manual::{Judge, Row};
use crate::protocol::number;

pub fn judge(device: &Device, judge: &mut Judge) {
    objects(device, judge);
    descriptions(device, judge);
    sections(device, judge);
    pdo_mappings(device, judge);
}

/// The dictionary of 7.1.
fn objects(device: &Device, judge: &mut Judge) {
    let table = rows("objects");
    for row in &table {
        let (object, entry) = find(device, row);
        let Some(entry) = entry else {
            judge.that(row, "object_code", row.get("object_code") == object.kind.name(), object.kind.name());
            continue;
        };
        judge.that(row, "data_type", data_type(row.get("data_type")) == Some(entry.data_type), entry.data_type);
        access(judge, row, entry);
        let mapping = if entry.pdo_mapping { "yes" } else { "no" };
        judge.that(row, "pdo_mapping", row.get("pdo_mapping") == mapping, mapping);
        let scale = quantity(device, entry).map_or((1, 1), |quantity| (quantity.units[0].num, quantity.units[0].den));
        let agrees = (row.get("float_scaling") == "1000:1") == (scale == (1, 1000));
        judge.that(row, "float_scaling", agrees, format!("{scale:?}"));
        let description = entry.description.as_ref().or(object.description.as_ref()).map_or("", String::as_str);
        let mut ascii = row.get("ascii").split([' ', ',']).filter(|word| word.contains('.'));
        judge.that(row, "ascii", ascii.all(|parameter| description.contains(parameter)), description);
    }
    // Chapter 6 describes 2026h; the sub-index 0 of the masks is in neither place, but CiA 301 demands it.
    let lacking: Vec<String> = device
        .objects
        .iter()
        .flat_map(|object| object.entries.iter())
        .map(|entry| format!("{:04X}:{:02X}", entry.index, entry.sub))
        .filter(|address| table.iter().all(|row| row.key != *address))
        .collect();
    let masks = ["2014:00", "2015:00", "2016:00", "2017:00"];
    assert_eq!(lacking, [&masks[..], &["2026:00", "2026:01", "2026:02"]].concat());
    assert_eq!((device.objects.len(), device.entries().count()), (230, 483));
    for row in rows("names") {
        let (object, entry) = find(device, &row);
        let name = entry.map_or(&object.name, |entry| &entry.name);
        judge.that(&row, "data_sheet", row.get("data_sheet") == name, name);
    }
}

/// The descriptions of chapter 6.
fn descriptions(device: &Device, judge: &mut Judge) {
    for row in rows("descriptions") {
        let (object, entry) = find(device, &row);
        if !row.get("object_code").is_empty() {
            let kind = entry.map_or(object.kind, |_| ObjectKind::Variable);
            judge.that(&row, "object_code", row.get("object_code") == kind.name(), kind.name());
        }
        if let Some(expected) = data_type(row.get("data_type")) {
            let of: Vec<DataType> = match entry {
                Some(entry) => vec![entry.data_type],
                None => object.entries.iter().filter(|entry| entry.sub > 0).map(|entry| entry.data_type).collect(),
            };
            judge.that(&row, "data_type", of.iter().all(|found| *found == expected), format!("{of:?}"));
        }
        let Some(entry) = entry else { continue };
        access(judge, &row, entry);
        let mappable = row.get("pdo_mapping") == "possible";
        judge.that(&row, "pdo_mapping", mappable == entry.pdo_mapping, entry.pdo_mapping);
        range(device, judge, &row, entry);
        default(judge, &row, entry);
        unit(device, judge, &row, entry);
        let persistent = if entry.persistent { "yes" } else { "no" };
        judge.that(
            &row,
            "eeprom",
            matches!(row.get("eeprom"), eeprom if eeprom.is_empty() || eeprom == persistent),
            persistent,
        );
    }
}

fn access(judge: &mut Judge, row: &Row, entry: &Entry) {
    let expected = match row.get("access") {
        "RO" | "R/O" | "r" => "ro",
        "RW" | "R/W" => "rw",
        "WO" | "W" => "wo",
        word => word,
    };
    judge.that(row, "access", expected == entry.access.name(), entry.access.name());
}

fn range(device: &Device, judge: &mut Judge, row: &Row, entry: &Entry) {
    let text = row.get("range");
    let limits = entry.low.as_ref().and_then(Value::as_integer).zip(entry.high.as_ref().and_then(Value::as_integer));
    let agrees = if text.is_empty() {
        limits.is_none()
    } else if let Some(data_type) = data_type(text) {
        limits.is_none() && data_type == entry.data_type
    } else if let Some((low, high)) = text.split_once("..") {
        limits.is_some() && limits == number(low).zip(number(high))
    } else if let Meaning::Enumeration(name) = &entry.meaning {
        let values: Vec<i128> = text.split("; ").filter_map(number).collect();
        let named: Vec<i128> = device.enumerations[name].values.iter().map(|named| named.value).collect();
        let outside = |(low, high): (i128, i128)| (Some(&low), Some(&high)) != (values.first(), values.last());
        values == named && !limits.is_some_and(outside)
    } else {
        // One number: what the entry always holds.
        number(text).is_some() && number(text) == entry.default.as_ref().and_then(Value::as_integer)
    };
    judge.that(row, "range", agrees, format!("{} {limits:?}", entry.data_type));
}

fn default(judge: &mut Judge, row: &Row, entry: &Entry) {
    let expected = match row.get("default") {
        "" => return,
        "no" => None,
        text => match text.strip_suffix("h + Node-ID") {
            Some(base) => Some(Value::NodeIdPlus(i64::from_str_radix(base, 16).unwrap())),
            // Words, such as an eighth of another entry, are no default.
            None => number(text).map(Value::Integer),
        },
    };
    judge.that(row, "default", entry.default == expected, format!("{:?}", entry.default));
}

fn unit(device: &Device, judge: &mut Judge, row: &Row, entry: &Entry) {
    let expected = match row.get("unit") {
        "" => return,
        "ms" => ("milliseconds", 1),
        "1/10 ms" => ("milliseconds", 10),
        "ns" => ("nanoseconds", 1),
        "position units" | "user-defined" => ("position_units", 1),
        "speed units" | "velocity units" => ("velocity_units", 1),
        "acceleration units" | "deceleration units" => ("acceleration_units", 1),
        unit if unit.starts_with("increments") => ("increments", 1),
        unit => (unit, 1),
    };
    let found = quantity(device, entry).map(|quantity| (quantity.units[0].method.as_str(), quantity.units[0].den));
    judge.that(row, "unit", found == Some(expected), format!("{found:?}"));
}

/// The lists of objects in the sections of chapter 6.
fn sections(device: &Device, judge: &mut Judge) {
    for row in rows("sections") {
        let index = u16::from_str_radix(row.get("index"), 16).unwrap();
        let object = device.object(index).unwrap();
        judge.that(&row, "object_code", row.get("object_code") == object.kind.name(), object.kind.name());
        // A record has no data type and no access of its own.
        let entries = object.entries.iter().filter(|entry| entry.sub > 0 || !object.kind.has_subs());
        for entry in entries.filter(|_| object.kind != ObjectKind::Record) {
            let expected = data_type(row.get("data_type"));
            judge.that(&row, "data_type", expected == Some(entry.data_type), entry.data_type);
            if !row.get("access").is_empty() {
                access(judge, &row, entry);
            }
        }
    }
}

/// The default mappings of 6.3.
fn pdo_mappings(device: &Device, judge: &mut Judge) {
    let table = rows("pdo_mappings");
    for row in &table {
        let index = u16::from_str_radix(row.get("index"), 16).unwrap();
        let position: u8 = row.get("position").parse().unwrap();
        let word = device.entry(index, position).unwrap().default.as_ref().and_then(Value::as_integer).unwrap();
        let object = format!("{:04X}:{:02X}", word >> 16, word >> 8 & 0xFF);
        judge.that(row, "object", row.get("object") == object, object);
        judge.that(row, "bits", row.get("bits") == (word & 0xFF).to_string(), word & 0xFF);
        let pdo = format!("{}{}", if index < 0x1800 { "RPDO" } else { "TPDO" }, index % 16 + 1);
        judge.that(row, "pdo", row.get("pdo") == pdo, pdo);
    }
    let mapped: usize = device.pdos.iter().map(|pdo| pdo.mapping.len()).sum();
    assert_eq!((device.pdos.len(), mapped), (8, table.len()));
}

/// The object and, unless the row is about an ARRAY or RECORD itself, the entry that a row is about.
fn find<'d>(device: &'d Device, row: &Row) -> (&'d Object, Option<&'d Entry>) {
    let (index, sub) = row.address();
    let object = device.object(index).unwrap_or_else(|| panic!("{index:04X} is not in the data sheet"));
    let entry = sub.map(|sub| object.entry(sub).unwrap_or_else(|| panic!("no {index:04X}:{sub:02X}")));
    (object, entry)
}

fn quantity<'d>(device: &'d Device, entry: &Entry) -> Option<&'d Quantity> {
    match &entry.meaning {
        Meaning::Quantity(name) => Some(&device.quantities[name]),
        _ => None,
    }
}

/// The data type that a cell names, in the words of chapter 6 or of 7.1.
fn data_type(cell: &str) -> Option<DataType> {
    let long = match cell {
        "U8" => "UNSIGNED8",
        "U16" => "UNSIGNED16",
        "U32" => "UNSIGNED32",
        "U64" => "UNSIGNED64",
        "INT8" => "INTEGER8",
        "INT16" => "INTEGER16",
        "INT32" => "INTEGER32",
        "VisStr" => "VISIBLE_STRING",
        other => other,
    };
    let found = DataType::ALL.iter().find(|data_type| data_type.name() == long);
    found.copied().filter(|data_type| data_type.class() != Class::Boolean)
}
