//! Table 6: the 31 parameters.

use lexican_driver::ParameterSet;
use lexican_eds::model::{ConditionalRange, Entry, Meaning};
use siko::order::Braking;

use super::objects::in_words as unit_in_words;
use super::rig::{LOAD, Rig, Siko};
use crate::checker::{Against, Checker};
use crate::drive::Case;
use crate::kinds::objects::{address_of, by_variant, changed};
use crate::manual::{Manual, Row};
use crate::notation::{self, yes};
use crate::rig::once;

pub(crate) fn check<D: Siko>(checker: &mut Checker<'_>, case: &Case<'_>) {
    let (manual, sheet) = (case.manual, case.sheet);
    for row in manual.rows("parameters.csv").iter().filter(|row| !case.drive.exempt.row("parameters.csv", &row.key)) {
        let Some(number) = row.number::<u8>("number") else { continue };
        checker.key(row);
        if let Some((_, index)) = D::LASTING.iter().find(|(lasting, _)| *lasting == number) {
            lasting::<D>(checker, case, row, *index);
            continue;
        }
        let Some(parameter) = D::MODEL.parameters.iter().find(|parameter| parameter.number == number) else {
            if number == 25 && parameters_25(case).next().is_some() {
                of_other_interfaces::<D>(checker, case, row);
                continue;
            }
            checker.cell(row, "kind", Against::Code, "reserved");
            for column in ["name", "range", "default", "unit", "object", "eeprom"] {
                checker.cell(row, column, Against::Code, "");
            }
            continue;
        };
        checker.cell(row, "kind", Against::Code, set_name(parameter.set));
        if number == 24 {
            setpoint::<D>(checker, case, row);
            continue;
        }
        let address = parameter.address;
        let single = sheet.device.object(address.index()).is_some_and(|object| !object.kind.has_subs());
        let printed = if single { format!("{:04X}", address.index()) } else { address.to_string() };
        checker.cell(row, "object", Against::Code, printed);
        let Some(object) = manual.row("objects.csv", &address.to_string()) else { continue };
        let described = object.get("description");
        checker.that(row, "name", Against::Manual, is_named::<D>(row, described), described);
        let Some(entry) = sheet.device.entry(address.index(), address.sub()) else { continue };
        checker.cell(row, "eeprom", Against::Sheet, yes(entry.persistent));
        unit(checker, case, row, entry);
        // By the address in the other table.
        let printed = address_of(object).and_then(|(index, sub)| sheet.device.entry(index, sub));
        if let Some(entry) = printed {
            range_and_default::<D>(checker, case, row, object, entry);
        }
    }
    restored::<D>(checker, case);
}

/// Whether table 6 names a parameter as the description of its object does, or as a known exception.
fn is_named<D: Siko>(row: &Row, described: &str) -> bool {
    let bare = |name: &str| name.replace(' ', "").to_ascii_lowercase();
    let name = row.get("name");
    let known = D::NAMES.iter().any(|(number, known)| row.number("number") == Some(*number) && *known == name);
    known || bare(described) == bare(name) || described.split(" (").next().map(bare) == Some(bare(name))
}

/// Compares a parameter that 1011h does not restore: the address, or the bit rate by its name.
fn lasting<D: Siko>(checker: &mut Checker<'_>, case: &Case<'_>, row: &Row, index: u16) {
    let key = format!("{index:04X}:00");
    checker.cell(row, "object", Against::Code, format!("{index:04X}"));
    let described = case.manual.cell("objects.csv", &key, "description");
    checker.that(row, "name", Against::Manual, is_named::<D>(row, described), described);
    let Some(entry) = case.sheet.device.entry(index, 0) else { return };
    checker.cell(row, "eeprom", Against::Sheet, yes(entry.persistent));
    let rate = |value: i128| D::bit_rate(value as u8)?.split(' ').nth(1);
    let Some(limits) = case.sheet.number(entry.low.as_ref()).zip(case.sheet.number(entry.high.as_ref())) else {
        return;
    };
    let default = case.sheet.number(entry.default.as_ref()).unwrap_or(0);
    let (range, default) = match rate(default).filter(|_| matches!(entry.meaning, Meaning::Enumeration(_))) {
        Some(named) => ((limits.0..=limits.1).filter_map(rate).collect::<Vec<_>>().join("; "), named.to_owned()),
        None => (format!("{}..{}", limits.0, limits.1), default.to_string()),
    };
    checker.cell(row, "range", Against::Sheet, range);
    checker.cell(row, "default", Against::Sheet, default);
    let unit = if matches!(entry.meaning, Meaning::Enumeration(_)) { "kBaud" } else { "" };
    checker.cell(row, "unit", Against::Sheet, unit);
    let restored = once::<D, _>(index, || {
        let mut rig = Rig::<D>::new();
        let changed = changed(&mut rig, index, 0, 1);
        [1, 2, 3].into_iter().any(|sub| {
            rig.set(&[(0x1011, sub, LOAD, 4)]);
            changed.is_none_or(|(_, value)| rig.read(index, 0) != Ok(value))
        })
    });
    checker.cell(row, "kind", Against::Drive, if restored { "restored" } else { "" });
}

/// Parameter 25, which only other interfaces have, not as an object.
fn parameters_25<'a>(case: &'a Case<'_>) -> impl Iterator<Item = &'a Entry> {
    let parameters = case.sheet.device.interfaces.values().flat_map(|interface| &interface.parameters);
    let entries = parameters.map(|parameter| &parameter.entry).filter(|entry| entry.index == 0);
    entries.filter(|entry| matches!(&entry.meaning, Meaning::Enumeration(name) if name == "InchingStop"))
}

fn of_other_interfaces<D: Siko>(checker: &mut Checker<'_>, case: &Case<'_>, row: &Row) {
    checker.that(row, "name", Against::Manual, is_named::<D>(row, ""), "another name");
    checker.cell(row, "object", Against::Sheet, "");
    for entry in parameters_25(case) {
        let limits = [&entry.low, &entry.high].map(|limit| case.sheet.number(limit.as_ref()).unwrap_or(-1));
        checker.cell(row, "range", Against::Sheet, format!("{}..{}", limits[0], limits[1]));
        checker.cell(row, "unit", Against::Sheet, "");
        checker.cell(row, "eeprom", Against::Sheet, yes(entry.persistent));
        checker.cell(row, "default", Against::Sheet, entry.default.as_ref().map_or("", |_| "a default"));
    }
    for (sub, kind) in [(2, "standard"), (3, "controller")] {
        let mut rig = Rig::<D>::as_delivered();
        rig.see(|drive, now| drive.set_inching_stop(now, Braking::Programmed));
        checker.require(rig.set(&[(0x1011, sub, LOAD, 4)]), || format!("1011:{sub:02X} restores nothing"));
        let restored = rig.see(|drive, now| drive.non_volatile(now).inching_stop == 0);
        let agrees = restored == (row.get("kind") == kind);
        checker.that(row, "kind", Against::Drive, agrees, if restored { "restored" } else { "not restored" });
    }
}

/// Compares parameter 24, which is two objects, one for each operating mode.
fn setpoint<D: Siko>(checker: &mut Checker<'_>, case: &Case<'_>, row: &Row) {
    let sheet = case.sheet;
    let described = case.manual.cell("objects.csv", "607A:00", "description");
    let named = described.split(' ').next().is_some_and(|first| first.eq_ignore_ascii_case(row.get("name")));
    checker.that(row, "name", Against::Manual, named, described);
    let [position, velocity] = [0x607A, 0x60FF].map(|index| sheet.device.entry(index, 0));
    let of_gear = |range: &ConditionalRange| {
        let gears = sheet.device.enumerations.get("GearReduction").map_or(&[][..], |gears| &gears.values);
        let gear = gears.iter().find(|gear| gear.value == range.when.value).map_or("", |gear| gear.name.as_str());
        format!("{} {}..{}", gear.trim_start_matches("gear "), range.low, range.high)
    };
    let ranges: Vec<_> = velocity.map_or(Vec::new(), |velocity| velocity.ranges.iter().map(of_gear).collect());
    // A statement covers that the limits bound it.
    checker.cell(
        row,
        "range",
        Against::Sheet,
        format!("positioning: parameters 15/16; velocity: {}", ranges.join("; ")),
    );
    let [position_unit, velocity_unit] =
        [position, velocity].map(|entry| entry.map_or(String::new(), |entry| units(case, entry)));
    checker.cell(row, "unit", Against::Sheet, format!("positioning: {position_unit}; velocity: {velocity_unit}"));
    checker.cell(row, "object", Against::Manual, "");
    let mut rig = Rig::<D>::new();
    for index in [0x607A, 0x60FF] {
        let found = rig.read(index, 0);
        let agrees = row.number::<u32>("default").is_some_and(|default| found == Ok(default));
        checker.that(row, "default", Against::Drive, agrees, format!("{found:?}"));
    }
    let eeprom = [position, velocity].map(|entry| yes(entry.is_some_and(|entry| entry.persistent)));
    checker.that(row, "eeprom", Against::Sheet, eeprom == [row.get("eeprom"); 2], eeprom.join("; "));
}

fn range_and_default<D: Siko>(checker: &mut Checker<'_>, case: &Case<'_>, row: &Row, object: &Row, entry: &Entry) {
    let (manual, sheet) = (case.manual, case.sheet);
    let limits = match (&entry.low, &entry.high) {
        (Some(low), Some(high)) => low.as_integer().zip(high.as_integer()),
        _ => None,
    };
    let range = row.get("range");
    let values: Vec<&str> = words_of(manual, &object.key).into_iter().map(|row| row.get("meaning")).collect();
    let (agrees, found) = if range.contains("..") && range.contains(';') {
        let printed: Vec<_> = by_variant::<D>(range).into_iter().map(|(_, range)| range).collect();
        let found: Vec<_> = entry.ranges.iter().map(|range| (range.low, range.high)).collect();
        (printed == found, format!("{found:?}"))
    } else if range.contains("..") {
        (notation::range(range) == limits, format!("{limits:?}"))
    } else {
        let printed: Vec<&str> = range.split("; ").collect();
        let found = values.iter().map(|value| in_words(value)).collect::<Vec<_>>();
        (printed == found, found.join("; "))
    };
    checker.that(row, "range", Against::Sheet, agrees, found);
    let default = sheet.number(entry.default.as_ref()).map_or(String::new(), |default| default.to_string());
    let named = words_of(manual, &object.key).into_iter().find(|row| row.get("value") == default);
    let named = named.map_or("", |row| in_words(row.get("meaning")));
    checker.cell(row, "default", Against::Sheet, if range.contains("..") { default } else { named.to_owned() });
}

/// The rows of values.csv that name the values of a data description.
fn words_of<'m>(manual: &'m Manual, key: &str) -> Vec<&'m Row> {
    let of = |row: &&Row| row.get("address") == key && row.get("chapter").contains(".12.2.");
    manual.rows("values.csv").iter().filter(of).collect()
}

/// The name in table 6 for what the data description calls otherwise.
fn in_words(meaning: &str) -> &str {
    match meaning {
        "profile position" => "positioning mode",
        "profile velocity" => "speed mode",
        "sense of rotation i" => "i",
        "sense of rotation e" => "e",
        other => other,
    }
}

/// The units of an entry, as table 6 prints them.
fn units(case: &Case<'_>, entry: &Entry) -> String {
    case.sheet.units(entry).iter().map(unit_in_words).collect::<Vec<_>>().join("; ")
}

fn unit(checker: &mut Checker<'_>, case: &Case<'_>, row: &Row, entry: &Entry) {
    let (units, printed) = (units(case, entry), row.get("unit"));
    // A value relative to parameter 9 has the unit of a share. The calibration value is a position, but printed without
    // a unit.
    let agrees = printed == units || printed.split(" of ").next() == Some(&units);
    let silent = printed.is_empty() && row.get("number") == "14";
    checker.that(row, "unit", Against::Sheet, agrees || silent, units);
}

/// Checks that 1011h:02 restores the standard parameters, 1011h:03 those of the controller, and each leaves the others
/// alone.
fn restored<D: Siko>(checker: &mut Checker<'_>, case: &Case<'_>) {
    for (sub, kind) in [(2, "standard"), (3, "controller")] {
        let mut rig = Rig::<D>::as_delivered();
        let mut altered = Vec::new();
        for row in case.manual.rows("parameters.csv").iter().filter(|row| !row.get("object").is_empty()) {
            let number = row.number::<u8>("number");
            let parameter = D::MODEL.parameters.iter().find(|parameter| Some(parameter.number) == number);
            let Some((index, sub)) = parameter.map(|of| (of.address.index(), of.address.sub())) else { continue };
            let values = changed(&mut rig, index, sub, case.sheet.code.size(index, sub));
            altered.extend(values.map(|(before, _)| (row, index, sub, before)));
        }
        checker.require(rig.set(&[(0x1011, sub, LOAD, 4)]), || format!("1011:{sub:02X} restores nothing"));
        for (row, index, sub, before) in altered {
            let restored = rig.read(index, sub) == Ok(before);
            let agrees = restored == (row.get("kind") == kind);
            checker.that(row, "kind", Against::Drive, agrees, if restored { "restored" } else { "not restored" });
        }
    }
}

fn set_name(set: ParameterSet) -> &'static str {
    match set {
        ParameterSet::Controller => "controller",
        ParameterSet::Standard => "standard",
    }
}
