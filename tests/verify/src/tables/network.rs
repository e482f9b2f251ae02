//! The network: NMT commands and states, SDO commands, aborts and examples, node address, and LEDs.

use std::collections::BTreeMap;

use lexican_runtime::wire::nmt::NmtState;
use siko_ag03_1::sim::inputs::Key;
use siko_ag03_1::sim::{DipSwitches, Setup, Termination};

use super::sheet::Sheet;
use crate::bench::{Bench, Memory, NODE, once};
use crate::checker::{Against, Checker};
use crate::manual::{Manual, Row};
use crate::notation::{bytes, hex, print, yes};

pub(crate) fn check(checker: &mut Checker<'_>, manual: &Manual, sheet: &Sheet) {
    nmt_commands(checker);
    nmt_states(checker);
    sdo_commands(checker);
    sdo_aborts(checker);
    sdo_examples(checker, manual, sheet);
    node_address(checker, manual);
    bus_termination(checker);
    super::leds::check(checker);
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
    for code in ["01", "02", "80", "81", "82"] {
        let Some(row) = checker.row("nmt.csv", code) else { continue };
        let Followed { from, to, own, starts_cold } = followed(hex(code).unwrap_or(0) as u8);
        checker.cell(row, "to", Against::Drive, to.join("; "));
        checker.cell(row, "from", Against::Drive, from.join("; "));
        // What 81h does is not said; that it does the same is E52.
        let cold_start = if code == "82" && starts_cold { "cold start" } else { "" };
        checker.cell(row, "note", Against::Drive, cold_start);
        checker.that(row, "data_2", Against::Drive, own && row.get("data_2") == "node or 0", "node or 0");
    }
}

/// What the drive makes of an NMT command.
#[derive(Clone)]
struct Followed {
    /// The states that it leaves, and where to.
    from: Vec<&'static str>,
    to: Vec<&'static str>,
    /// It follows no command that is for another node.
    own: bool,
    starts_cold: bool,
}

fn followed(command: u8) -> Followed {
    static MEMORY: Memory<u8, Followed> = Memory::new(BTreeMap::new());
    once(&MEMORY, command, || {
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
        Followed { from, to, own, starts_cold: starts_cold(command) }
    })
}

/// Whether a command does what power-on does: what the EEPROM does not keep is as it was in the beginning.
fn starts_cold(command: u8) -> bool {
    let mut bench = Bench::new();
    let set = [bench.write(0x2450, 0, 50, 1), bench.write(0x2410, 4, 51, 1)];
    bench.nmt(command);
    bench.hear(0);
    set == [Ok(()); 2] && (bench.read(0x2450, 0), bench.read(0x2410, 4)) == (Ok(100), Ok(51))
}

fn nmt_states(checker: &mut Checker<'_>) {
    if let Some(row) = checker.row("nmt_states.csv", "INITIALISATION") {
        let heard = Bench::new().hear_from(0x705, 0);
        let boot_up = heard.first().and_then(|data| data.first().copied()).unwrap_or(255);
        checker.cell(row, "heartbeat_status", Against::Drive, boot_up);
        // It has passed before anything can be asked.
        for column in ["sdo", "pdo", "emcy", "heartbeat"] {
            checker.cell(row, column, Against::Manual, "no");
        }
        for column in ["nmt", "keys", "state_machine", "motor", "bus_led"] {
            checker.cell(row, column, Against::Manual, "");
        }
    }
    for (name, enter) in STATES {
        let Some(row) = checker.row("nmt_states.csv", name) else { continue };
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
    checker.cell(row, "bus_led", D, super::leds::shown(&mut bench, |lights| lights.bus));
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
    bench.world(|inputs| inputs.key = Some(Key::Clockwise));
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
    let write = |command: u8, [low, high]: [u8; 2]| answer(&[command, low, high, 0, 0, 0, 0, 0]) == "60";
    // Objects of four, two and one byte: each command fits one of them only.
    let objects = [(4, 0x607C_u16), (2, 0x1017), (1, 0x100D)];
    let rows = ["23", "2B", "2F", "60", "40", "43", "4B", "4F", "80"];
    for code in rows {
        let Some(row) = checker.row("sdo_commands.csv", code) else { continue };
        let number = hex(code).unwrap_or(0) as u8;
        let written: Vec<u8> =
            objects.iter().filter(|(_, index)| write(number, index.to_le_bytes())).map(|(size, _)| *size).collect();
        let answered = [(4, 0x1000), (2, 0x6041), (1, 0x1001)].into_iter().find(|(_, index)| read(*index) == code);
        let refused = read(0x5FFF) == code;
        let (command, data_bytes) = match (written.as_slice(), answered) {
            ([size], _) => ("write request", size.to_string()),
            (_, Some((size, _))) => ("read response", size.to_string()),
            _ if refused => ("error response", String::new()),
            _ if !answer(&[number, 0x00, 0x10, 0, 0, 0, 0, 0]).starts_with('8') => ("read request", String::new()),
            _ if answer(&[0x23, 0x7C, 0x60, 0, 0, 0, 0, 0]) == code => ("write response", String::new()),
            _ => ("", String::new()),
        };
        checker.cell(row, "command", Against::Drive, command);
        checker.cell(row, "data_bytes", Against::Drive, data_bytes);
        checker.cell(row, "decimal", Against::Manual, number);
    }
}

fn sdo_aborts(checker: &mut Checker<'_>) {
    for code in ["06090011", "06010002", "06010001", "06090030", "06090036", "06020000", "06010000", "08000022"] {
        let Some(row) = checker.row("sdo_aborts.csv", code) else { continue };
        let answer = refused(row.get("meaning"));
        let agrees = answer.is_some_and(|answer| answer == hex(code).unwrap_or(0));
        checker.that(row, "code", Against::Drive, agrees, format!("{answer:08X?}"));
        checker.that(row, "meaning", Against::Drive, agrees, format!("{answer:08X?}"));
        let wire = hex(code).unwrap_or(0).to_le_bytes();
        for (column, byte) in ["data_1", "data_2", "data_3", "data_4"].into_iter().zip(wire) {
            checker.cell(row, column, Against::Manual, format!("{byte:02X}"));
        }
    }
}

/// The code with which the drive refuses what `meaning` describes.
fn refused(meaning: &str) -> Option<u32> {
    let mut bench = Bench::new();
    match meaning {
        "sub-index does not exist" => bench.read(0x2410, 0x07).err(),
        "write of a read-only object" => bench.write(0x1000, 0, 0, 4).err(),
        "read of a write-only object" => bench.read(0x1011, 1).err(),
        "value range exceeded" => bench.write(0x2410, 4, 101, 1).err(),
        "maximum less than minimum" => {
            let both = [bench.write(0x607D, 2, -1_000_001, 4), bench.write(0x607D, 1, 1_000_001, 4)];
            both[0].err().filter(|_| both[0] == both[1])
        }
        "object does not exist" => bench.read(0x2411, 0).err(),
        "unsupported access" => bench.write(0x2410, 4, 50, 4).err(),
        "not possible in the present device state" => bench.write(0x6040, 0, 6, 2).err(),
        _ => None,
    }
}

fn sdo_examples(checker: &mut Checker<'_>, manual: &Manual, sheet: &Sheet) {
    let mut bench = Bench::new();
    let set = bench.write(0x607C, 0, 2500, 4);
    checker.require(set.is_ok(), || format!("607C:00: {set:08X?}"));
    let mut answer = None;
    for (row, at) in manual.rows("sdo_examples.csv").iter().zip(1..) {
        checker.key(row);
        let to_drive = at % 2 == 1;
        checker.cell(row, "row", Against::Manual, at);
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
        checker.cell(row, "meaning", Against::Sheet, example_meaning(sheet, &data));
        let value = data.get(4..8).and_then(|value| value.try_into().ok()).map_or(0, i32::from_le_bytes);
        checker.cell(row, "value", Against::Manual, if value == 0 { String::new() } else { value.to_string() });
    }
    let limit = bench.read(0x607D, 2);
    if let Some(row) = manual.row("sdo_examples.csv", "3") {
        checker.cell(row, "value", Against::Drive, limit.unwrap_or(0));
    }
}

/// What an SDO of the examples does, by the name of its object.
fn example_meaning(sheet: &Sheet, data: &[u8]) -> String {
    let &[command, low, high, sub, ..] = data else { return String::new() };
    let index = u16::from_le_bytes([low, high]);
    let named = sheet.device.object(index).map_or("", |object| match object.entries.iter().find(|e| e.sub == sub) {
        Some(entry) if object.kind.has_subs() => entry.name.as_str(),
        _ => object.name.as_str(),
    });
    let name = named.to_ascii_lowercase();
    match command {
        0x23 => format!("write {name}"),
        0x40 => format!("read {name}"),
        0x42 => name,
        0x60 => "done".into(),
        _ => String::new(),
    }
}

fn node_address(checker: &mut Checker<'_>, manual: &Manual) {
    for (row, address) in manual.rows("node_address.csv").iter().zip([1, 1, 2, 3, 124, 125, 126, 127]) {
        let mut switches = Some(0_u16);
        for bit in 0..7 {
            switches = match row.get(&format!("sw{}", bit + 1)) {
                "ON" => switches.map(|switches| switches | 1 << bit),
                "OFF" => switches,
                _ => None,
            };
        }
        let Some(switches) = switches else { continue };
        let switches = DipSwitches::new(switches);
        let node = switches.node();
        checker.key(row);
        let boot_up =
            Bench::with(Setup { switches, ..Setup::new(NODE) }).hear_from(0x700 + u16::from(node.get()), 0) == [[0]];
        checker.cell(row, "address", Against::Drive, if boot_up { node.get() } else { 0 });
        checker.cell(row, "address", Against::Manual, address);
    }
}

/// The resistor is hardware: what the switches do with it is a table in the drive's crate, which is compared.
fn bus_termination(checker: &mut Checker<'_>) {
    for (key, switches) in [("OFF:OFF", "00"), ("ON:ON", "11")] {
        let Some(row) = checker.row("bus_termination.csv", key) else { continue };
        let found = format!("1010000 0 {switches}").parse::<DipSwitches>().map(DipSwitches::termination);
        let termination = match found {
            Ok(Termination::Deactivated) => "deactivated",
            Ok(Termination::Active) => "active",
            _ => "",
        };
        checker.cell(row, "termination", Against::Code, termination);
    }
    let half = |bits| DipSwitches::new(bits).termination() == Termination::Incomplete;
    checker.require(half(1 << 8) && half(1 << 9), || "bus_termination.csv: one switch alone terminates".into());
}
