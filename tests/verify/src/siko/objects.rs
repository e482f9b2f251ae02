//! Names, chapters, remarks and units of the objects: `objects.csv` beyond what any manual has, `names.csv`, table 28.

use lexican_eds::model::{Direction, Entry, Unit};

use super::rig::Siko;
use crate::checker::{Against, Checker};
use crate::drive::Case;
use crate::kinds::pdo::mapping_index;
use crate::manual::{Manual, Row};
use crate::sheet::address;

pub(crate) fn check<D: Siko>(checker: &mut Checker<'_>, case: &Case<'_>) {
    chapters(checker, case, D::CHAPTERS[1]);
    for object in &case.sheet.device.objects {
        let index = format!("{:04X}", object.index);
        overview::<D>(checker, case, object.index, &object.name);
        name(checker, case, &index, &object.name, &format!("{index}:00"), "object");
        for entry in &object.entries {
            let key = format!("{index}:{:02X}", entry.sub);
            // An object without sub-indices has one name for itself and for its value.
            let named = if object.kind.has_subs() { &entry.name } else { &object.name };
            name(checker, case, &key, named, &key, "description");
            if let Some(row) = case.manual.row("objects.csv", &key) {
                described::<D>(checker, case, row, entry, &object.name);
            }
        }
    }
}

/// Compares chapters `.12.2.N`, which describe the objects in the order of their indices.
fn chapters(checker: &mut Checker<'_>, case: &Case<'_>, network: &str) {
    let subjects = [
        ("objects.csv", "index"),
        ("names.csv", "index"),
        ("formats.csv", "address"),
        ("pdo_mappings.csv", "index"),
        ("transmission_types.csv", "index"),
    ];
    for (file, column) in subjects {
        for row in case.manual.rows(file) {
            let index = row.get(column).split(':').next().unwrap_or_default();
            let at = case.sheet.device.objects.iter().position(|object| format!("{:04X}", object.index) == index);
            let chapter = match index {
                "14xx" => format!("{network}.2.6.4"),
                "18xx" => format!("{network}.2.5.4"),
                _ => format!("{network}.12.2.{}", at.map_or(0, |at| at + 1)),
            };
            checker.cell(row, "chapter", Against::Sheet, chapter);
        }
    }
}

/// Compares the name of something in the manual with that in the data sheet.
fn name(checker: &mut Checker<'_>, case: &Case<'_>, key: &str, name: &str, described: &str, column: &str) {
    let Some(row) = checker.row("names.csv", key) else { return };
    checker.cell(row, "data_sheet", Against::Sheet, name);
    checker.cell(row, "printed", Against::Manual, case.manual.cell("objects.csv", described, column));
}

fn described<D: Siko>(checker: &mut Checker<'_>, case: &Case<'_>, row: &Row, entry: &Entry, name: &str) {
    use Against::Sheet as S;
    // If the data sheet has another name, `names.csv` has both, and the latter is compared there.
    let (printed, index) = (row.get("object"), format!("{:04X}", entry.index));
    let named = case.manual.row("names.csv", &index);
    let translated = named.is_some_and(|row| row.get("printed") == printed && row.get("data_sheet") == name);
    let differs = case.manual.cell("overview.csv", &index, "name") == name;
    checker.that(row, "object", S, printed.eq_ignore_ascii_case(name) || translated && !differs, name);
    let described = case.manual.cell("names.csv", &row.key, "printed");
    checker.cell(row, "description", Against::Manual, described);
    let object = case.sheet.device.object(entry.index);
    let texts = [&entry.description, &object.and_then(|object| object.description.clone())];
    let none = texts.into_iter().flatten().any(|text| text.starts_with("Compatibility entry without function"));
    if row.has("function") {
        checker.cell(row, "function", S, if none && entry.sub != 0 { "none" } else { "" });
    }
    let parameter =
        D::MODEL.parameters.iter().find(|parameter| parameter.address == address(entry) && parameter.number != 24);
    let lasting = D::LASTING.iter().find(|(_, index)| *index == entry.index).map(|(number, _)| *number);
    let parameter = parameter.map(|parameter| parameter.number).or(lasting);
    let parameter = parameter.map_or(String::new(), |number| number.to_string());
    checker.cell(row, "parameter", Against::Code, parameter);
    let unit = match case.sheet.units(entry) {
        [unit] if (unit.symbol.as_str(), unit.num, unit.den) == ("ms", 1, 10) => "100 us".into(),
        [unit] => in_words(unit).replace('°', "deg"),
        _ => String::new(),
    };
    // Chapter 7.12.2 prints the units of measured values and times; table 6 has those of parameters.
    let elsewhere = row.get("unit").is_empty() && PRINTED_ELSEWHERE.contains(&unit.as_str());
    checker.that(row, "unit", S, row.get("unit") == unit || elsewhere, unit);
}

/// `rev/min`, `1/100 mm`.
pub(super) fn in_words(unit: &Unit) -> String {
    match (unit.num, unit.den) {
        (1, 1) => unit.symbol.clone(),
        (num, den) => format!("{num}/{den} {}", unit.symbol),
    }
}

const PRINTED_ELSEWHERE: &[&str] = &["rev/min", "%", "increments", "1/100 mm", "ms", "100 us"];

/// Compares a row of table 28: name and remark.
fn overview<D: Siko>(checker: &mut Checker<'_>, case: &Case<'_>, index: u16, name: &str) {
    let key = format!("{index:04X}");
    let Some(row) = checker.row("overview.csv", &key) else { return };
    let printed = case.manual.cell("names.csv", &key, "printed");
    let agrees = [name, printed].into_iter().any(|name| row.get("name").eq_ignore_ascii_case(name));
    checker.that(row, "name", Against::Sheet, agrees, name);
    remark::<D>(checker, case, row, index);
    let served = case.sheet.code.handles.keys().any(|address| address.index() == index);
    checker.that(row, "index", Against::Code, served, "no handle");
}

/// Compares a remark: the parameters that the object holds, a chapter about it, or the kind of the object.
fn remark<D: Siko>(checker: &mut Checker<'_>, case: &Case<'_>, row: &Row, index: u16) {
    let (note, device) = (row.get("note"), &case.sheet.device);
    if let Some(printed) = note.strip_prefix("parameter") {
        let mut numbers: Vec<_> =
            D::MODEL.parameters.iter().filter(|parameter| parameter.address.index() == index).collect();
        numbers.sort_by_key(|parameter| parameter.number);
        let numbers: Vec<_> = numbers.iter().map(|parameter| parameter.number.to_string()).collect();
        let (printed, chapter) = printed.split_once("; ").unwrap_or((printed, ""));
        let expected = format!("{}{}", if numbers.len() > 1 { "s " } else { " " }, numbers.join("/"));
        checker.that(row, "note", Against::Code, printed == expected, format!("parameter{expected}"));
        checker.that(row, "note", Against::Manual, chapter == calibration(case.manual, index), "another chapter");
        return;
    }
    let entries = device.object(index).map_or(&[][..], |object| &object.entries);
    let unused = device.pdos.iter().filter(|pdo| pdo.mapping.is_empty()).any(|pdo| {
        let (mapping, parameter) = (mapping_index(pdo), mapping_index(pdo) - 0x200);
        index == mapping || index == parameter
    });
    let (found, against) = match index {
        0x1003 => (format!("up to {} messages", entries.len() - 1), Against::Sheet),
        0x2101 if entries.iter().all(|entry| !entry.access.writable()) => ("it is read-only".into(), Against::Sheet),
        _ if unused => ("compatibility entry".into(), Against::Sheet),
        _ => (described_in::<D>(case, index), Against::Manual),
    };
    checker.cell(row, "note", against, found);
}

/// The chapter to which the manual refers for an object, from the tables about what the object holds.
fn described_in<D: Siko>(case: &Case<'_>, index: u16) -> String {
    let of = |file: &str, key: &str| {
        let row = case.manual.rows(file).iter().find(|row| super::known::<D>(&row.key) == key || row.key == key);
        row.map_or(String::new(), |row| row.get("chapter").to_owned())
    };
    let mapped = case.sheet.device.pdos.iter().find(|pdo| mapping_index(pdo) == index);
    if let Some(pdo) = mapped {
        let side = if pdo.direction == Direction::Receive { 'R' } else { 'T' };
        return of("pdo_layouts.csv", &format!("{side}PDO{}:1", pdo.number));
    }
    match index {
        0x1002 => case.manual.rows("system_status.csv").first().map_or("", |row| row.get("chapter")).into(),
        0x100C | 0x100D => of("facts.csv", "7.2.11:first toggle bit"),
        0x1011 => calibration(case.manual, index).to_owned(),
        0x1017 => of("facts.csv", "7.2.10:heartbeat identifier plus node-ID"),
        // Holds ten parameters.
        0x2410 => of("parameters.csv", "1"),
        _ => String::new(),
    }
}

/// The chapter about an object for calibration, in chapter 3.
fn calibration(manual: &Manual, index: u16) -> &str {
    match index {
        0x1011 | 0x607C => manual.cell("facts.csv", "3:calibration by", "chapter"),
        _ => "",
    }
}
