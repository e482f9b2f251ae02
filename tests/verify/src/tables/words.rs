//! Bits: the system status word (table 1), the statusword (table 21), the controlword (table 23), and what must
//! hold before anything moves (chapter 2.2).

use std::collections::BTreeMap;

use lexican_eds::model::Device;

use super::claims;
use super::claims::with;
use super::sheet::Sheet;
use super::states::{held, in_velocity_mode, moving_to, running_at, with_inputs};
use crate::bench::{Bench, Memory, once};
use crate::checker::{Against, Checker};
use crate::manual::{Manual, Row};

pub(crate) fn check(checker: &mut Checker<'_>, manual: &Manual, sheet: &Sheet) {
    for row in manual.rows("system_status.csv") {
        system_status(checker, manual, &sheet.device, row);
    }
    for row in manual.rows("statusword.csv") {
        statusword(checker, manual, &sheet.device, row);
    }
    for row in manual.rows("controlword.csv") {
        controlword(checker, &sheet.device, row);
    }
    for row in manual.rows("start_conditions.csv") {
        start_condition(checker, manual, row);
    }
}

/// The overlay's name of a bit.
fn name_of<'d>(device: &'d Device, field: &str, bit: &str) -> Option<&'d str> {
    let fields = &device.bit_fields.get(field)?.fields;
    fields.iter().find(|named| named.value.low.to_string() == bit).map(|named| named.name.as_str())
}

/// Beyond a limit: the position is 0, and the limits lie elsewhere.
pub(super) fn beyond(above: bool, mut bench: Bench) -> Bench {
    for (sub, limit) in if above { [(1, -1000), (2, -500)] } else { [(2, 1000), (1, 500)] } {
        // The values lie within their ranges.
        let _ = bench.write(0x607D, sub, limit, 4);
    }
    bench
}

pub(super) fn in_loop(ms: u64) -> Bench {
    let mut bench = Bench::enabled();
    let _ = bench.write(0x2413, 0, 1, 1);
    bench.command(0x405, 0x001F, -5000);
    bench.hear(ms);
    bench
}

pub(super) fn overcurrent() -> Bench {
    let mut bench = moving_to(5000, 500);
    bench.world(|inputs| inputs.load_ma = 2401);
    bench
}

fn system_status(checker: &mut Checker<'_>, manual: &Manual, device: &Device, row: &Row) {
    let (bit, value, mode) = (row.get("bit"), row.get("value"), row.get("mode"));
    let named = name_of(device, "SystemStatus", bit);
    checker.that(
        row,
        "bit",
        Against::Sheet,
        named.is_some() != matches!(bit, "0" | "1" | "2"),
        named.unwrap_or("no name"),
    );
    let Some(word) = shown(bit, value, mode) else { return };
    checker.key(row);
    let found = row.number::<u16>("bit").map_or(0, |bit| word.checked_shr(bit.into()).unwrap_or(0) & 1);
    checker.cell(row, "value", Against::Drive, found);
    let said = claims::system(bit, value, mode).unwrap_or_default();
    checker.cell(row, "meaning", Against::Drive, said);
    let term = manual.row("terms.csv", &format!("SystemStatus:{bit}")).map_or("", |term| term.get("printed"));
    checker.cell(row, "name", Against::Manual, term);
}

/// The system status word in a situation that shows what a row is about.
fn shown(bit: &str, value: &str, mode: &str) -> Option<u16> {
    static MEMORY: Memory<[String; 3], Option<u16>> = Memory::new(BTreeMap::new());
    once(&MEMORY, [bit, value, mode].map(str::to_owned), || {
        let bench = match (bit, value, mode) {
            ("0" | "1" | "2", "0", "") | ("5" | "6" | "9" | "14", "0", "positioning") => Bench::new(),
            ("3", "1", "positioning") | ("7" | "11", "0", "") | ("11", "0", "positioning") => Bench::enabled(),
            ("3", "0", "positioning") | ("4", "1", "") | ("14", "1", "positioning") => moving_to(5000, 1000),
            ("3", "1", "velocity") => running_at(30, 10_000),
            ("3", "0", "velocity") => running_at(68, 100),
            ("4" | "8" | "10" | "12" | "13" | "15", "0", "") | ("7", "1", "") => Bench::new(),
            ("5", "1", "positioning") => beyond(true, Bench::new()),
            ("6", "1", "positioning") => beyond(false, Bench::new()),
            ("5", "0", "velocity") => beyond(true, in_velocity_mode()),
            ("6", "0", "velocity") => beyond(false, in_velocity_mode()),
            ("8" | "11", "1", "") => with_inputs(|inputs| inputs.internal_error = true),
            ("9", "1", "positioning") => in_loop(1000),
            ("9" | "14", "0", "velocity") => running_at(30, 1000),
            ("10", "1", "") => with_inputs(|inputs| inputs.output_stage_supply_100mv = 0),
            ("12", "1", "") => with_inputs(|inputs| inputs.battery_10mv = 250),
            ("13", "1", "") => overcurrent(),
            ("15", "1", "") => held(),
            _ => return None,
        };
        Some(bench.system())
    })
}

/// Whether a fault stays while CW.7 is 1 all the time, and goes with its next edge.
pub(super) fn acknowledged_by_edge_only() -> bool {
    let mut bench = Bench::enabled();
    bench.control(0x0080);
    bench.world(|inputs| inputs.internal_error = true);
    bench.world(|inputs| inputs.internal_error = false);
    bench.control(0x0080);
    let stays = bench.status() & 0x08 != 0;
    bench.control(0x0000);
    bench.control(0x0080);
    stays && bench.status() & 0x08 == 0
}

/// Situations in which the bit is 1, and in which it is 0; none where it is never 1.
fn situations(bit: &str, mode: &str) -> Option<(Option<Bench>, Bench)> {
    let words = |words: &[u16]| {
        let mut bench = Bench::operational();
        words.iter().for_each(|word| bench.control(*word));
        bench
    };
    Some(match (bit, mode) {
        ("0", "") => (Some(words(&[0x0106])), Bench::operational()),
        ("1", "") => (Some(words(&[0x0106, 0x0107])), words(&[0x0106])),
        ("2", "") => (Some(Bench::enabled()), words(&[0x0106, 0x0107])),
        ("3", "") => (Some(with_inputs(|inputs| inputs.internal_error = true)), Bench::enabled()),
        ("4", "") => (Some(Bench::new()), with_inputs(|inputs| inputs.output_stage_supply_100mv = 100)),
        ("5", "") => (Some(Bench::enabled()), words(&[0x0106, 0x0107, 0x010F, 0x0102])),
        ("6", "") => (Some(Bench::operational()), Bench::enabled()),
        ("7", "") => (Some(with_inputs(|inputs| inputs.battery_10mv = 250)), Bench::enabled()),
        ("8", "positioning") => (Some(Bench::enabled()), moving_to(5000, 1000)),
        ("8" | "12", "velocity") => (Some(in_velocity_mode()), running_at(30, 1000)),
        ("9", "") => (Some(Bench::operational()), Bench::new()),
        ("10", "positioning") => (Some(moving_to(1000, 20_000)), moving_to(5000, 1000)),
        ("10", "velocity") => (Some(running_at(30, 10_000)), running_at(68, 100)),
        ("11", "") => (Some(beyond(true, Bench::enabled())), Bench::enabled()),
        ("12" | "14" | "15", "positioning") => (Some(moving_to(5000, 1000)), Bench::enabled()),
        ("13", "") => (None, moving_to(5000, 1000)),
        ("14" | "15", "velocity") => (None, running_at(30, 1000)),
        _ => return None,
    })
}

/// The status words of both situations.
fn words(bit: &str, mode: &str) -> Option<[Option<u16>; 2]> {
    static MEMORY: Memory<[String; 2], Option<[Option<u16>; 2]>> = Memory::new(BTreeMap::new());
    once(&MEMORY, [bit, mode].map(str::to_owned), || {
        let (set, clear) = situations(bit, mode)?;
        Some([set, Some(clear)].map(|bench| bench.map(|bench| bench.status())))
    })
}

fn statusword(checker: &mut Checker<'_>, manual: &Manual, device: &Device, row: &Row) {
    let (bit, mode) = (row.get("bit"), row.get("mode"));
    let Some(words) = words(bit, mode) else { return };
    checker.key(row);
    let at = row.number::<u16>("bit").unwrap_or(0);
    let found = words.map(|word| word.map(|word| word >> at & 1));
    let is_set = words[0].is_some();
    let agrees = found == [is_set.then_some(1), Some(0)];
    checker.that(row, "bit", Against::Drive, agrees, format!("{found:?}"));
    checker.cell(row, "meaning_of_1", Against::Drive, claims::status(bit, mode).unwrap_or_default());
    let term = manual.row("terms.csv", &format!("Statusword:{bit}")).map_or("", |term| term.get("printed"));
    let name = row.get("name");
    let printed = match name {
        "reserved" => term.is_empty(),
        "" => !is_set,
        name => term.split(" / ").any(|part| part == name),
    };
    checker.that(row, "name", Against::Manual, printed, term);
    let named = name_of(device, "Statusword", bit).is_some();
    checker.that(row, "name", Against::Sheet, named == (name != "reserved"), "the overlay has another name");
}

fn controlword(checker: &mut Checker<'_>, device: &Device, row: &Row) {
    let (bit, mode) = (row.get("bit"), row.get("mode"));
    // Of some bits each mode has a row of its own.
    let modes: &[&str] =
        if matches!(bit, "4" | "8" | "13" | "14" | "15") { &["positioning", "velocity"] } else { &[""] };
    if !modes.contains(&mode) {
        return;
    }
    let found = effect(bit, mode);
    if found != "none" || matches!(bit, "4" | "5" | "6" | "9" | "10" | "11" | "12" | "13" | "14" | "15") {
        checker.key(row);
    }
    checker.cell(row, "action", Against::Drive, claims::control(bit, mode).unwrap_or_default());
    let plain = |name: &str| name.to_ascii_lowercase().replace(" operation", "");
    let overlay = name_of(device, "Controlword", bit);
    let agrees = match row.get("name") {
        "reserved" => overlay.is_none() && found == "none",
        "" => overlay.is_some() && found == "none",
        name => overlay.is_some_and(|overlay| plain(overlay) == plain(name)),
    };
    checker.that(row, "name", Against::Sheet, agrees, overlay.unwrap_or("no name"));
}

/// What a bit of the controlword does to a drive in OPERATION ENABLED.
pub(super) fn effect(bit: &str, mode: &str) -> &'static str {
    static MEMORY: Memory<[String; 2], &str> = Memory::new(BTreeMap::new());
    once(&MEMORY, [bit, mode].map(str::to_owned), || tried(bit, mode))
}

fn tried(bit: &str, mode: &str) -> &'static str {
    let mask = bit.parse::<u16>().ok().and_then(|bit| 1_u16.checked_shl(bit.into())).unwrap_or(0);
    let mut bench = if mode == "velocity" { in_velocity_mode() } else { Bench::enabled() };
    let state = |bench: &Bench| bench.status() & 0x6F;
    match bit {
        "0" | "1" | "2" | "3" => {
            bench.control(0x010F & !mask);
            return if state(&bench) == 0x27 { "none" } else { "commands" };
        }
        "7" => {
            bench.world(|inputs| inputs.internal_error = true);
            bench.world(|inputs| inputs.internal_error = false);
            bench.control(mask);
            return if state(&bench) & 0x4F == 0x40 { "resets" } else { "none" };
        }
        "8" if mode == "positioning" => {
            bench.command(0x405, 0x001F, 5000);
            bench.hear(500);
            bench.control(0x011F);
            bench.hear(3000);
            let stopped = bench.see(|drive, now| drive.shaft(now).velocity == 0.0 && drive.position(now) < 5000);
            bench.control(0x001F);
            bench.hear(20_000);
            let arrived = bench.see(|drive, now| drive.position(now)) == 5000;
            return if stopped && arrived { "interrupts and resumes" } else { "none" };
        }
        "8" => {
            bench.command(0x505, 0x000F, 30);
            bench.hear(1000);
            return if bench.see(|drive, now| drive.velocity(now)) > 0 { "runs" } else { "none" };
        }
        _ => {}
    }
    // One that is written for a while, and then cleared.
    let (positioning, target) = (mode != "velocity", if mode == "velocity" { 0x60FF } else { 0x607A });
    let _ = bench.write(target, 0, if positioning { 3000 } else { 30 }, 4);
    bench.control(if positioning { 0x000F | mask } else { 0x010F | mask });
    bench.hear(500);
    let moves = bench.see(|drive, now| drive.shaft(now).velocity.abs() > 0.0);
    bench.hear(20_000);
    let after = bench.see(|drive, now| (drive.position(now), drive.shaft(now).velocity.abs() > 0.0));
    match after {
        _ if !moves => "none",
        (3000, false) => "travels",
        (1600, false) => "steps",
        (position, true) if (position > 0) == (bit == "14") => "inches",
        _ => "otherwise",
    }
}

/// What table 1 calls the bit that a start condition is about.
fn is_about(meaning: &str) -> &'static str {
    match meaning {
        "no fault" => "Fault",
        "output stage supplied" => "Supply voltage of the output stage",
        "not above upper limit" => "upper limit",
        "not below lower limit" => "lower limit",
        "no active travel job" => "status",
        _ => "",
    }
}

fn start_condition(checker: &mut Checker<'_>, manual: &Manual, row: &Row) {
    let (operation, bit) = (row.get("operation"), row.get("bit"));
    if operation.ends_with(" ready") {
        return ready(checker, row, operation);
    }
    let Some(violation) = violation(operation, row.get("meaning")) else { return };
    checker.key(row);
    let at = row.number::<u16>("bit").unwrap_or(0);
    let [clear, set] = [violation.met, violation.unmet].map(|word| word.checked_shr(at.into()).unwrap_or(0) & 1);
    let shows = set != clear;
    checker.cell(row, "value", Against::Drive, clear);
    checker.that(row, "bit", Against::Drive, shows, format!("{clear}, else {set}"));
    let named = manual.rows("system_status.csv").iter().find(|named| named.get("bit") == bit);
    let named = named.map_or("", |named| named.get("name"));
    checker.that(row, "bit", Against::Manual, named == is_about(row.get("meaning")), named);
    checker.that(row, "meaning", Against::Drive, violation.refused, "starts nevertheless");
    checker.cell(row, "word", Against::Drive, "1002");
}

/// A start although a condition is not met.
#[derive(Clone)]
struct Violation {
    /// The system status word while the condition is met, and while it is not.
    met: u16,
    unmet: u16,
    /// The drive does what it would do without the start.
    refused: bool,
}

fn violation(operation: &str, meaning: &str) -> Option<Violation> {
    static MEMORY: Memory<[String; 2], Option<Violation>> = Memory::new(BTreeMap::new());
    once(&MEMORY, [operation, meaning].map(str::to_owned), || {
        let start: fn(&mut Bench) = match operation {
            "positioning" => |bench| bench.command(0x405, 0x001F, 100),
            "inching" => |bench| bench.control(0x200F),
            "velocity" => |bench| bench.command(0x505, 0x000F, 60),
            _ => return None,
        };
        let make = || if operation == "velocity" { in_velocity_mode() } else { Bench::enabled() };
        // What the meaning rules out; the bit is compared with what it shows then.
        let situation = || {
            Some(match meaning {
                "no fault" => with(make(), |inputs| inputs.internal_error = true),
                "output stage supplied" => with(make(), |inputs| inputs.output_stage_supply_100mv = 0),
                "not above upper limit" => beyond(true, make()),
                "not below lower limit" => beyond(false, make()),
                "no active travel job" if operation == "velocity" => running_at(30, 1000),
                "no active travel job" => moving_to(5000, 1000),
                _ => return None,
            })
        };
        let mut bench = situation()?;
        let (met, unmet) = (make().system(), bench.system());
        let ends = |bench: &mut Bench| {
            bench.hear(20_000);
            bench.see(|drive, now| (drive.position(now), drive.velocity(now)))
        };
        let undisturbed = ends(&mut bench);
        let mut bench = situation()?;
        start(&mut bench);
        Some(Violation { met, unmet, refused: ends(&mut bench) == undisturbed })
    })
}

fn ready(checker: &mut Checker<'_>, row: &Row, operation: &str) {
    let (value, all) = readiness(operation == "velocity ready");
    checker.cell(row, "bit", Against::Drive, "11");
    checker.key(row);
    // ZSW is a word that the drive does not have.
    if operation == "velocity ready" {
        checker.cell(row, "value", Against::Drive, value);
        checker.cell(row, "word", Against::Drive, "1002");
    } else {
        checker.cell(row, "word", Against::Manual, "ZSW");
        checker.cell(row, "value", Against::Manual, 1);
    }
    checker.cell(row, "meaning", Against::Drive, if all { "all conditions met" } else { "some conditions met" });
}

/// Bit 11 of a drive that is ready, where 0 says that nothing is missing; and whether it says so only when all
/// conditions are met, which are those of the rows above.
fn readiness(in_velocity: bool) -> (u16, bool) {
    static MEMORY: Memory<bool, (u16, bool)> = Memory::new(BTreeMap::new());
    once(&MEMORY, in_velocity, || {
        let make = || if in_velocity { in_velocity_mode() } else { Bench::enabled() };
        let bit = |bench: &Bench| bench.system() >> 11 & 1;
        let unmet = [
            with(make(), |inputs| inputs.internal_error = true),
            with(make(), |inputs| inputs.output_stage_supply_100mv = 0),
            if in_velocity { running_at(30, 1000) } else { moving_to(5000, 1000) },
        ];
        let value = bit(&make());
        (value, value == 0 && unmet.iter().all(|bench| bit(bench) == 1))
    })
}
