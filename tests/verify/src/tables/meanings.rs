//! Values and bits: the terms of the overlay, data descriptions, format descriptions, bit rates and gears.

use std::collections::{BTreeMap, BTreeSet};

use lexican_eds::model::Meaning;
use lexican_runtime::CobId;
use lexican_runtime::wire::pdo::PdoCobId;
use siko_ag03_1::fault::Fault;
use siko_ag03_1::sim::inputs::Key;
use siko_ag03_1::sim::{BIT_RATES, Gear, Setup};

use super::observed::{enabled_with, way_to_rest};
use super::sheet::Sheet;
use crate::bench::{Bench, Memory, NODE, once};
use crate::checker::{Against, Checker};
use crate::manual::{Manual, Row};
use crate::notation::hex;

pub(crate) fn check(checker: &mut Checker<'_>, manual: &Manual, sheet: &Sheet) {
    terms(checker, manual, sheet);
    bit_rates(checker, sheet);
    gears(checker, sheet);
    let mut bench = Bench::new();
    for row in manual.rows("values.csv") {
        values(checker, manual, sheet, row);
    }
    for row in manual.rows("formats.csv") {
        formats(checker, manual, sheet, row, &mut bench);
    }
}

/// Every value and every bit that the overlay names.
fn terms(checker: &mut Checker<'_>, manual: &Manual, sheet: &Sheet) {
    let device = &sheet.device;
    let enumerations = device.enumerations.iter().flat_map(|(name, enumeration)| {
        enumeration.values.iter().map(move |value| {
            let key = match name.as_str() {
                "EmergencyCode" => format!("0x{:04X}", value.value),
                "RestoreSignature" => format!("0x{:08X}", value.value),
                _ => value.value.to_string(),
            };
            (name, "enumeration", key, &value.name)
        })
    });
    let bit_fields = device.bit_fields.iter().flat_map(|(name, field)| {
        field.fields.iter().map(move |bit| (name, "bit_field", bit.value.low.to_string(), &bit.name))
    });
    for (name, kind, key, term) in enumerations.chain(bit_fields) {
        let Some(row) = checker.row("terms.csv", &format!("{name}:{key}")) else { continue };
        checker.cell(row, "kind", Against::Sheet, kind);
        checker.cell(row, "overlay", Against::Sheet, term);
        let printed = printed(manual, sheet, name, &key);
        let agrees = printed.iter().any(|printed| row.get("printed") == printed);
        checker.that(row, "printed", Against::Manual, agrees, printed.join(" or "));
    }
    // What the driver calls a fault.
    for fault in Fault::ALL {
        let letter = fault.letter.to_string();
        let Some(row) = checker.row("terms.csv", &format!("Fault:{letter}")) else { continue };
        checker.cell(row, "kind", Against::Code, "fault");
        checker.cell(row, "overlay", Against::Code, fault.text);
        let printed = manual.row("faults.csv", &letter).map_or("", |row| row.get("fault"));
        checker.cell(row, "printed", Against::Manual, printed);
    }
}

/// The entries whose numbers have this meaning.
fn users(sheet: &Sheet, name: &str) -> Vec<(u16, u8)> {
    let of = |meaning: &Meaning| matches!(meaning, Meaning::Enumeration(of) | Meaning::BitField(of) if of == name);
    sheet.device.entries().filter(|entry| of(&entry.meaning)).map(|entry| (entry.index, entry.sub)).collect()
}

/// What the manual calls a value or a bit, in the table that it stands in.
fn printed(manual: &Manual, sheet: &Sheet, name: &str, key: &str) -> Vec<String> {
    let cell = |file: &str, key: &str, column: &str| manual.row(file, key).map(|row| row.get(column).to_owned());
    let by_bit = |file: &str| {
        let rows = manual.rows(file).iter().filter(|row| row.get("bit") == key && !row.get("name").is_empty());
        let mut names: Vec<&str> = rows.map(|row| row.get("name")).collect();
        names.dedup();
        vec![names.join(" / ")]
    };
    match name {
        "Statusword" => by_bit("statusword.csv"),
        "SystemStatus" => by_bit("system_status.csv"),
        "Controlword" => by_bit("controlword.csv"),
        "EmergencyCode" => cell("emergency.csv", key.trim_start_matches("0x"), "meaning").into_iter().collect(),
        "CanBitRate" => cell("baud_rates.csv", key, "kbit").into_iter().collect(),
        "GearReduction" => cell("gears.csv", key, "gear").into_iter().collect(),
        "RestoreSignature" => cell("values.csv", "1011:01:load", "value").into_iter().collect(),
        _ => {
            let at = |(index, sub): (u16, u8)| format!("{index:04X}:{sub:02X}");
            let addresses: Vec<String> = users(sheet, name).into_iter().map(at).collect();
            let value = addresses.iter().filter_map(|at| cell("values.csv", &format!("{at}:{key}"), "meaning"));
            let bit = addresses.iter().flat_map(|at| [format!("{at}:{key}:1"), format!("{at}:{key}")]);
            value.chain(bit.filter_map(|key| cell("formats.csv", &key, "meaning"))).collect()
        }
    }
}

fn bit_rates(checker: &mut Checker<'_>, sheet: &Sheet) {
    let mut bench = Bench::new();
    let values = sheet.device.enumerations.get("CanBitRate").map_or(&[][..], |rates| &rates.values);
    for value in values {
        let Some(row) = checker.row("baud_rates.csv", &value.value.to_string()) else { continue };
        let name = format!("rate {} kbit/s", row.get("kbit"));
        checker.that(row, "kbit", Against::Sheet, name == value.name, &value.name);
        // CiA 306 has keys for eight bit rates.
        let key = row.number::<u16>("kbit").filter(|rate| [10, 20, 50, 125, 250, 500, 800, 1000].contains(rate));
        let listed = key.is_none_or(|rate| sheet.device.info.bit_rates_kbit.contains(&rate));
        checker.that(row, "kbit", Against::Sheet, listed, "no BaudRate key");
        let named = siko_ag03_1::od::CanBitRate(value.value as u8).name();
        checker.that(row, "kbit", Against::Code, named == Some(name.as_str()), named.unwrap_or_default());
        let at = usize::try_from(value.value).unwrap_or(usize::MAX);
        let rate = BIT_RATES.get(at).map_or(0.0, |rate| f64::from(*rate) / 1e3);
        checker.cell(row, "kbit", Against::Drive, rate);
        let written = bench.write(0x2100, 0, value.value as i64, 1);
        checker.that(row, "value", Against::Drive, written.is_ok(), format!("{written:08X?}"));
    }
}

fn gears(checker: &mut Checker<'_>, sheet: &Sheet) {
    for (gear, value) in [(Gear::Reduction24, 2), (Gear::Reduction48, 3)] {
        let Some(row) = checker.row("gears.csv", &value.to_string()) else { continue };
        let gears = sheet.device.enumerations.get("GearReduction");
        let name = gears.and_then(|gears| gears.values.iter().find(|named| named.value == value));
        let name = name.map_or("", |named| named.name.as_str());
        checker.cell(row, "gear", Against::Sheet, name.trim_start_matches("gear "));
        let ranges = [(0x2410, 5), (0x2410, 9), (0x60FF, 0)].map(|(index, sub)| {
            let entry = sheet.device.entry(index, sub);
            entry.and_then(|entry| entry.ranges.iter().find(|range| range.when.value == value)).map(|range| range.high)
        });
        let max = row.number::<i128>("max_rev_per_min");
        checker.that(row, "max_rev_per_min", Against::Sheet, ranges == [max; 3], format!("{ranges:?}"));
        let mut bench = Bench::with(Setup { gear, ..Setup::new(NODE) });
        let read = bench.read(0x2102, 0).ok();
        checker.that(row, "value", Against::Drive, read == row.number("value"), format!("{read:?}"));
        let limit = i64::try_from(max.unwrap_or(0)).unwrap_or(0);
        let found = [bench.write(0x2410, 5, limit, 1), bench.write(0x2410, 5, limit + 1, 1)];
        let agrees = found == [Ok(()), Err(0x0609_0030)];
        checker.that(row, "max_rev_per_min", Against::Drive, agrees, format!("{found:08X?}"));
    }
}

/// A value that a data description, or chapter 6, names.
fn values(checker: &mut Checker<'_>, manual: &Manual, sheet: &Sheet, row: &Row) {
    let Some((index, sub)) = address(row) else { return };
    let Some(entry) = sheet.device.entry(index, sub) else { return };
    let value = row.get("value");
    if let Meaning::Enumeration(name) = &entry.meaning
        && value.parse::<u8>().is_ok()
    {
        let term = manual.row("terms.csv", &format!("{name}:{value}"));
        let printed = term.map_or("", |term| term.get("printed"));
        checker.cell(row, "meaning", Against::Sheet, printed);
    }
    if row.key == "2412:00:0" {
        let agrees = units_depend(sheet, (index, sub), value);
        checker.that(row, "address", Against::Sheet, agrees, "units of positions that depend on something else");
    }
    checker.cell(row, "meaning", Against::Drive, done(&row.key));
    checker.key(row);
}

/// Whether positions are increments when an entry has a value, and otherwise are not.
fn units_depend(sheet: &Sheet, (index, sub): (u16, u8), value: &str) -> bool {
    sheet.device.quantities.values().filter(|quantity| quantity.units.len() > 1).all(|quantity| {
        quantity.units.iter().all(|unit| {
            unit.when.as_ref().is_some_and(|when| {
                let here = (when.index, when.sub, when.value.to_string().as_str()) == (index, sub, value);
                here && when.equal == (unit.symbol == "increments")
            })
        })
    })
}

/// What the drive does with a value, in the words of the table.
fn done(key: &str) -> &'static str {
    static MEMORY: Memory<String, &str> = Memory::new(BTreeMap::new());
    once(&MEMORY, key.to_owned(), || by_motion(key).or_else(|| special(key)).unwrap_or_default())
}

/// Values that show in how the drive moves.
fn by_motion(key: &str) -> Option<&'static str> {
    let (address, value) = key.rsplit_once(':')?;
    let value = match value {
        "i" => 0,
        "e" => 1,
        number => number.parse::<i64>().ok()?,
    };
    let position = |bench: &Bench| bench.see(|drive, now| drive.position(now));
    let found = match address {
        "2416:00" => {
            let way = |a_inch| {
                let mut bench = enabled_with(&[(0x2416, 0, value, 1), (0x2410, 8, a_inch, 1)]);
                bench.control(0x400F);
                bench.hear(2000);
                bench.control(0x000F);
                way_to_rest(&mut bench)
            };
            match (way(50), way(25)) {
                (50, 50) => "stop with maximum delay",
                (100, 200) => "stop with programmed delay, parameter 8",
                _ => "",
            }
        }
        "2417:00" => {
            let mut bench = enabled_with(&[(0x2417, 0, value, 1)]);
            bench.command(0x405, 0x001F, 100);
            bench.hear(10_000);
            let current = bench.read(0x241E, 0).is_ok_and(|current| current > 0);
            match (current, bench.see(|drive, now| drive.turn_shaft(now, 10)), bench.system() >> 7 & 1) {
                (true, false, 0) => "position control to setpoint",
                (false, false, 0) => "position control off; motor windings shorted",
                (false, true, 1) => "position control off; drive released",
                _ => "",
            }
        }
        "2413:00" => {
            let beyond = |target: i32| {
                let mut bench = enabled_with(&[(0x2413, 0, value, 1)]);
                bench.command(0x405, 0x001F, target);
                (0..200).any(|_| {
                    bench.hear(50);
                    position(&bench).abs() > target.abs()
                })
            };
            match (beyond(1000), beyond(-1000)) {
                (false, false) => "direct",
                (false, true) => "loop +",
                (true, false) => "loop -",
                _ => "",
            }
        }
        "2412:00" => {
            let mut bench = enabled_with(&[(0x2412, 0, value, 2)]);
            bench.command(0x405, 0x001F, 1600);
            bench.hear(10_000);
            let turned = bench.see(|drive, now| drive.shaft(now).position);
            if turned == 1600.0 { "positions in increments" } else { "" }
        }
        "2421:00" => {
            let stops = |threshold| {
                let mut bench = enabled_with(&[(0x2421, 0, threshold, 1)]);
                bench.command(0x405, 0x001F, 100_000);
                bench.world(|inputs| inputs.load_ma = 2400);
                bench.hear(2000);
                bench.read(0x2422, 0) == Ok(1)
            };
            if !stops(value) && stops(110) { "torque deactivation off" } else { "" }
        }
        "2410:0A" => {
            let way = |a_pos, d_pos| {
                let mut bench = enabled_with(&[(0x2410, 4, a_pos, 1), (0x2410, 0x0A, d_pos, 1)]);
                bench.command(0x405, 0x001F, 100_000);
                bench.hear(3000);
                bench.control(0x011F);
                way_to_rest(&mut bench)
            };
            let ways = [way(50, value), way(25, value), way(25, 100)];
            if ways == [100, 200, 50] { "delay by parameter 4" } else { "" }
        }
        "6060:00" => {
            let runs = |id, word, target| {
                let mut bench = enabled_with(&[(0x6060, 0, value, 1)]);
                bench.control(0x010F);
                bench.command(id, word, target);
                bench.hear(20_000);
                (position(&bench), bench.see(|drive, now| drive.velocity(now)))
            };
            match (runs(0x405, 0x001F, 500), runs(0x505, 0x000F, 20)) {
                ((500, 0), (0, 0)) => "profile position",
                (_, (_, 20)) => "profile velocity",
                _ => "",
            }
        }
        "607E:00" => {
            let mut bench = Bench::new();
            bench.set(&[(0x607E, 0, value, 1)]);
            bench.hear(0);
            bench.world(|inputs| inputs.key = Some(Key::CounterClockwise));
            bench.hear(1000);
            match (position(&bench) > 0, key.ends_with(char::is_alphabetic)) {
                (true, true) => "counter-clockwise counts positive",
                (false, true) => "counter-clockwise counts negative",
                (true, false) => "sense of rotation i",
                (false, false) => "sense of rotation e",
            }
        }
        _ => return None,
    };
    Some(found)
}

/// Values outside of enumerations: what the drive does with them, in the words of the table.
fn special(key: &str) -> Option<&'static str> {
    let mut bench = Bench::operational();
    match key {
        "1003:00:0" => {
            bench.world(|inputs| inputs.internal_error = true);
            let before = bench.read(0x1003, 0);
            let cleared = bench.write(0x1003, 0, 0, 1).is_ok() && bench.read(0x1003, 0) == Ok(0);
            (before == Ok(1) && cleared).then_some("written: clears the fault buffer")
        }
        "100C:00:0" => stays_enabled(&mut bench, 0, 3).then_some("node guarding off"),
        "100D:00:0" => stays_enabled(&mut bench, 100, 0).then_some("life guarding off"),
        "1017:00:0" => {
            let on = bench.write(0x1017, 0, 100, 2).is_ok() && !bench.hear_from(0x705, 1000).is_empty();
            let off = bench.write(0x1017, 0, 0, 2).is_ok() && bench.hear_from(0x705, 1000).is_empty();
            (on && off).then_some("heartbeat off")
        }
        "1011:01:load" | "1011:02:load" | "1011:03:load" => Some(restored_set(&mut bench, key)),
        "1011:04:load" => {
            let set = bench.write(0x607C, 0, 500, 4).is_ok() && bench.write(0x1011, 4, 0x6461_6F6C, 4).is_ok();
            (set && bench.read(0x6064, 0) == Ok(500)).then_some("calibrate")
        }
        "1800:05:0" | "1802:05:0" | "1803:05:0" => event_timer_off(key).then_some("event timer off"),
        _ => None,
    }
}

fn stays_enabled(bench: &mut Bench, guard_time_ms: i64, life_time_factor: i64) -> bool {
    bench.enable();
    let set = bench.write(0x100C, 0, guard_time_ms, 2).is_ok() && bench.write(0x100D, 0, life_time_factor, 1).is_ok();
    bench.request(0x705);
    bench.hear(5000);
    set && bench.status() & 0x6F == 0x27
}

fn restored_set(bench: &mut Bench, key: &str) -> &'static str {
    // One parameter of each set: the window (standard), and a-Pos (controller).
    let changed = bench.write(0x6067, 0, 11, 2).is_ok() && bench.write(0x2410, 4, 51, 1).is_ok();
    let sub = key.get(6..7).and_then(|digit| digit.parse().ok()).unwrap_or(0);
    let loaded = bench.write(0x1011, sub, 0x6461_6F6C, 4).is_ok();
    match (changed && loaded, bench.read(0x6067, 0), bench.read(0x2410, 4)) {
        (true, Ok(10), Ok(50)) => "all parameters to default",
        (true, Ok(10), Ok(51)) => "standard parameters to default",
        (true, Ok(11), Ok(50)) => "controller parameters to default",
        _ => "",
    }
}

fn event_timer_off(key: &str) -> bool {
    let Some(index) = key.get(..4).and_then(hex).and_then(|index| u16::try_from(index).ok()) else { return false };
    let id = [0x185, 0x285, 0x385, 0x485].get(usize::from(index & 3)).copied().unwrap_or(0);
    let count = |timer| {
        let mut bench = Bench::new();
        let set = bench.write(index, 2, 255, 1).is_ok() && bench.write(index, 5, timer, 2).is_ok();
        bench.nmt(0x01);
        if set { bench.hear_from(id, 1000).len() } else { usize::MAX }
    };
    (count(100), count(0)) == (10, 0)
}

/// The index, and the first sub-index, of `1003:01..0A`.
fn address(row: &Row) -> Option<(u16, u8)> {
    let (index, subs) = row.get("address").split_once(':')?;
    let sub = subs.split("..").next()?;
    Some((u16::try_from(hex(index)?).ok()?, u8::from_str_radix(sub, 16).ok()?))
}

/// Lowest and highest bit of `31..24` or `5..6` or `7`.
fn bits(row: &Row) -> Option<(u8, u8)> {
    let mut ends = row.get("bits").split("..").map(|end| end.parse::<u8>().ok());
    let first = ends.next()??;
    let last = ends.next().map_or(Some(first), |last| last)?;
    Some((first.min(last), first.max(last)))
}

fn formats(checker: &mut Checker<'_>, manual: &Manual, sheet: &Sheet, row: &Row, bench: &mut Bench) {
    let Some(((index, sub), (low, high))) = address(row).zip(bits(row)) else { return };
    checker.cell(row, "chapter", Against::Manual, sheet.chapter(index));
    let last = row.get("address").split("..").nth(1).and_then(|sub| u8::from_str_radix(sub, 16).ok());
    let subs = sheet.device.object(index).and_then(|object| object.entries.last()).map_or(0, |entry| entry.sub);
    checker.that(row, "address", Against::Sheet, last.is_none_or(|last| last == subs), format!("..{subs:02X}"));
    let bits = sheet.device.entry(index, sub).and_then(|entry| entry.data_type.bits());
    checker.that(row, "address", Against::Sheet, bits.is_some(), "no such entry");
    // The manual prints 32 bits where the drive has 16, too (E05, E06).
    let fits = bits.is_some_and(|bits| high < bits || bits == 16 && high == 31);
    checker.that(row, "bits", Against::Sheet, fits, format!("{bits:?} bits"));
    // The rows of an object say what each of its bits is, and none of them twice.
    checker.that(row, "bits", Against::Manual, are_whole(manual, row.get("address")), "a gap or an overlap");
    let taken = |raw: u32| u32::try_from(u64::from(raw) >> low & ((1 << (high - low + 1)) - 1)).unwrap_or(0);
    let mut drive = || bench.read(index, sub).ok().map(taken);
    let value = row.get("value");
    let (found, against) = match index {
        0x1000 if low == 0 => (if drive() == Some(402) { "device profile number" } else { "" }.into(), Against::Drive),
        0x1000 => {
            let part = match (low, drive()) {
                (24, Some(0)) => "manufacturer-specific; not used",
                (16, Some(0)) => "drive type; not used",
                _ => "",
            };
            (part.into(), Against::Drive)
        }
        0x1001 | 0x2420 | 0x2422 => (named_bits(manual, sheet, row, index, sub, (low, high)), Against::Sheet),
        0x1002 | 0x1003 => (halves(sheet, index, sub, (low, high)).into(), Against::Sheet),
        0x1008 => (drive().and_then(char::from_u32).map_or(String::new(), String::from), Against::Drive),
        0x100A => (version(drive(), value).unwrap_or_default(), Against::Drive),
        0x1011 => (character(0x6461_6F6C_u32, low).to_string(), Against::Code),
        0x1600..=0x16FF | 0x1A00..=0x1AFF => (mapping_part((low, high)).into(), Against::Code),
        0x2500 => {
            let part = match (low, drive().map(|part| format!("{part:02X}")) == Some(value.to_owned())) {
                (24, true) => "day",
                (16, true) => "month",
                (0, true) => "year",
                _ => "",
            };
            (part.into(), Against::Drive)
        }
        _ => (cob_id_part(row, index, (low, high)).into(), Against::Code),
    };
    // Bytes of a text or of a date have values, bits have two, and everything else has none.
    let said = match index {
        0x1008 | 0x100A | 0x1011 => {
            hex(value).and_then(char::from_u32).map(String::from) == Some(row.get("meaning").into())
        }
        0x2500 => hex(value).is_some(),
        0x1000 | 0x1002 | 0x1003 | 0x1600..=0x16FF | 0x1A00..=0x1AFF => value.is_empty(),
        _ => matches!(value, "" | "0" | "1"),
    };
    checker.cell(row, "meaning", against, found);
    checker.that(row, "value", Against::Manual, said, "another character, or no value");
    if index == 0x1008 {
        let byte = drive().map(|byte| format!("{byte:02X}"));
        checker.cell(row, "value", Against::Drive, byte.unwrap_or_default());
    }
}

/// Whether the rows of an address share its bits among themselves, from bit 0 to the highest of a byte.
fn are_whole(manual: &Manual, address: &str) -> bool {
    let rows = manual.rows("formats.csv").iter().filter(|row| row.get("address") == address);
    let parts: BTreeSet<(u8, u8)> = rows.filter_map(bits).collect();
    let next = parts.iter().try_fold(0, |next, (low, high)| (*low == next).then_some(high + 1));
    next.is_some_and(|next| next % 8 == 0)
}

/// The character at a position of four.
fn character(word: u32, low: u8) -> char {
    char::from(word.to_le_bytes().get(usize::from(low / 8)).copied().unwrap_or(0))
}

/// The version is an example; what the drive has in its place is of the same kind.
fn version(drive: Option<u32>, value: &str) -> Option<String> {
    let (drive, printed) = (char::from_u32(drive?)?, char::from_u32(hex(value)?)?);
    (drive == printed || drive.is_ascii_digit() && printed.is_ascii_digit()).then(|| printed.to_string())
}

fn halves(sheet: &Sheet, index: u16, sub: u8, (low, high): (u8, u8)) -> &'static str {
    let bits = sheet.device.entry(index, sub).and_then(|entry| entry.data_type.bits());
    match (index, low, high, bits) {
        (_, 16, 31, Some(16)) => "not used",
        (0x1002, 0, 15, Some(16)) => "system status word",
        (0x1003, 8, 15, Some(16)) => "error code high byte",
        (0x1003, 0, 7, Some(16)) => "error code low byte",
        _ => "",
    }
}

fn mapping_part((low, high): (u8, u8)) -> &'static str {
    let mapped = lexican_runtime::object::Mapped::from_parameter(0x6040_0110);
    match (low, high) {
        (16, 31) if mapped.address.index() == 0x6040 => "index",
        (8, 15) if mapped.address.sub() == 1 => "sub-index",
        (0, 7) if mapped.bits == 0x10 => "length in bits",
        _ => "",
    }
}

fn named_bits(manual: &Manual, sheet: &Sheet, row: &Row, index: u16, sub: u8, (low, high): (u8, u8)) -> String {
    let Some(Meaning::BitField(name)) = sheet.device.entry(index, sub).map(|entry| &entry.meaning) else {
        return String::new();
    };
    let Some(field) = sheet.device.bit_fields.get(name) else { return String::new() };
    if field.fields.iter().all(|bit| bit.value.high < low || bit.value.low > high) {
        return if row.get("value") == "0" { "reserved" } else { "not used" }.into();
    }
    let term = manual.row("terms.csv", &format!("{name}:{low}")).map_or("", |term| term.get("printed"));
    match row.get("value") {
        "" | "1" => term.to_owned(),
        "0" if term.ends_with(" active") => format!("{} inactive", term.trim_end_matches(" active")),
        "0" if term.ends_with(" applied") => format!("{} not applied", term.trim_end_matches(" applied")),
        _ => String::new(),
    }
}

/// What the runtime makes of a bit of a COB-ID parameter.
fn cob_id_part(row: &Row, index: u16, (low, high): (u8, u8)) -> &'static str {
    let (sync, emcy, sdo, rpdo) = (index == 0x1005, index == 0x1014, index == 0x1200, index < 0x1800);
    match (low, high, row.get("value")) {
        (30, 31, "") if sync => "not used",
        (31, 31, "0") if !sync && PdoCobId(0).is_valid() => "valid",
        (31, 31, "1") if !sync && !PdoCobId(1 << 31).is_valid() => "not valid",
        (30, 30, "0") if emcy || sdo => "reserved",
        (30, 30, "") if rpdo && !emcy && !sdo => "not used",
        (30, 30, "0") if !rpdo && PdoCobId(0).allows_remote() => "RTR enabled",
        (30, 30, "1") if !rpdo && !PdoCobId(1 << 30).allows_remote() => "RTR disabled",
        (29, 29, "0") if !CobId::from_parameter(0).is_extended() => "11-bit identifier",
        (29, 29, "1") if CobId::from_parameter(1 << 29).is_extended() => "29-bit identifier",
        (11, 28, "") if CobId::from_parameter(1 << 29 | 0x1FFF_F800).raw() == 0x1FFF_F800 => "identifier when 29-bit",
        (0, 10, "") if sync || emcy => "identifier",
        (7, 10, "") => "function code",
        (0, 6, "") => "node-ID",
        _ => "",
    }
}
