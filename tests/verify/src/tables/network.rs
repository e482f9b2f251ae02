//! The network: NMT commands and states, SDO commands, aborts and examples, node address, and LEDs.

use lexican_runtime::wire::nmt::NmtState;
use siko_ag03_1::Direction;
use siko_ag03_1::sim::{Setup, StatusLed};

use crate::bench::{Bench, NODE};
use crate::checker::{Against, Checker};
use crate::manual::{Manual, Row};
use crate::notation::{bytes, hex, print, yes};

pub(crate) fn check(checker: &mut Checker<'_>, manual: &Manual) {
    nmt_commands(checker);
    nmt_states(checker);
    sdo_commands(checker);
    sdo_aborts(checker);
    sdo_examples(checker, manual);
    node_address(checker, manual);
    leds(checker);
}

const STATES: &[(&str, u8)] = &[("OPERATIONAL", 0x01), ("PRE-OPERATIONAL", 0x80), ("STOPPED", 0x02)];

fn nmt_name(bench: &Bench) -> &'static str {
    match bench.see(|drive, _| drive.nmt_state()) {
        NmtState::Operational => "OPERATIONAL",
        NmtState::PreOperational => "PRE-OPERATIONAL",
        NmtState::Stopped => "STOPPED",
        NmtState::Initialising => "INITIALISATION",
    }
}

fn nmt_commands(checker: &mut Checker<'_>) {
    for (code, transition) in [("01", "1"), ("02", "2"), ("80", "3"), ("81", "4/5"), ("82", "4/5")] {
        let Some(row) = checker.row("nmt.csv", code) else { continue };
        checker.place(row, "7.2.2.6", "17");
        checker.cell(row, "transition", Against::Manual, transition);
        let command = hex(code).unwrap_or(0) as u8;
        let (mut to, mut from, mut own) = (Vec::new(), Vec::new(), true);
        for (name, enter) in STATES {
            for (node, heard) in [(NODE.get(), true), (0, true), (6, false)] {
                let mut bench = Bench::new();
                bench.nmt(*enter);
                bench.hear(0);
                bench.send(0x000, &[command, node]);
                let reset = bench.hear_from(0x705, 0) == [[0]];
                let after = if reset { "INITIALISATION" } else { nmt_name(&bench) };
                own &= heard || after == *name;
                if heard && after != *name {
                    to.push(after);
                    from.push(*name);
                }
            }
        }
        to.dedup();
        from.dedup();
        checker.cell(row, "to", Against::Drive, to.join("; "));
        checker.cell(row, "from", Against::Drive, from.join("; "));
        checker.that(row, "data_2", Against::Drive, own && row.get("data_2") == "node or 0", "node or 0");
    }
}

fn nmt_states(checker: &mut Checker<'_>) {
    if let Some(row) = checker.row("nmt_states.csv", "INITIALISATION") {
        checker.cell(row, "chapter", Against::Manual, "7.2.2.2");
        let heard = Bench::new().hear_from(0x705, 0);
        let boot_up = heard.first().and_then(|data| data.first().copied()).unwrap_or(255);
        checker.cell(row, "heartbeat_status", Against::Drive, boot_up);
        // It has passed before anything can be asked.
        for column in ["sdo", "pdo", "emcy", "heartbeat"] {
            checker.cell(row, column, Against::Manual, "no");
        }
        for column in ["nmt", "keys", "state_machine", "motor"] {
            checker.cell(row, column, Against::Manual, "");
        }
    }
    for ((name, enter), chapter) in STATES.iter().zip(["7.2.2.4", "7.2.2.3", "7.2.2.5"]) {
        let Some(row) = checker.row("nmt_states.csv", name) else { continue };
        checker.cell(row, "chapter", Against::Manual, chapter);
        nmt_state(checker, row, *enter);
    }
}

fn nmt_state(checker: &mut Checker<'_>, row: &Row, enter: u8) {
    use Against::Drive as D;
    let entered = || {
        let mut bench = Bench::new();
        bench.hear(0);
        // 1017h while it can be written.
        let set = bench.write(0x1017, 0, 100, 2);
        if set.is_ok() && enter != 0x80 {
            bench.nmt(0x01);
            bench.enable();
            bench.nmt(enter);
        }
        bench.hear(0);
        bench
    };
    let mut bench = entered();
    let beat = bench.hear_from(0x705, 100).pop().and_then(|data| data.first().copied());
    checker.cell(row, "heartbeat", D, yes(beat.is_some()));
    checker.cell(row, "heartbeat_status", D, beat.unwrap_or(0));
    checker.cell(row, "sdo", D, yes(bench.read(0x1000, 0).is_ok()));
    bench.request(0x185);
    checker.cell(row, "pdo", D, yes(!bench.hear_from(0x185, 200).is_empty()));
    if enter != 0x01 {
        let disabled = bench.status() & 0x4F == 0x40;
        checker.cell(row, "state_machine", D, if disabled { "SWITCH ON DISABLED" } else { "" });
        let released = bench.system() >> 7 & 1 == 1;
        checker.cell(row, "motor", D, if released { "released" } else { "in control" });
    } else {
        checker.cell(row, "state_machine", Against::Manual, "");
        checker.cell(row, "motor", Against::Manual, "");
    }
    let mut bench = entered();
    bench.world(|inputs| inputs.key = Some(Direction::Positive));
    bench.hear(500);
    checker.cell(row, "keys", D, yes(bench.see(|drive, now| drive.position(now)) != 0));
    let mut bench = entered();
    bench.world(|inputs| inputs.internal_error = true);
    checker.cell(row, "emcy", D, yes(!bench.hear_from(0x085, 0).is_empty()));
    let other = if enter == 0x01 { 0x80 } else { 0x01 };
    let before = nmt_name(&bench);
    bench.nmt(other);
    bench.hear(0);
    checker.cell(row, "nmt", D, yes(nmt_name(&bench) != before));
}

fn sdo_commands(checker: &mut Checker<'_>) {
    let answer = |data: &[u8]| {
        let mut bench = Bench::new();
        bench.sdo(data).map_or(String::new(), |answer| format!("{:02X}", answer.first().copied().unwrap_or(0)))
    };
    let read = |index: u16| {
        let [low, high] = index.to_le_bytes();
        answer(&[0x40, low, high, 0, 0, 0, 0, 0])
    };
    // Objects of four, two and one byte.
    let rows = [
        ("23", "write request", "4", answer(&[0x23, 0x7C, 0x60, 0, 0, 0, 0, 0]) == "60"),
        ("2B", "write request", "2", answer(&[0x2B, 0x17, 0x10, 0, 0, 0, 0, 0]) == "60"),
        ("2F", "write request", "1", answer(&[0x2F, 0x0D, 0x10, 0, 0, 0, 0, 0]) == "60"),
        ("60", "write response", "", answer(&[0x23, 0x7C, 0x60, 0, 0, 0, 0, 0]) == "60"),
        ("40", "read request", "", !read(0x1000).is_empty()),
        ("43", "read response", "4", read(0x1000) == "43"),
        ("4B", "read response", "2", read(0x6041) == "4B"),
        ("4F", "read response", "1", read(0x1001) == "4F"),
        ("80", "error response", "", read(0x5FFF) == "80"),
    ];
    for (code, command, data_bytes, agrees) in rows {
        let Some(row) = checker.row("sdo_commands.csv", code) else { continue };
        checker.place(row, "7.2.7", "18");
        checker.cell(row, "command", Against::Drive, command);
        checker.cell(row, "data_bytes", Against::Drive, data_bytes);
        checker.that(row, "hex", Against::Drive, agrees, if agrees { code } else { "42" });
        checker.cell(row, "decimal", Against::Manual, hex(code).map_or(String::new(), |code| code.to_string()));
    }
}

fn sdo_aborts(checker: &mut Checker<'_>) {
    let mut bench = Bench::new();
    let found = [
        ("06090011", bench.read(0x2410, 0x07)),
        ("06010002", bench.write(0x1000, 0, 0, 4).map(|()| 0)),
        ("06010001", bench.read(0x1011, 1)),
        ("06090030", bench.write(0x2410, 4, 101, 1).map(|()| 0)),
        ("06090036", bench.write(0x607D, 2, -1_000_001, 4).map(|()| 0)),
        ("06020000", bench.read(0x2411, 0)),
        ("06010000", bench.write(0x2410, 4, 50, 4).map(|()| 0)),
        ("08000022", bench.write(0x6040, 0, 6, 2).map(|()| 0)),
    ];
    for (code, answer) in found {
        let Some(row) = checker.row("sdo_aborts.csv", code) else { continue };
        checker.place(row, "7.2.7.1", "19");
        checker.that(row, "code", Against::Drive, answer == Err(hex(code).unwrap_or(0)), format!("{answer:08X?}"));
        let wire = hex(code).unwrap_or(0).to_le_bytes();
        for (column, byte) in ["data_1", "data_2", "data_3", "data_4"].into_iter().zip(wire) {
            checker.cell(row, column, Against::Manual, format!("{byte:02X}"));
        }
    }
}

fn sdo_examples(checker: &mut Checker<'_>, manual: &Manual) {
    let mut bench = Bench::new();
    let set = bench.write(0x607C, 0, 2500, 4);
    checker.require(set.is_ok(), || format!("607C:00: {set:08X?}"));
    let mut answer = None;
    for (row, at) in manual.rows("sdo_examples.csv").iter().zip(1..) {
        checker.key(row);
        let to_drive = at % 2 == 1;
        checker.cell(row, "row", Against::Manual, at);
        checker.cell(row, "chapter", Against::Manual, if at < 3 { "7.2.8.1" } else { "7.2.8.2" });
        checker.cell(row, "direction", Against::Manual, if to_drive { "to drive" } else { "from drive" });
        checker.cell(row, "cob_id", Against::Drive, if to_drive { "605" } else { "585" });
        let data = bytes(row.get("data")).unwrap_or_default();
        if to_drive {
            // An SDO has eight bytes.
            let mut whole = data.clone();
            whole.resize(8, 0);
            answer = bench.sdo(&whole);
            checker.cell(row, "data", Against::Drive, print(&whole));
            let expected: &[u8] = if at == 1 { &[0x40, 0x7C, 0x60, 0] } else { &[0x23, 0x7D, 0x60, 2] };
            checker.that(row, "data", Against::Manual, data.get(..4) == Some(expected), print(expected));
        } else {
            checker.cell(row, "data", Against::Drive, print(&answer.unwrap_or_default()));
        }
        let value = data.get(4..8).and_then(|value| value.try_into().ok()).map_or(0, i32::from_le_bytes);
        checker.cell(row, "value", Against::Manual, if value == 0 { String::new() } else { value.to_string() });
    }
    let limit = bench.read(0x607D, 2);
    if let Some(row) = manual.row("sdo_examples.csv", "3") {
        checker.cell(row, "value", Against::Drive, limit.unwrap_or(0));
    }
}

fn node_address(checker: &mut Checker<'_>, manual: &Manual) {
    for (row, address) in manual.rows("node_address.csv").iter().zip([1, 1, 2, 3, 124, 125, 126, 127]) {
        checker.place(row, "7.13", "7.13");
        let mut switches = Some(0_u8);
        for bit in 0..7 {
            switches = match row.get(&format!("sw{}", bit + 1)) {
                "ON" => switches.map(|switches| switches | 1 << bit),
                "OFF" => switches,
                _ => None,
            };
        }
        let Some(switches) = switches else { continue };
        let node = Setup::node_of_switches(switches);
        checker.key(row);
        let boot_up = Bench::with(Setup::new(node)).hear_from(0x700 + u16::from(node.get()), 0) == [[0]];
        checker.cell(row, "address", Against::Drive, if boot_up { node.get() } else { 0 });
        checker.cell(row, "address", Against::Manual, address);
    }
}

fn leds(checker: &mut Checker<'_>) {
    let led = |change: fn(&mut siko_ag03_1::sim::inputs::Inputs)| {
        let mut bench = Bench::new();
        bench.world(change);
        bench.see(|drive, _| drive.status_led())
    };
    let fault = led(|inputs| inputs.internal_error = true);
    let off = led(|inputs| inputs.output_stage_supply_100mv = 0);
    let rows = [
        ("blinking", matches!(fault, StatusLed::Blinks(_))),
        ("on", led(|_| ()) == StatusLed::On),
        ("off", off == StatusLed::Off),
    ];
    for (state, agrees) in rows {
        let Some(row) = checker.row("leds.csv", &format!("status green:{state}")) else { continue };
        checker.place(row, "7.14", "7.14");
        checker.that(row, "state", Against::Drive, agrees, "another light");
    }
}
