//! Table 28, the overview of objects, with its remarks.

use lexican_eds::model::Direction;
use siko_ag03_1::parameter::PARAMETERS;

use super::sheet::Sheet;
use crate::checker::{Against, Checker};
use crate::manual::{Manual, Row};

/// The row of an object.
pub(super) fn check(checker: &mut Checker<'_>, manual: &Manual, sheet: &Sheet, index: u16, name: &str) {
    let key = format!("{index:04X}");
    let Some(row) = checker.row("overview.csv", &key) else { return };
    let printed = manual.row("names.csv", &key).map_or("", |named| named.get("printed"));
    let agrees = [name, printed].into_iter().any(|name| row.get("name").eq_ignore_ascii_case(name));
    checker.that(row, "name", Against::Sheet, agrees, name);
    note(checker, manual, sheet, row, index);
    let served = sheet.handles.keys().any(|address| address.index() == index);
    checker.that(row, "index", Against::Code, served, "no handle");
}

/// A remark: parameters that the object holds, a chapter that is about it, or what kind of object it is.
fn note(checker: &mut Checker<'_>, manual: &Manual, sheet: &Sheet, row: &Row, index: u16) {
    let note = row.get("note");
    let object = sheet.device.object(index);
    let mut numbers: Vec<_> = PARAMETERS.iter().filter(|parameter| parameter.address.index() == index).collect();
    numbers.sort_by_key(|parameter| parameter.number);
    let numbers: Vec<_> = numbers.iter().map(|parameter| parameter.number.to_string()).collect();
    if let Some(printed) = note.strip_prefix("parameter") {
        let (printed, chapter) = printed.split_once("; ").unwrap_or((printed, ""));
        let expected = format!("{}{}", if numbers.len() > 1 { "s " } else { " " }, numbers.join("/"));
        checker.that(row, "note", Against::Code, printed == expected, format!("parameter{expected}"));
        checker.that(row, "note", Against::Manual, chapter == calibration(manual, index), "another chapter");
        return;
    }
    let faults = object.map_or(0, |object| object.entries.iter().filter(|entry| entry.sub > 0).count());
    let is_unused = |pdo: &lexican_eds::model::Pdo| {
        let base = if pdo.direction == Direction::Receive { 0x1600 } else { 0x1A00 };
        base + pdo.number - 1 == index || base - 0x200 + pdo.number - 1 == index
    };
    let unused = sheet.device.pdos.iter().any(|pdo| is_unused(pdo) && pdo.mapping.is_empty());
    let writable = object.is_some_and(|object| object.entries.iter().any(|entry| entry.access.writable()));
    let (found, against) = match index {
        0x1003 => (format!("up to {faults} messages"), Against::Sheet),
        0x2101 if !writable => ("it is read-only".into(), Against::Sheet),
        _ if unused => ("compatibility entry".into(), Against::Sheet),
        _ => (described_in(manual, index), Against::Manual),
    };
    checker.cell(row, "note", against, found);
}

/// The chapter that the manual refers to for an object, from the tables that are about what the object holds.
fn described_in(manual: &Manual, index: u16) -> String {
    let of = |file: &str, key: &str| manual.row(file, key).map_or("", |row| row.get("chapter"));
    let layout = |pdo: &str| of("pdo_layouts.csv", &format!("{pdo}:1"));
    match index {
        0x1002 => of("system_status.csv", "0:0"),
        0x100C | 0x100D => of("facts.csv", "7.2.11:first toggle bit"),
        0x1011 => calibration(manual, index),
        0x1017 => of("facts.csv", "7.2.10:heartbeat identifier plus node-ID"),
        0x1600 => layout("RPDO1"),
        0x1602 => layout("RPDO3"),
        0x1603 => layout("RPDO4"),
        0x1A00 => layout("TPDO1"),
        0x1A02 => layout("TPDO3"),
        0x1A03 => layout("TPDO4"),
        // Ten parameters at once.
        0x2410 => of("parameters.csv", "1"),
        _ => "",
    }
    .to_owned()
}

/// Chapter 3 is about the objects that calibrate.
fn calibration(manual: &Manual, index: u16) -> &str {
    match index {
        0x1011 | 0x607C => manual.row("facts.csv", "3:calibration by").map_or("", |row| row.get("chapter")),
        _ => "",
    }
}
