//! Faults: table 2 with its conditions and blink codes, and the emergency codes of table 20.

use std::collections::BTreeMap;

use lexican_runtime::wire::emcy::CodeOrder;
use siko_ag03_1::fault::Fault;
use siko_ag03_1::sim::Setup;
use siko_ag03_1::sim::inputs::{BusState, Inputs, Shaft};

use super::sheet::Sheet;
use crate::bench::{Bench, Memory, NODE, once};
use crate::checker::{Against, Checker};
use crate::manual::{Manual, Row};
use crate::notation::yes;

pub(crate) fn check(checker: &mut Checker<'_>, manual: &Manual, _: &Sheet) {
    for fault in Fault::ALL {
        if let Some(row) = checker.row("faults.csv", &fault.letter.to_string()) {
            table_2(checker, manual, row, fault);
        }
    }
    let others = [(0x0000, ""), (0x8120, ""), (0x8140, ""), (0xFF00, "")];
    let faults = Fault::ALL.iter().map(|fault| (fault.code, fault.letter.to_string()));
    for (code, letter) in faults.chain(others.map(|(code, letter)| (code, letter.to_owned()))) {
        if let Some(row) = checker.row("emergency.csv", &format!("{code:04X}")) {
            table_20(checker, manual, row, code, &letter);
        }
    }
}

/// The world shortly before a fault, and in it.
fn causes(letter: char) -> [fn(&mut Inputs); 2] {
    match letter {
        'A' => [|inputs| inputs.output_stage_supply_100mv = 180, |inputs| inputs.output_stage_supply_100mv = 179],
        'B' => [|inputs| inputs.shaft = Shaft::Free, |inputs| inputs.shaft = Shaft::Blocked],
        'C' => [|inputs| inputs.load_ma = 2400, |inputs| inputs.load_ma = 2401],
        'D' => [|inputs| inputs.temperature_100mdegc = 900, |inputs| inputs.temperature_100mdegc = 901],
        'E' => [|_| (), |inputs| inputs.sensor_fails = true],
        'F' => [|_| (), |inputs| inputs.internal_error = true],
        'G' => [|inputs| inputs.output_stage_supply_100mv = 350, |inputs| inputs.output_stage_supply_100mv = 351],
        'H' => [|_| (), |inputs| inputs.bus = BusState::Passive],
        'I' => [|_| (), |inputs| inputs.bus = BusState::Off],
        _ => [|inputs| inputs.battery_10mv = 220, |inputs| inputs.battery_10mv = 219],
    }
}

/// A drive on its way, whose EMCY codes are as printed: high byte first.
fn travelling() -> Bench {
    let mut setup = Setup::new(NODE);
    setup.behaviour.emcy_code_order = CodeOrder::HighByteFirst;
    let mut bench = Bench::with(setup);
    bench.nmt(0x01);
    bench.enable();
    bench.command(0x405, 0x001F, 900_000);
    bench.hear(1000);
    bench
}

fn letters(bench: &Bench) -> String {
    bench.see(|drive, _| drive.controller().faults().iter().map(|fault| fault.letter).collect())
}

fn table_2(checker: &mut Checker<'_>, manual: &Manual, row: &Row, fault: &Fault) {
    checker.place(row, "5.2.1", "2");
    let called = manual.rows("terms.csv").iter().find(|term| term.get("overlay") == fault.text);
    checker.cell(row, "fault", Against::Code, called.map_or("", |term| term.get("printed")));
    checker.cell(row, "hex", Against::Code, format!("{:02X}", u32::from(fault.letter)));
    checker.cell(row, "blinks", Against::Code, fault.blinks);
    let condition = match fault.letter {
        'A' => format!(
            "supply voltage < {} V and motor current > {} mA",
            Inputs::UNDERVOLTAGE_100MV / 10,
            Inputs::UNDERVOLTAGE_CURRENT_MA
        ),
        'B' => "contouring error, and the shaft stands".into(),
        'C' => format!("motor current > {:.1} A", f64::from(Inputs::OVERCURRENT_MA) / 1000.0),
        'D' => format!("output stage temperature > {} degC", Inputs::OVERTEMPERATURE_100MDEGC / 10),
        'G' => format!("intermediate circuit voltage > {} V", Inputs::OVERVOLTAGE_100MV / 10),
        'H' => "error passive during running positioning".into(),
        'I' => "bus off".into(),
        'J' => format!("battery voltage < {:.1} V", f64::from(Inputs::BATTERY_EMPTY_10MV) / 100.0),
        _ => String::new(),
    };
    checker.cell(row, "condition", Against::Code, condition);
    let Fall { spared, fallen, seconds, blinks } = fall(fault.letter);
    let found = format!("{spared:?}, then {fallen:?}");
    checker.that(row, "letter", Against::Drive, spared.is_empty() && seconds.is_some(), found);
    checker.cell(row, "blinks", Against::Drive, blinks);
    // Only fault C says how long it takes.
    let duration = seconds.filter(|_| fault.letter == 'C').map_or(String::new(), |seconds| seconds.to_string());
    checker.cell(row, "duration_s", Against::Drive, duration);
}

/// How a drive falls into a fault.
#[derive(Clone)]
struct Fall {
    /// The letters of its faults shortly before, and then.
    spared: String,
    fallen: String,
    /// How long it takes, if it comes.
    seconds: Option<u32>,
    blinks: usize,
}

fn fall(letter: char) -> Fall {
    static MEMORY: Memory<char, Fall> = Memory::new(BTreeMap::new());
    once(&MEMORY, letter, || {
        let [before, after] = causes(letter);
        let mut bench = travelling();
        bench.world(before);
        bench.hear(5000);
        let spared = letters(&bench);
        bench.world(after);
        let seconds = (0..=10).find(|_| {
            let there = letters(&bench) == letter.to_string();
            if !there {
                bench.hear(1000);
            }
            there
        });
        let fallen = letters(&bench);
        Fall { spared, fallen, seconds, blinks: super::leds::blinks(&mut bench, |lights| lights.status) }
    })
}

fn table_20(checker: &mut Checker<'_>, manual: &Manual, row: &Row, code: u16, letter: &str) {
    checker.place(row, "7.2.9.1", "20");
    let term = manual.row("terms.csv", &format!("EmergencyCode:0x{code:04X}"));
    checker.cell(row, "meaning", Against::Manual, term.map_or("", |term| term.get("printed")));
    checker.cell(row, "letter", Against::Code, letter);
    let bytes = code.to_be_bytes();
    for (column, byte) in ["byte_0", "byte_1"].into_iter().zip(bytes) {
        checker.cell(row, column, Against::Manual, format!("{byte:02X}"));
    }
    if code == 0xFF00 {
        // No drive ever sends it.
        let unknown = siko_ag03_1::fault::cause_of(code) == siko_ag03_1::fault::Cause::Unknown(code);
        checker.that(row, "code", Against::Code, unknown, "a code with a meaning");
        for column in ["state_fault", "stored", "communication_ends"] {
            checker.cell(row, column, Against::Manual, "");
        }
        return;
    }
    let Emergency { heard, communication_ends, state_fault, newest } = emergency(code, letter);
    if code != 0xFF03 {
        checker.that(row, "code", Against::Drive, heard.get(..2) == Some(&bytes), format!("{heard:02X?}"));
    }
    checker.cell(row, "communication_ends", Against::Drive, yes(communication_ends));
    let printed = match code {
        0x8120 | 0x8140 => "",
        _ => yes(state_fault),
    };
    checker.cell(row, "state_fault", Against::Drive, printed);
    checker.cell(row, "stored", Against::Drive, if code == 0 { "" } else { yes(newest == Some(code)) });
}

/// An emergency, and the drive after it.
#[derive(Clone)]
struct Emergency {
    /// The data of its frame; empty when none came.
    heard: Vec<u8>,
    communication_ends: bool,
    state_fault: bool,
    /// 1003h:01.
    newest: Option<u16>,
}

fn emergency(code: u16, letter: &str) -> Emergency {
    static MEMORY: Memory<(u16, String), Emergency> = Memory::new(BTreeMap::new());
    once(&MEMORY, (code, letter.to_owned()), || {
        let mut bench = travelling();
        let heard = provoke(&mut bench, code, letter);
        let ends = matches!(bench.see(|drive, _| drive.inputs().bus), BusState::Passive | BusState::Off);
        let first = siko_ag03_1::od::PRE_DEFINED_ERROR_FIELD.at(1);
        Emergency {
            heard,
            communication_ends: ends && bench.read(0x1000, 0) == Err(0),
            state_fault: bench.status() & 0x0F == 0x08,
            newest: first.map(|first| bench.see(|drive, _| drive.storage().get(first).0)),
        }
    })
}

/// Brings the emergency about; its data.
fn provoke(bench: &mut Bench, code: u16, letter: &str) -> Vec<u8> {
    let wait = |bench: &mut Bench| bench.hear_from(0x085, 5000).pop().unwrap_or_default();
    match (code, letter.chars().next()) {
        (0x0000, _) => {
            bench.world(|inputs| inputs.internal_error = true);
            bench.world(|inputs| inputs.internal_error = false);
            bench.hear(0);
            bench.send(0x205, &[0x00, 0x00]);
            bench.send(0x205, &[0x80, 0x00]);
            wait(bench)
        }
        (0x8120, _) => {
            // Not during a positioning: that is FF02h.
            bench.control(0x0100);
            bench.hear(10_000);
            bench.world(|inputs| inputs.bus = BusState::Passive);
            wait(bench)
        }
        (0x8140, _) => {
            bench.world(|inputs| inputs.bus = BusState::Off);
            bench.hear(100);
            bench.world(|inputs| inputs.bus = BusState::Active);
            bench.hear_from(0x085, 100).into_iter().find(|data| data.starts_with(&[0x81, 0x40])).unwrap_or_default()
        }
        (_, Some(letter)) => {
            let [_, cause] = causes(letter);
            bench.world(cause);
            wait(bench)
        }
        _ => Vec::new(),
    }
}
