//! Values: terms, data descriptions, bit rates and gears, by what the drive does with each value.

use lexican_eds::model::Meaning;
use siko::sim::inputs::Key;
use siko::sim::{BIT_RATES, Setup};

use super::rig::{LOAD, NODE, Rig, Siko, enabled_with, moving_to};
use crate::checker::{Against, Checker};
use crate::drive::Case;
use crate::kinds::objects::address_in;
use crate::kinds::terms::{self, Place};
use crate::kinds::transmission::cob_id;
use crate::manual::Row;
use crate::notation::hex;
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

/// Where types are named that `values.csv` and `formats.csv` do not name.
const PLACES: &[(&str, Place)] = &[
    ("Statusword", Place::Bits("statusword.csv")),
    ("SystemStatus", Place::Bits("system_status.csv")),
    ("Controlword", Place::Bits("controlword.csv")),
    ("EmergencyCode", Place::Row("emergency.csv", "meaning")),
    ("CanBitRate", Place::Row("baud_rates.csv", "kbit")),
    ("GearReduction", Place::Row("gears.csv", "gear")),
    ("RestoreSignature", Place::Cell("values.csv", "1011:01:load", "value")),
];

/// What the driver calls a fault.
fn faults<D: Siko>(checker: &mut Checker<'_>, case: &Case<'_>) {
    for fault in D::MODEL.faults {
        let letter = fault.letter().to_string();
        let Some(row) = checker.row("terms.csv", &format!("Fault:{letter}")) else { continue };
        checker.cell(row, "kind", Against::Code, "fault");
        checker.cell(row, "overlay", Against::Code, fault.code.text);
        checker.cell(row, "printed", Against::Manual, case.manual.cell("faults.csv", &letter, "fault"));
    }
}

/// The bit rates that CiA 306 has keys for, in kbit/s.
const BIT_RATE_KEYS: [u16; 8] = [10, 20, 50, 125, 250, 500, 800, 1000];

/// The file's names and the bit rates of `[DeviceInfo]`.
pub(super) fn file<D: Siko>(checker: &mut Checker<'_>, case: &Case<'_>) {
    let names = case.sheet.overlay.lines().find(|line| line.starts_with("names = ")).unwrap_or_default();
    checker.require(names == D::FILES, || format!("the overlay answers to {names:?}"));
    // The bit rates that have a key, of those that the drive can be set to.
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
    // Of a version such as 1.00, the second character is a dot.
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

/// A value that a data description, or chapter 6, names.
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
    checker.cell(row, "meaning", Against::Drive, done::<D>(&row.key));
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
fn done<D: Siko>(key: &str) -> &'static str {
    once::<D, _>(key, || by_motion::<D>(key).or_else(|| special::<D>(key)).unwrap_or_default())
}

/// Values that show in how the drive moves.
fn by_motion<D: Siko>(key: &str) -> Option<&'static str> {
    let (address, value) = key.rsplit_once(':')?;
    let value = match value {
        "i" => 0,
        "e" => 1,
        number => number.parse::<i64>().ok()?,
    };
    let found = match address {
        "2416:00" => {
            let way = |a_inch| {
                let mut rig = enabled_with::<D>(&[(0x2416, 0, value, 1), (0x2410, 8, a_inch, 1)]);
                rig.control(0x400F);
                rig.hear(2000);
                rig.control(0x000F);
                rig.way_to_rest()
            };
            match (way(50), way(25)) {
                (50, 50) => "stop with maximum delay",
                (100, 200) => "stop with programmed delay, parameter 8",
                _ => "",
            }
        }
        "2417:00" => {
            let mut rig = enabled_with::<D>(&[(0x2417, 0, value, 1)]);
            rig.travel(100);
            rig.hear(10_000);
            let current = rig.read(0x241E, 0).is_ok_and(|current| current > 0);
            match (current, rig.turn(10), rig.system() >> 7 & 1) {
                (true, false, 0) => "position control to setpoint",
                (false, false, 0) => "position control off; motor windings shorted",
                (false, true, 1) => "position control off; drive released",
                _ => "",
            }
        }
        "2413:00" => {
            let beyond = |target: i32| {
                let mut rig = enabled_with::<D>(&[(0x2413, 0, value, 1)]);
                rig.travel(target);
                (0..200).any(|_| {
                    rig.hear(50);
                    rig.position().abs() > target.abs()
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
            let mut rig = enabled_with::<D>(&[(0x2412, 0, value, 2)]);
            rig.travel(1600);
            rig.hear(10_000);
            let turned = rig.shaft();
            if turned == 1600.0 { "positions in increments" } else { "" }
        }
        "2421:00" => {
            let stops = |threshold| {
                let mut rig = enabled_with::<D>(&[(0x2421, 0, threshold, 1)]);
                rig.travel(100_000);
                rig.world(|inputs| inputs.load_ma = 2400);
                rig.hear(2000);
                rig.read(0x2422, 0) == Ok(1)
            };
            if !stops(value) && stops(110) { "torque deactivation off" } else { "" }
        }
        "2410:0A" => {
            let way = |a_pos, d_pos| {
                let mut rig = enabled_with::<D>(&[(0x2410, 4, a_pos, 1), (0x2410, 0x0A, d_pos, 1)]);
                rig.travel(100_000);
                rig.hear(3000);
                rig.control(0x011F);
                rig.way_to_rest()
            };
            let ways = [way(50, value), way(25, value), way(25, 100)];
            if ways == [100, 200, 50] { "delay by parameter 4" } else { "" }
        }
        "6060:00" => {
            let runs = |id, word, target| {
                let mut rig = enabled_with::<D>(&[(0x6060, 0, value, 1)]);
                rig.control(0x010F);
                rig.command(id, word, target);
                rig.hear(20_000);
                (rig.position(), rig.velocity())
            };
            match (runs(0x405, 0x001F, 500), runs(0x505, 0x000F, 20)) {
                ((500, 0), (0, 0)) => "profile position",
                (_, (_, 20)) => "profile velocity",
                _ => "",
            }
        }
        "607E:00" => {
            let mut rig = Rig::<D>::new();
            if D::MODEL.keys {
                rig.set(&[(0x607E, 0, value, 1)]);
                rig.hear(0);
                rig.world(|inputs| inputs.key = Some(Key::CounterClockwise));
                rig.hear(1000);
            } else {
                // Counter-clockwise as it is delivered, where i counts up.
                rig = moving_to::<D>(1000, 10_000);
                rig.set(&[(0x607E, 0, value, 1)]);
            }
            match (rig.position() > 0, key.ends_with(char::is_alphabetic)) {
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
fn special<D: Siko>(key: &str) -> Option<&'static str> {
    let mut rig = Rig::<D>::operational();
    match key {
        "1003:00:0" => {
            rig.world(|inputs| inputs.sensor_fails = true);
            let before = rig.read(0x1003, 0);
            let cleared = rig.write(0x1003, 0, 0, 1).is_ok() && rig.read(0x1003, 0) == Ok(0);
            (before == Ok(1) && cleared).then_some("written: clears the fault buffer")
        }
        "100C:00:0" => stays_enabled(&mut rig, 0, 3).then_some("node guarding off"),
        "100D:00:0" => stays_enabled(&mut rig, 100, 0).then_some("life guarding off"),
        "1017:00:0" => {
            let on = rig.write(0x1017, 0, 100, 2).is_ok() && !rig.hear_from(0x705, 1000).is_empty();
            let off = rig.write(0x1017, 0, 0, 2).is_ok() && rig.hear_from(0x705, 1000).is_empty();
            (on && off).then_some("heartbeat off")
        }
        "1011:01:load" | "1011:02:load" | "1011:03:load" => Some(restored_set(&mut rig, key)),
        "1011:04:load" => {
            let set = rig.set(&[(0x607C, 0, 500, 4), (0x1011, 4, LOAD, 4)]);
            (set && rig.read(0x6064, 0) == Ok(500)).then_some("calibrate")
        }
        "1800:05:0" | "1802:05:0" | "1803:05:0" => event_timer_off::<D>(key).then_some("event timer off"),
        _ => None,
    }
}

fn stays_enabled<D: Siko>(rig: &mut Rig<D>, guard_time_ms: i64, life_time_factor: i64) -> bool {
    rig.enable();
    let set = rig.set(&[(0x100C, 0, guard_time_ms, 2), (0x100D, 0, life_time_factor, 1)]);
    rig.request(0x705);
    rig.hear(5000);
    set && rig.status() & 0x6F == 0x27
}

fn restored_set<D: Siko>(rig: &mut Rig<D>, key: &str) -> &'static str {
    // One parameter of each set: the window (standard), and a-Pos (controller).
    let changed = rig.set(&[(0x6067, 0, 11, 2), (0x2410, 4, 51, 1)]);
    let sub = key.get(6..7).and_then(|digit| digit.parse().ok()).unwrap_or(0);
    let loaded = rig.write(0x1011, sub, LOAD, 4).is_ok();
    match (changed && loaded, rig.read(0x6067, 0), rig.read(0x2410, 4)) {
        (true, Ok(10), Ok(50)) => "all parameters to default",
        (true, Ok(10), Ok(51)) => "standard parameters to default",
        (true, Ok(11), Ok(50)) => "controller parameters to default",
        _ => "",
    }
}

fn event_timer_off<D: Siko>(key: &str) -> bool {
    let Some(index) = key.get(..4).and_then(hex).and_then(|index| u16::try_from(index).ok()) else { return false };
    let id = cob_id::<D>(index);
    let count = |timer| {
        let mut rig = Rig::<D>::new();
        let set = rig.set(&[(index, 2, 255, 1), (index, 5, timer, 2)]);
        rig.nmt(0x01);
        if set { rig.hear_from(id, 1000).len() } else { usize::MAX }
    };
    (count(100), count(0)) == (10, 0)
}
