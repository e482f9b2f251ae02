//! Bits: the system status word (table 1), the statusword (table 21), the controlword (table 23), and what must
//! hold before anything moves (chapter 2.2).

use lexican_eds::model::Device;

use super::sheet::Sheet;
use super::states::{held, in_velocity_mode, moving_to, running_at, with_inputs};
use crate::bench::Bench;
use crate::checker::{Against, Checker};
use crate::manual::{Manual, Row};

pub(crate) fn check(checker: &mut Checker<'_>, manual: &Manual, sheet: &Sheet) {
    for row in manual.rows("system_status.csv") {
        system_status(checker, &sheet.device, row);
    }
    for row in manual.rows("statusword.csv") {
        statusword(checker, manual, &sheet.device, row);
    }
    for row in manual.rows("controlword.csv") {
        controlword(checker, &sheet.device, row);
    }
    for row in manual.rows("start_conditions.csv") {
        start_condition(checker, row);
    }
}

/// The overlay's name of a bit.
fn name_of<'d>(device: &'d Device, field: &str, bit: &str) -> Option<&'d str> {
    let fields = &device.bit_fields.get(field)?.fields;
    fields.iter().find(|named| named.value.low.to_string() == bit).map(|named| named.name.as_str())
}

/// Beyond a limit: the position is 0, and the limits lie elsewhere.
fn beyond(above: bool, mut bench: Bench) -> Bench {
    for (sub, limit) in if above { [(1, -1000), (2, -500)] } else { [(2, 1000), (1, 500)] } {
        // The values lie within their ranges.
        let _ = bench.write(0x607D, sub, limit, 4);
    }
    bench
}

fn in_loop(ms: u64) -> Bench {
    let mut bench = Bench::enabled();
    let _ = bench.write(0x2413, 0, 1, 1);
    bench.command(0x405, 0x001F, -5000);
    bench.hear(ms);
    bench
}

fn overcurrent() -> Bench {
    let mut bench = moving_to(5000, 500);
    bench.world(|inputs| inputs.load_ma = 2401);
    bench
}

fn system_status(checker: &mut Checker<'_>, device: &Device, row: &Row) {
    checker.place(row, "2.1", "1");
    let (bit, value, mode) = (row.get("bit"), row.get("value"), row.get("mode"));
    let named = name_of(device, "SystemStatus", bit);
    checker.that(
        row,
        "bit",
        Against::Sheet,
        named.is_some() != matches!(bit, "0" | "1" | "2"),
        named.unwrap_or("no name"),
    );
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
        _ => return,
    };
    checker.key(row);
    let word = bench.system();
    let found = row.number::<u16>("bit").map_or(0, |bit| word.checked_shr(bit.into()).unwrap_or(0) & 1);
    checker.cell(row, "value", Against::Drive, found);
    match (bit, value) {
        // 1 is released, which the English manual calls enabled.
        ("7", "1") => {
            let released = named == Some("motor released");
            checker.that(
                row,
                "meaning",
                Against::Sheet,
                !released || row.get("meaning").contains("released"),
                "motor released",
            );
        }
        ("8", "1") => {
            let by_edge = acknowledged_by_edge_only();
            checker.that(
                row,
                "meaning",
                Against::Drive,
                !by_edge || !row.get("meaning").contains("CW.7=1"),
                "by an edge of CW.7",
            );
        }
        _ => {}
    }
}

/// Whether a fault stays while CW.7 is 1 all the time, and goes with its next edge.
fn acknowledged_by_edge_only() -> bool {
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

fn statusword(checker: &mut Checker<'_>, manual: &Manual, device: &Device, row: &Row) {
    checker.place(row, "7.4", "21");
    let (bit, mode) = (row.get("bit"), row.get("mode"));
    let Some((set, clear)) = situations(bit, mode) else { return };
    checker.key(row);
    let at = row.number::<u16>("bit").unwrap_or(0);
    let found = [set.as_ref().map(|bench| bench.status() >> at & 1), Some(clear.status() >> at & 1)];
    let agrees = found == [set.is_some().then_some(1), Some(0)];
    checker.that(row, "bit", Against::Drive, agrees, format!("{found:?}"));
    let statically_0 = row.get("meaning_of_1") == "statically 0";
    checker.that(row, "meaning_of_1", Against::Drive, statically_0 == set.is_none(), "another behaviour");
    let term = manual.row("terms.csv", &format!("Statusword:{bit}")).map_or("", |term| term.get("printed"));
    let name = row.get("name");
    let printed = match name {
        "reserved" => term.is_empty(),
        "" => set.is_none(),
        name => term.split(" / ").any(|part| part == name),
    };
    checker.that(row, "name", Against::Manual, printed, term);
    let named = name_of(device, "Statusword", bit).is_some();
    checker.that(row, "name", Against::Sheet, named == (name != "reserved"), "the overlay has another name");
}

fn controlword(checker: &mut Checker<'_>, device: &Device, row: &Row) {
    checker.place(row, "7.5", "23");
    let (bit, mode) = (row.get("bit"), row.get("mode"));
    let found = effect(bit, mode);
    if found != "none" || matches!(bit, "4" | "5" | "6" | "9" | "10" | "11" | "12" | "13" | "14" | "15") {
        checker.key(row);
    }
    let action = match row.get("action") {
        "table 24" => "commands",
        "" | "no meaning" => "none",
        text if text.starts_with("0 to 1 in FAULT") => "resets",
        text if text.starts_with("0 to 1 starts positioning") => "travels",
        text if text.starts_with("1 interrupts") => "interrupts and resumes",
        text if text.starts_with("1 to 0 starts moving") => "runs",
        text if text.starts_with("0 to 1 starts inching 1") => "steps",
        text if text.starts_with("0 to 1 starts; travels until 0") => "inches",
        _ => "",
    };
    checker.that(row, "action", Against::Drive, action == found, found);
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
fn effect(bit: &str, mode: &str) -> &'static str {
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

fn start_condition(checker: &mut Checker<'_>, row: &Row) {
    let (operation, bit) = (row.get("operation"), row.get("bit"));
    let chapter = match operation {
        "positioning" | "positioning ready" => "2.2.1",
        "inching" => "2.2.1.2",
        _ => "2.2.2",
    };
    checker.cell(row, "chapter", Against::Manual, chapter);
    let start: fn(&mut Bench) = match operation {
        "positioning" => |bench| bench.command(0x405, 0x001F, 100),
        "inching" => |bench| bench.control(0x200F),
        "velocity" => |bench| bench.command(0x505, 0x000F, 30),
        "positioning ready" | "velocity ready" => return ready(checker, row, operation),
        _ => return,
    };
    let make = || if operation == "velocity" { in_velocity_mode() } else { Bench::enabled() };
    let mut violated = match bit {
        "8" | "10" => {
            let mut bench = make();
            bench.world(|inputs| match bit {
                "8" => inputs.internal_error = true,
                _ => inputs.output_stage_supply_100mv = 0,
            });
            bench
        }
        "5" => beyond(true, make()),
        "6" => beyond(false, make()),
        "14" if operation == "velocity" => running_at(30, 1000),
        "14" => moving_to(5000, 1000),
        _ => return,
    };
    checker.key(row);
    let at = row.number::<u16>("bit").unwrap_or(0);
    let clear = make().system() >> at & 1;
    let set = violated.system() >> at & 1;
    // In velocity mode bit 14 has no meaning (table 1): it is 0 in any case.
    let shows = set != clear || (operation, bit) == ("velocity", "14");
    checker.that(
        row,
        "value",
        Against::Drive,
        shows && row.number("value") == Some(clear),
        format!("{clear}, else {set}"),
    );
    start(&mut violated);
    violated.hear(20_000);
    let position = violated.see(|drive, now| drive.position(now));
    let refused =
        if operation == "velocity" && bit == "14" { true } else { position == if bit == "14" { 5000 } else { 0 } };
    checker.that(row, "bit", Against::Drive, refused, "starts nevertheless");
    checker.cell(row, "word", Against::Drive, "1002");
}

fn ready(checker: &mut Checker<'_>, row: &Row, operation: &str) {
    let bench = if operation == "velocity ready" { in_velocity_mode() } else { Bench::enabled() };
    // 0 says that nothing is missing; ZSW is a word that the drive does not have.
    let (bit, value) = ("11", bench.system() >> 11 & 1);
    checker.cell(row, "bit", Against::Drive, bit);
    checker.key(row);
    if operation == "velocity ready" {
        checker.cell(row, "value", Against::Drive, value);
        checker.cell(row, "word", Against::Drive, "1002");
    } else {
        checker.cell(row, "word", Against::Manual, "ZSW");
        checker.cell(row, "value", Against::Manual, 1);
    }
}
