//! Values: terms, data descriptions, bit rates and gears, by what the drive does with each value.

use lexican_eds::model::Meaning;
use siko::sim::{BIT_RATES, Setup};

use super::rig::{NODE, Rig, Siko};
use super::statements::SCRIPT;
use crate::checker::{Against, Checker};
use crate::drive::Case;
use crate::kinds::objects::address_in;
use crate::kinds::prose::said;
use crate::kinds::terms::{self, Place};
use crate::manual::Row;
use crate::rig::once;
use crate::sheet::Sheet;

/// Compares `terms.csv`, `baud_rates.csv`, `gears.csv` and `values.csv`.
pub(crate) fn check<D: Siko>(checker: &mut Checker<'_>, case: &Case<'_>) {
    terms::check(checker, case, PLACES);
    faults::<D>(checker, case);
    bit_rates::<D>(checker, case.sheet);
    gears::<D>(checker, case.sheet);
    for row in case.manual.rows("values.csv") {
        values::<D>(checker, case, row);
    }
}

/// The tables for types that neither `values.csv` nor `formats.csv` names.
const PLACES: &[(&str, Place)] = &[
    ("Statusword", Place::Bits("statusword.csv")),
    ("SystemStatus", Place::Bits("system_status.csv")),
    ("Controlword", Place::Bits("controlword.csv")),
    ("EmergencyCode", Place::Row("emergency.csv", "meaning")),
    ("CanBitRate", Place::Row("baud_rates.csv", "kbit")),
    ("GearReduction", Place::Row("gears.csv", "gear")),
    ("RestoreSignature", Place::Cell("values.csv", "1011:01:load", "value")),
];

/// Compares the driver's names of faults.
fn faults<D: Siko>(checker: &mut Checker<'_>, case: &Case<'_>) {
    for fault in D::MODEL.faults {
        let letter = fault.letter().to_string();
        let Some(row) = checker.row("terms.csv", &format!("Fault:{letter}")) else { continue };
        checker.cell(row, "kind", Against::Code, "fault");
        checker.cell(row, "overlay", Against::Code, fault.code.text);
        checker.cell(row, "printed", Against::Manual, case.manual.cell("faults.csv", &letter, "fault"));
    }
}

/// The bit rates for which CiA 306 has keys, in kbit/s.
const BIT_RATE_KEYS: [u16; 8] = [10, 20, 50, 125, 250, 500, 800, 1000];

/// Compares the file's names and the bit rates of `[DeviceInfo]`.
pub(super) fn file<D: Siko>(checker: &mut Checker<'_>, case: &Case<'_>) {
    let names = case.sheet.overlay.lines().find(|line| line.starts_with("names = ")).unwrap_or_default();
    checker.require(names == D::FILES, || format!("the overlay answers to {names:?}"));
    // Of the bit rates that the drive can be set to, those with a key.
    let keys = |rate: &u16| BIT_RATE_KEYS.contains(rate);
    let rates: Vec<u16> = BIT_RATES.iter().map(|rate| (rate / 1000) as u16).filter(keys).collect();
    let listed = &case.sheet.device.info.bit_rates_kbit;
    let device = &case.sheet.device;
    let four = once::<D, _>((), || {
        let mut rig = Rig::<D>::new();
        [1, 4].map(|size| rig.write_exactly(0x6060, 0, 2, size).is_ok())
    });
    let written = if device.sdo_writes_four_bytes { [false, true] } else { [true, false] };
    checker.require(four == written, || format!("6060h is written {four:?} by one and four bytes"));
    // The second character of a version such as 1.00 is a dot.
    let version = once::<D, _>((), || Rig::<D>::new().read(0x100A, 0).map(u32::to_be_bytes));
    let high = device.entry(0x100A, 0).is_some_and(|entry| entry.first_character_high);
    let dot = version.is_ok_and(|bytes| bytes[if high { 1 } else { 2 }] == b'.');
    checker.require(dot, || format!("100Ah: {version:02X?}, and its first character is high: {high}"));
    checker.require(*listed == rates, || format!("BaudRate: {listed:?} in the data sheet, {rates:?} in the drive"));
}

fn bit_rates<D: Siko>(checker: &mut Checker<'_>, sheet: &Sheet) {
    let mut rig = Rig::<D>::new();
    let values = sheet.device.enumerations.get("CanBitRate").map_or(&[][..], |rates| &rates.values);
    for value in values {
        let Some(row) = checker.row("baud_rates.csv", &value.value.to_string()) else { continue };
        let name = format!("rate {} kbit/s", row.get("kbit"));
        checker.that(row, "kbit", Against::Sheet, name == value.name, &value.name);
        let key = row.number::<u16>("kbit").filter(|rate| BIT_RATE_KEYS.contains(rate));
        let listed = key.is_none_or(|rate| sheet.device.info.bit_rates_kbit.contains(&rate));
        checker.that(row, "kbit", Against::Sheet, listed, "no BaudRate key");
        let named = D::bit_rate(value.value as u8);
        checker.that(row, "kbit", Against::Code, named == Some(name.as_str()), named.unwrap_or_default());
        let at = usize::try_from(value.value).unwrap_or(usize::MAX);
        let rate = BIT_RATES.get(at).map_or(0.0, |rate| f64::from(*rate) / 1e3);
        checker.cell(row, "kbit", Against::Drive, rate);
        let written = rig.write(0x2100, 0, value.value as i64, 1);
        checker.that(row, "value", Against::Drive, written.is_ok(), format!("{written:08X?}"));
    }
}

fn gears<D: Siko>(checker: &mut Checker<'_>, sheet: &Sheet) {
    for &(gear, _) in D::GEARS {
        let value = i128::from(gear);
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
        let mut rig = Rig::<D>::set_up(Setup { gear, ..Setup::new(D::MODEL, NODE) });
        let read = rig.read(0x2102, 0).ok();
        checker.that(row, "value", Against::Drive, read == row.number("value"), format!("{read:?}"));
        let limit = i64::try_from(max.unwrap_or(0)).unwrap_or(0);
        let found = [rig.write(0x2410, 5, limit, 1), rig.write(0x2410, 5, limit + 1, 1)];
        let agrees = found == [Ok(()), Err(0x0609_0030)];
        checker.that(row, "max_rev_per_min", Against::Drive, agrees, format!("{found:08X?}"));
    }
}

/// Compares a value that a data description, or chapter 6, names.
fn values<D: Siko>(checker: &mut Checker<'_>, case: &Case<'_>, row: &Row) {
    let Some((index, sub)) = address_in(row) else { return };
    let Some(entry) = case.sheet.device.entry(index, sub) else { return };
    let value = row.get("value");
    if let Meaning::Enumeration(name) = &entry.meaning
        && value.parse::<u8>().is_ok()
    {
        let printed = case.manual.cell("terms.csv", &format!("{name}:{value}"), "printed");
        checker.cell(row, "meaning", Against::Sheet, printed);
    }
    if row.key == "2412:00:0" {
        let agrees = units_depend(case.sheet, (index, sub), value);
        checker.that(row, "address", Against::Sheet, agrees, "units of positions that depend on something else");
    }
    let done = once::<D, _>(&row.key, || SCRIPT.clauses::<D>(&row.key).map(|clauses| said(&clauses)));
    checker.cell(row, "meaning", Against::Drive, done.unwrap_or_default());
    checker.key(row);
}

/// Whether positions are in increments exactly while an entry has a value.
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
