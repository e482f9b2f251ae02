//! The objects: every sub-index of chapter 7.12.2, and the names.

use std::collections::BTreeMap;

use lexican_eds::model::{AccessType, Direction, Entry, Meaning, NmtState};
use lexican_runtime::object::Address;
use siko_ag03_1::od;
use siko_ag03_1::parameter::{PARAMETERS, ParameterSet};
use siko_ag03_1::sim::{Gear, Setup};

use super::sheet::{Sheet, address, number};
use crate::bench::{Bench, Memory, NODE, once};
use crate::checker::{Against, Answers, Checker};
use crate::code::{Handle, signed};
use crate::manual::{Cells, Manual, Row, cells};
use crate::notation::{self, Default, hex, yes};

pub(crate) fn check(checker: &mut Checker<'_>, manual: &Manual, sheet: &Sheet) {
    for object in &sheet.device.objects {
        super::overview::check(checker, manual, sheet, object.index, &object.name);
        names(checker, manual, sheet, object);
        for entry in &object.entries {
            let key = format!("{:04X}:{:02X}", entry.index, entry.sub);
            if let Some(row) = checker.row("objects.csv", &key) {
                against_the_sheet(checker, manual, sheet, row, entry);
                if let Some(handle) = sheet.handle(entry) {
                    against_the_code(checker, row, entry, handle);
                }
            }
        }
    }
    against_the_drive(checker, manual);
    super::parameters::check(checker, manual, sheet);
}

fn names(checker: &mut Checker<'_>, manual: &Manual, sheet: &Sheet, object: &lexican_eds::model::Object) {
    let index = format!("{:04X}", object.index);
    if let Some(row) = checker.row("names.csv", &index) {
        checker.cell(row, "chapter", Against::Sheet, sheet.chapter(object.index));
        checker.cell(row, "data_sheet", Against::Sheet, &object.name);
        let first = manual.row("objects.csv", &format!("{index}:00"));
        checker.cell(row, "printed", Against::Manual, first.map_or("", |first| first.get("object")));
    }
    for entry in &object.entries {
        let key = format!("{index}:{:02X}", entry.sub);
        // What has no sub-indices has one name for itself and for its value.
        let name = if object.kind.has_subs() { &entry.name } else { &object.name };
        if let Some(row) = checker.row("names.csv", &key) {
            checker.cell(row, "chapter", Against::Sheet, sheet.chapter(object.index));
            checker.cell(row, "data_sheet", Against::Sheet, name);
            let described = manual.row("objects.csv", &key);
            checker.cell(row, "printed", Against::Manual, described.map_or("", |row| row.get("description")));
        }
    }
}

fn against_the_sheet(checker: &mut Checker<'_>, manual: &Manual, sheet: &Sheet, row: &Row, entry: &Entry) {
    use Against::Sheet as S;
    checker.cell(row, "chapter", Against::Sheet, sheet.chapter(entry.index));
    let object = sheet.device.object(entry.index);
    let name = object.map_or("", |object| object.name.as_str());
    checker.that(row, "object", S, is_name_of(manual, row.get("object"), entry.index, name), name);
    let described = manual.row("names.csv", &row.key);
    if let Some(named) = described {
        checker.cell(row, "description", Against::Manual, named.get("printed"));
    }
    let told = [&entry.description, &object.and_then(|object| object.description.clone())];
    let none = told.into_iter().flatten().any(|text| text.starts_with("Compatibility entry without function"));
    checker.cell(row, "function", S, if none && entry.sub != 0 { "none" } else { "" });
    let mapped = |direction| {
        let pdos = sheet.device.pdos.iter().filter(move |pdo| pdo.direction == direction);
        pdos.flat_map(|pdo| &pdo.mapping).any(|mapped| (mapped.index, mapped.sub) == (entry.index, entry.sub))
    };
    let access = match row.get("access") {
        "read-only" | "read" => Some(AccessType::Ro),
        "write-only" => Some(AccessType::Wo),
        "read-write" if mapped(Direction::Receive) => Some(AccessType::Rww),
        "read-write" => Some(AccessType::Rw),
        _ => None,
    };
    checker.that(row, "access", S, access == Some(entry.access), entry.access.name());
    restriction(checker, row, S, entry.writable_in.as_deref());
    checker.cell(row, "pdo_mapping", S, yes(entry.pdo_mapping));
    let is_mapped = mapped(Direction::Receive) || mapped(Direction::Transmit);
    checker.cell(row, "pdo_mapping", Against::Manual, yes(is_mapped));
    unit(checker, row, sheet, entry);
    checker.that(
        row,
        "data_type",
        S,
        row.get("data_type").eq_ignore_ascii_case(entry.data_type.name()),
        entry.data_type,
    );
    default(checker, row, S, number(entry.default.as_ref()));
    checker.cell(row, "eeprom", S, yes(entry.persistent));
    let conditions = entry.ranges.iter().map(|range| ((range.when.index, range.when.value), (range.low, range.high)));
    range(checker, row, S, number(entry.low.as_ref()).zip(number(entry.high.as_ref())), conditions.collect());
}

fn is_name_of(manual: &Manual, printed: &str, index: u16, name: &str) -> bool {
    // Where the data sheet has another name, names.csv says so; the name in the data sheet is compared there.
    let named = manual.row("names.csv", &format!("{index:04X}"));
    let translated = named.is_some_and(|row| row.get("printed") == printed && row.get("data_sheet") == name);
    let differs = manual.row("overview.csv", &format!("{index:04X}")).is_some_and(|row| row.get("name") == name);
    printed.eq_ignore_ascii_case(name) || translated && !differs
}

fn restriction(checker: &mut Checker<'_>, row: &Row, against: Against, states: Option<&[NmtState]>) {
    let found = states.map_or(String::new(), |states| {
        let names = states.iter().map(|state| match state {
            NmtState::PreOperational => " PRE-OPERATIONAL",
            NmtState::Operational => " OPERATIONAL",
        });
        format!("write{}", names.collect::<String>())
    });
    // A write is bound to a state when either column says so.
    let [first, second] = ["restriction", "notice"].map(|column| row.get(column));
    let first_agrees = first == found || first.is_empty() && second == found;
    checker.that(row, "restriction", against, first_agrees, &found);
    checker.that(row, "notice", against, second == found || second.is_empty(), &found);
}

fn unit(checker: &mut Checker<'_>, row: &Row, sheet: &Sheet, entry: &Entry) {
    let Meaning::Quantity(name) = &entry.meaning else {
        return checker.cell(row, "unit", Against::Sheet, "");
    };
    let Some([unit]) = sheet.device.quantities.get(name).map(|quantity| quantity.units.as_slice()) else {
        return checker.cell(row, "unit", Against::Sheet, "");
    };
    let found = match (unit.symbol.as_str(), unit.num, unit.den) {
        ("ms", 1, 10) => "100 us".into(),
        ("°C", num, den) => format!("{num}/{den} degC"),
        (symbol, 1, 1) => symbol.into(),
        (symbol, num, den) => format!("{num}/{den} {symbol}"),
    };
    // Chapter 7.12.2 prints the units of measured values and times; those of parameters stand in table 6.
    let elsewhere = row.get("unit").is_empty() && PRINTED_ELSEWHERE.contains(&found.as_str());
    checker.that(row, "unit", Against::Sheet, row.get("unit") == found || elsewhere, found);
}

const PRINTED_ELSEWHERE: &[&str] = &["rev/min", "%", "increments", "1/100 mm", "ms", "100 us"];

fn default(checker: &mut Checker<'_>, row: &Row, against: Against, found: Option<i128>) {
    let printed = notation::default(row.get("default"));
    let agrees = match printed {
        Some(Default::None) => found.is_none(),
        Some(Default::Value(value)) => found == Some(value),
        Some(Default::NodeIdPlus(base)) => found == Some(base + i128::from(NODE.get())),
        None => false,
    };
    checker.that(row, "default", against, agrees, found.map_or("no".into(), |found| found.to_string()));
}

/// Plain limits, or limits by the gear: `(2102h, its value)` and the range.
fn range(
    checker: &mut Checker<'_>,
    row: &Row,
    against: Against,
    limits: Option<(i128, i128)>,
    conditions: Vec<((u16, i128), (i128, i128))>,
) {
    let printed = row.get("range");
    let agrees = if printed.contains(';') {
        let gears = by_gear(printed);
        let union = gears.iter().fold(None, |sum: Option<(i128, i128)>, (_, (low, high))| {
            Some(sum.map_or((*low, *high), |(least, most)| (least.min(*low), most.max(*high))))
        });
        conditions == gears.into_iter().map(|(gear, range)| ((0x2102, gear), range)).collect::<Vec<_>>()
            && limits == union
    } else {
        // Limits that are those of the data type are no limits to the code.
        let whole = against == Against::Code && limits.is_none() && printed == "0..65535";
        let range = notation::range(printed);
        let said = printed.is_empty() || range.is_some();
        conditions.is_empty() && said && (limits == range || whole)
    };
    checker.that(row, "range", against, agrees, format!("{limits:?} {conditions:?}"));
}

/// `24:1 1..200; 48:1 1..100`: the value of 2102h, and the range.
pub(super) fn by_gear(text: &str) -> Vec<(i128, (i128, i128))> {
    let part = |part: &str| {
        let (gear, range) = part.split_once(' ')?;
        let gear = match gear {
            "24:1" => i128::from(od::GearReduction::GEAR_24_1.0),
            "48:1" => i128::from(od::GearReduction::GEAR_48_1.0),
            _ => return None,
        };
        Some((gear, notation::range(range)?))
    };
    text.split("; ").filter_map(part).collect()
}

fn against_the_code(checker: &mut Checker<'_>, row: &Row, entry: &Entry, handle: &Handle) {
    use Against::Code as C;
    let address = address(entry);
    let access = match row.get("access") {
        "read-only" | "read" => "ro",
        "write-only" => "wo",
        "read-write" => "rw",
        other => other,
    };
    checker.that(row, "access", C, access == handle.access, handle.access);
    checker.cell(row, "pdo_mapping", C, yes(handle.mapping != "no"));
    checker.that(row, "data_type", C, row.get("data_type").eq_ignore_ascii_case(&handle.data_type), &handle.data_type);
    let named = PARAMETERS.iter().find(|parameter| parameter.address == address && parameter.number != 24);
    checker.cell(row, "parameter", C, named.map_or(String::new(), |parameter| parameter.number.to_string()));
    if handle.path.ends_with(".len_object") {
        return;
    }
    default(checker, row, C, handle.default);
    checker.cell(row, "eeprom", C, yes(od::PERSISTENT.contains(&address)));
    let rule = od::WRITABLE_IN.iter().find(|rule| rule.address == address);
    let states = rule.map(|rule| {
        let states = [(rule.pre_operational, NmtState::PreOperational), (rule.operational, NmtState::Operational)];
        states.into_iter().filter(|(allowed, _)| *allowed).map(|(_, state)| state).collect::<Vec<_>>()
    });
    restriction(checker, row, C, states.as_deref());
    let Ok(served) = od::TABLE.entry(address) else { return };
    let conditions = od::RANGES.iter().filter(|range| range.address == address).map(|range| {
        let [low, high] = [range.limit.low, range.limit.high].map(|raw| signed(raw, served.data_type));
        ((range.when.address.index(), i128::from(range.when.raw)), (low, high))
    });
    range(checker, row, C, handle.limits, conditions.collect());
}

/// Asks the drive for every object: rights, default, range ends, states in which it can be written, EEPROM.
fn against_the_drive(checker: &mut Checker<'_>, manual: &Manual) {
    static MEMORY: Memory<Cells, Answers> = Memory::new(BTreeMap::new());
    let rows = manual.rows("objects.csv");
    once(&MEMORY, cells(rows), || answers(rows)).tell(checker, rows);
}

fn answers(rows: &[Row]) -> Answers {
    let mut answers = Answers::default();
    let rows: Vec<(&Row, u16, u8, u8)> = rows.iter().filter_map(asked).collect();
    let mut bench = Bench::new();
    for (row, index, sub, size) in &rows {
        let read = bench.read(*index, *sub);
        let readable = read != Err(0x0601_0001);
        let denied = bench.write(*index, *sub, i64::from(read.unwrap_or(0)), *size);
        let writable = denied != Err(0x0601_0002);
        let found = format!("read {read:08X?}, write {denied:08X?}");
        let expected = match row.get("access") {
            "read-only" | "read" => readable && read.is_ok() && !writable,
            "write-only" => !readable && writable,
            "read-write" => readable && read.is_ok() && writable,
            _ => false,
        };
        answers.that(row, "access", expected, found);
        let exact = bench.write(*index, *sub, 0, if *size == 4 { 2 } else { 4 });
        let refused = !writable || exact == Err(0x0601_0000);
        answers.that(row, "data_type", refused, format!("a value of another size: {exact:08X?}"));
    }
    defaults(&mut answers, &rows);
    ranges(&mut answers, &rows);
    states(&mut answers, &rows);
    eeprom(&mut answers, &rows);
    answers
}

/// Address and size of a row.
fn asked(row: &Row) -> Option<(&Row, u16, u8, u8)> {
    let index = u16::try_from(hex(row.get("index"))?).ok()?;
    let sub = u8::try_from(hex(row.get("subindex"))?).ok()?;
    Some((row, index, sub, size(index, sub)))
}

fn size(index: u16, sub: u8) -> u8 {
    let entry = od::TABLE.entry(Address::new(index, sub));
    entry.ok().and_then(|entry| entry.data_type.bits()).map_or(4, |bits| bits / 8)
}

fn defaults(answers: &mut Answers, rows: &[(&Row, u16, u8, u8)]) {
    let mut bench = Bench::new();
    for (row, index, sub, _) in rows {
        let expected = match notation::default(row.get("default")) {
            Some(Default::Value(value)) => value,
            Some(Default::NodeIdPlus(base)) => base + i128::from(NODE.get()),
            _ => continue,
        };
        // The node-ID is that of the switches, which stand at 5.
        let expected = if *index == 0x2101 { expected + 4 } else { expected };
        let Ok(entry) = od::TABLE.entry(Address::new(*index, *sub)) else { continue };
        let found = bench.read(*index, *sub).map(|raw| signed(raw.into(), entry.data_type));
        answers.that(row, "default", found == Ok(expected), format!("{found:?}"));
    }
}

fn ranges(answers: &mut Answers, rows: &[(&Row, u16, u8, u8)]) {
    for (gear, code) in [(Gear::Reduction24, 2), (Gear::Reduction48, 3)] {
        let mut bench = Bench::with(Setup { gear, ..Setup::new(NODE) });
        // As wide as they can be, so that nothing else is in the way.
        for (sub, limit) in [(2, 9_999_999), (1, -9_999_999)] {
            let wide = bench.write(0x607D, sub, limit, 4);
            answers.require(wide.is_ok(), || format!("607D:{sub:02X}: {wide:08X?}"));
        }
        for (row, index, sub, size) in rows {
            let printed = row.get("range");
            let range = if printed.contains(';') {
                by_gear(printed).into_iter().find(|(gear, _)| *gear == code).map(|(_, range)| range)
            } else {
                notation::range(printed)
            };
            // 1003:00 counts up to ten and can only be set to 0.
            let (Some((low, high)), true) = (range, *index != 0x1003 && row.get("access") == "read-write") else {
                continue;
            };
            let limits = match size {
                1 => (0, 255),
                2 => (0, 65_535),
                _ => (i128::from(i32::MIN), i128::from(i32::MAX)),
            };
            let mut write = |value: i128| bench.write(*index, *sub, value as i64, *size);
            let mut found = vec![];
            // What is beyond the other limit is beyond it first.
            let refused = |written| written == Err(0x0609_0030) || *index == 0x607D && written == Err(0x0609_0036);
            if low > limits.0 {
                found.push(refused(write(low - 1)));
            }
            if high < limits.1 {
                found.push(refused(write(high + 1)));
            }
            found.extend([write(high).is_ok(), write(low).is_ok()]);
            // The pair of limits is ordered, so each goes back to where it leaves the other free.
            if *index == 0x607D {
                found.push(write(if *sub == 1 { low } else { high }).is_ok());
            }
            answers.that(row, "range", !found.contains(&false), format!("{found:?}"));
        }
    }
}

/// A write that the state forbids is refused with 0800 0022h.
fn states(answers: &mut Answers, rows: &[(&Row, u16, u8, u8)]) {
    let mut bench = Bench::new();
    for command in [0x80, 0x01] {
        bench.nmt(command);
        for (row, index, sub, size) in rows.iter().filter(|(row, ..)| row.get("access") == "read-write") {
            let Ok(value) = bench.read(*index, *sub) else { continue };
            let refused = bench.write(*index, *sub, value.into(), *size) == Err(0x0800_0022);
            let printed = [row.get("restriction"), row.get("notice")].join("");
            let only_before = printed.contains("PRE-OPERATIONAL") && !printed.ends_with(" OPERATIONAL");
            let expected = only_before && command == 0x01 || *index == 0x6040 && command == 0x80;
            let column = if row.get("restriction").is_empty() { "notice" } else { "restriction" };
            answers.that(row, column, refused == expected, if refused { "refused" } else { "taken" });
        }
    }
}

/// What has a range and can be written keeps its value over a power cycle, or it does not.
fn eeprom(answers: &mut Answers, rows: &[(&Row, u16, u8, u8)]) {
    let mut bench = Bench::new();
    let mut written = Vec::new();
    let tried = rows.iter().filter(|(row, index, ..)| row.get("access") == "read-write" && *index >= 0x2000);
    for (row, index, sub, size) in tried {
        let Ok(before) = bench.read(*index, *sub) else { continue };
        for value in [before.wrapping_add(1), before.wrapping_sub(1)] {
            if bench.write(*index, *sub, value.into(), *size).is_ok() {
                written.push((*row, *index, *sub, value));
                break;
            }
        }
    }
    // Writing 607Eh renumbers positions, and 607Ch sets them; what is kept are the values.
    bench.see(siko_ag03_1::sim::SimulatedDrive::power_cycle);
    bench.hear(0);
    for (row, index, sub, value) in written {
        let found = bench.read(index, sub);
        let found = yes(found == Ok(value));
        answers.that(row, "eeprom", row.get("eeprom") == found, found);
    }
}

pub(super) fn set_name(set: ParameterSet) -> &'static str {
    match set {
        ParameterSet::Controller => "controller",
        ParameterSet::Standard => "standard",
    }
}

/// The entry that a row of objects.csv describes.
pub(super) fn entry_of<'s>(sheet: &'s Sheet, row: &Row) -> Option<&'s Entry> {
    let (_, index, sub, _) = asked(row)?;
    sheet.device.entry(index, sub)
}
