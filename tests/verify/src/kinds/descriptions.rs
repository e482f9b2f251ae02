//! Several tables about the same objects: a dictionary, chapters that describe some of its objects, lists of objects by
//! chapter, and names in the manual. A column that a table lacks is not compared.

use std::collections::BTreeSet;

use lexican_eds::model::{Entry, Object, ObjectKind};
use lexican_runtime::object::Address;

use super::objects::{Described, Objects, compare, drive};
use crate::checker::{Against, Checker};
use crate::drive::Case;
use crate::manual::Row;
use crate::notation::{access, data_type};
use crate::sheet::address;

/// Compares `files`, whose rows are about an entry or, without sub-index, about an ARRAY or RECORD. Each entry has a
/// row in one of them, except for `absent`: sub-indices 0 that CiA 301 asks for. An entry that is only in a dictionary
/// without defaults and ranges has neither in the data sheet.
pub(crate) fn check<S: Objects>(checker: &mut Checker<'_>, case: &Case<'_>, files: &[&'static str], absent: &[u16]) {
    for object in &case.sheet.device.objects {
        let rows = |key: &str| files.iter().filter_map(|file| case.manual.row(file, key)).collect::<Vec<_>>();
        let index = format!("{:04X}", object.index);
        for row in rows(&index) {
            checker.key(row);
            of_object(checker, row, object);
        }
        for entry in &object.entries {
            let key = format!("{index}:{:02X}", entry.sub);
            let rows = rows(&key);
            let is_absent = entry.sub == 0 && absent.contains(&object.index);
            checker.require(rows.is_empty() == is_absent, || format!("{key}: no table has it, or one has"));
            let has_unit = rows.iter().any(|row| !row.get("unit").is_empty());
            for row in &rows {
                checker.key(row);
                of_entry::<S>(checker, case, row, object, entry);
                quantity(checker, case, row, entry, has_unit);
            }
            let described = Described::written(case.sheet, entry);
            let last = object.entries.last().map(|last| i128::from(last.sub));
            // Sub-index 0 has the highest sub-index, unless it can be written.
            let follows = entry.sub == 0 && object.kind.has_subs() && described.default == last;
            let is_bare = follows || described.default.is_none();
            let is_described = rows.iter().any(|row| row.has("default"));
            checker.require(is_described || is_bare && described.limits.is_none(), || {
                format!("{key}: {described:?}, and no table has that")
            });
        }
    }
    files.iter().for_each(|file| drive::<S>(checker, case, case.manual.rows(file)));
}

/// Compares an ARRAY or RECORD: its kind, and the type that all of its elements have.
fn of_object(checker: &mut Checker<'_>, row: &Row, object: &Object) {
    kind(checker, row, object.kind);
    let elements = || object.entries.iter().filter(|entry| entry.sub > 0);
    let types: BTreeSet<&str> = elements().map(|entry| entry.data_type.name()).collect();
    let types: Vec<&str> = types.into_iter().collect();
    let printed = row.get("data_type");
    let agrees = match object.kind {
        // A record has a type with a special name.
        ObjectKind::Record => RECORDS.contains(&printed),
        _ => types == [data_type(printed).as_str()] || printed.is_empty() && !row.has("default"),
    };
    checker.that(row, "data_type", Against::Sheet, agrees, types.join(" and "));
    // The other columns are about the elements.
    for column in ["access", "pdo_mapping", "unit", "range", "default", "eeprom", "float_scaling", "ascii"] {
        if row.has(column) {
            checker.cell(row, column, Against::Sheet, "");
        }
    }
}

/// The names of record types in manuals; empty if a manual has none.
const RECORDS: &[&str] = &[
    "",
    "Identity",
    "PDO CommPar",
    "PDO Mapping",
    "Interpolation time period record (0080h)",
    "Interpolation data configuration record (0081h)",
];

/// Compares the object code, if there is one: an entry of an ARRAY or RECORD is a VAR.
fn kind(checker: &mut Checker<'_>, row: &Row, kind: ObjectKind) {
    let printed = row.get("object_code");
    let agrees = printed == kind.name() || printed.is_empty() && kind == ObjectKind::Variable;
    checker.that(row, "object_code", Against::Sheet, agrees, kind.name());
}

fn of_entry<S: Objects>(checker: &mut Checker<'_>, case: &Case<'_>, row: &Row, object: &Object, entry: &Entry) {
    use Against::Sheet as Written;
    kind(checker, row, ObjectKind::Variable);
    let described = Described::written(case.sheet, entry);
    compare::<S>(checker, row, Written, &described);
    let printed = access(row.get("access"));
    let exact = !matches!(printed, "rww" | "rwr") || printed == entry.access.name();
    checker.that(row, "access", Written, exact, entry.access.name());
    if let Some(handle) = case.sheet.handle(entry) {
        let mut generated = Described::generated(case.sheet, handle, address(entry));
        // The length of an array has neither default nor limits in the code.
        if handle.path.ends_with(".len_object") {
            (generated.default, generated.limits) = (described.default, described.limits);
        }
        compare::<S>(checker, row, Against::Code, &generated);
    }
    let served = case.sheet.code.data_type(Address::new(entry.index, entry.sub));
    checker.that(row, "data_type", Against::Code, served.is_some(), "not served");
    if row.has("ascii") {
        let description = entry.description.as_ref().or(object.description.as_ref()).map_or("", String::as_str);
        let words = |text: &str| -> BTreeSet<String> {
            let bare = |word: &str| word.trim_end_matches('.').to_ascii_uppercase();
            text.split([' ', ',', '(', ')', ';', ':']).filter(|word| !word.is_empty()).map(bare).collect()
        };
        let agrees = words(row.get("ascii")).is_subset(&words(description));
        checker.that(row, "ascii", Written, agrees, description);
    }
}

/// Compares unit and scale, if the table has them. `has_unit` says whether any table has a unit for the entry.
fn quantity(checker: &mut Checker<'_>, case: &Case<'_>, row: &Row, entry: &Entry, has_unit: bool) {
    let unit = case.sheet.units(entry).first();
    let found = unit.map(|unit| (unit.method.as_str(), unit.num, unit.den));
    if row.has("float_scaling") {
        let agrees = match row.get("float_scaling") {
            "1000:1" => matches!(found, Some((_, 1, 1000))),
            // A number without a unit counts whole units.
            "" | "1:1" | "var" => match found {
                Some((_, num, den)) => (num, den) == (1, 1) || has_unit && (num, den) != (1, 1000),
                None => true,
            },
            _ => false,
        };
        checker.that(row, "float_scaling", Against::Sheet, agrees, format!("{found:?}"));
    }
    if row.has("unit") {
        let agrees = match row.get("unit") {
            "" => found.is_none_or(|(_, num, den)| (num, den) == (1, 1)),
            printed => found.is_some() && UNITS.iter().any(|(of, unit)| *of == printed && Some(*unit) == found),
        };
        checker.that(row, "unit", Against::Sheet, agrees, format!("{found:?}"));
    }
}

/// Units as manuals print them: method, numerator and denominator.
const UNITS: &[(&str, (&str, i64, i64))] = &[
    ("ms", ("milliseconds", 1, 1)),
    ("1/10 ms", ("milliseconds", 1, 10)),
    ("ns", ("nanoseconds", 1, 1)),
    ("position units", ("position_units", 1, 1)),
    ("user-defined", ("position_units", 1, 1)),
    ("speed units", ("velocity_units", 1, 1)),
    ("velocity units", ("velocity_units", 1, 1)),
    ("acceleration units", ("acceleration_units", 1, 1)),
    ("deceleration units", ("acceleration_units", 1, 1)),
    ("increments", ("increments", 1, 1)),
    ("increments (1 turn = 2^PRBASE)", ("increments", 1, 1)),
];

/// Compares `sections.csv`: the objects that a chapter lists.
pub(crate) fn sections(checker: &mut Checker<'_>, case: &Case<'_>) {
    for row in case.manual.rows("sections.csv") {
        let index = u16::from_str_radix(row.get("index"), 16).ok();
        let Some(object) = index.and_then(|index| case.sheet.device.object(index)) else { continue };
        checker.key(row);
        kind_of(checker, row, object);
        let is_record = object.kind == ObjectKind::Record;
        for entry in object.entries.iter().filter(|entry| entry.sub > 0 || !object.kind.has_subs()) {
            let (name, right) = (entry.data_type.name(), entry.access.name());
            // A record has no data type and no access of its own.
            let same_type = if is_record { row.get("data_type").is_empty() } else { row.get("data_type") == name };
            checker.that(row, "data_type", Against::Sheet, same_type, name);
            let printed = access(row.get("access"));
            let same_access = printed.is_empty() || right.starts_with(printed) || is_record && printed == "rw";
            checker.that(row, "access", Against::Sheet, same_access, right);
        }
    }
}

fn kind_of(checker: &mut Checker<'_>, row: &Row, object: &Object) {
    checker.cell(row, "object_code", Against::Sheet, object.kind.name());
}

/// Compares `names.csv`: the name of an object or entry in the manual, and in the data sheet. The name in the manual is
/// the first one found at `places`, which are files and columns.
pub(crate) fn names(checker: &mut Checker<'_>, case: &Case<'_>, places: &[(&'static str, &'static str)]) {
    for object in &case.sheet.device.objects {
        let entries = object.entries.iter().map(|entry| {
            let name = if object.kind.has_subs() { &entry.name } else { &object.name };
            (format!("{:04X}:{:02X}", object.index, entry.sub), name)
        });
        let whole = (format!("{:04X}", object.index), &object.name);
        for (key, name) in object.kind.has_subs().then_some(whole).into_iter().chain(entries) {
            let Some(row) = checker.row("names.csv", &key) else { continue };
            checker.cell(row, "data_sheet", Against::Sheet, name);
            let rows = places.iter().filter_map(|(file, column)| Some((case.manual.row(file, &key)?, *column)));
            let named: Vec<_> = rows.filter(|(row, column)| !row.get(column).is_empty()).collect();
            let printed = named.first().map_or("", |(row, column)| row.get(column));
            checker.cell(row, "printed", Against::Manual, printed);
        }
    }
    // If a name is empty, another column has it.
    if let Some((file, column)) = places.first() {
        for row in case.manual.rows(file) {
            let found = case.manual.cell("names.csv", &row.key, "printed");
            let agrees = row.get(column) == found || row.get(column).is_empty();
            checker.that(row, column, Against::Manual, agrees, found);
        }
    }
}
