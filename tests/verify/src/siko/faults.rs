//! Faults: table 2 with its conditions and blink codes, and the emergency codes of table 20.

use lexican_runtime::wire::emcy::CodeOrder;
use siko_ag03_1::fault::{Cause, FAULTS, Fault, cause_of};
use siko_ag03_1::sim::inputs::{BusState, Inputs, Shaft};
use siko_ag03_1::sim::{MODEL, Setup};

use super::bench::{Bench, NODE, running_at};
use super::leds::blinks;
use crate::bench::once;
use crate::checker::{Against, Checker};
use crate::drive::Case;
use crate::kinds::emcy;
use crate::kinds::prose::said;
use crate::manual::Row;
use crate::notation::yes;

pub(crate) fn check(checker: &mut Checker<'_>, case: &Case<'_>) {
    for fault in FAULTS {
        if let Some(row) = checker.row("faults.csv", &fault.letter().to_string()) {
            table_2(checker, case, row, fault);
        }
    }
    let faults = FAULTS.iter().map(|fault| (fault.code.number, fault.letter()));
    for (code, letter) in faults.chain([0x0000, 0x8120, 0x8140, 0xFF00].map(|code| (code, NO_LETTER))) {
        if let Some(row) = checker.row("emergency.csv", &format!("{code:04X}")) {
            table_20(checker, case, row, code, letter);
        }
    }
}

/// What table 20 has for a code that is no fault's.
const NO_LETTER: char = ' ';

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
    let mut setup = Setup::new(&MODEL, NODE);
    setup.behaviour.emcy_code_order = CodeOrder::HighByteFirst;
    let mut bench = Bench::set_up(setup);
    bench.nmt(0x01);
    bench.enable();
    bench.travel(900_000);
    bench.hear(1000);
    bench
}

fn letters(bench: &Bench) -> String {
    bench.see(|drive, _| drive.controller().faults().iter().map(Fault::letter).collect())
}

fn table_2(checker: &mut Checker<'_>, case: &Case<'_>, row: &Row, fault: &Fault) {
    let called = case.manual.rows("terms.csv").iter().find(|term| term.get("overlay") == fault.code.text);
    checker.cell(row, "fault", Against::Code, called.map_or("", |term| term.get("printed")));
    checker.cell(row, "hex", Against::Code, format!("{:02X}", u32::from(fault.letter())));
    checker.cell(row, "blinks", Against::Code, fault.blinks);
    checker.cell(row, "condition", Against::Drive, condition(fault.letter()));
    let Fall { spared, fallen, seconds, blinks } = fall(fault.letter());
    let found = format!("{spared:?}, then {fallen:?}");
    checker.that(row, "letter", Against::Drive, spared.is_empty() && seconds.is_some(), found);
    checker.cell(row, "blinks", Against::Drive, blinks);
    // Only fault C says how long it takes.
    let duration = seconds.filter(|_| fault.letter() == 'C').map_or(String::new(), |seconds| seconds.to_string());
    checker.cell(row, "duration_s", Against::Drive, duration);
}

/// When a fault comes, as the drive shows it: numbers are where it begins to come.
fn condition(letter: char) -> String {
    let volts = |tenths: i64| tenths as f64 / 10.0;
    once(letter, || match letter {
        'A' => {
            let supply = bound([400, 100], |inputs, supply| inputs.output_stage_supply_100mv = supply as u16);
            let current = bound([0, 600], |inputs, current| {
                (inputs.output_stage_supply_100mv, inputs.load_ma) = (170, current as u16);
            });
            format!("supply voltage < {} V and motor current > {current} mA", volts(supply))
        }
        'B' => {
            let slow = comes(&mut travelling(), 'B', |inputs| inputs.attainable_rpm = Some(1));
            let at_rest = comes(&mut Bench::enabled(), 'B', |inputs| inputs.shaft = Shaft::Blocked);
            let mut bench = travelling();
            bench.world(|inputs| inputs.shaft = Shaft::Blocked);
            let lags = bench.system() >> 15 & 1 == 1;
            bench.hear(5000);
            let both = letters(&bench) == "B" && !slow && !at_rest;
            said(&vec![("contouring error", lags && both), ("and the shaft stands", both)]).replace("; ", ", ")
        }
        'C' => {
            let current = bound([600, 4000], |inputs, current| inputs.load_ma = current as u16);
            format!("motor current > {:.1} A", current as f64 / 1000.0)
        }
        'D' => {
            let degrees = bound([250, 1500], |inputs, degrees| inputs.temperature_100mdegc = degrees as i16);
            format!("output stage temperature > {} degC", volts(degrees))
        }
        'G' => {
            let supply = bound([240, 600], |inputs, supply| inputs.output_stage_supply_100mv = supply as u16);
            format!("intermediate circuit voltage > {} V", volts(supply))
        }
        'H' => {
            let passive = |inputs: &mut Inputs| inputs.bus = BusState::Passive;
            let moving = comes(&mut travelling(), 'H', passive);
            let others = [Bench::enabled(), running_at(30, 1000)];
            let only = others.into_iter().all(|mut bench| !comes(&mut bench, 'H', passive));
            said(&vec![("error passive during running positioning", moving && only)])
        }
        'I' => {
            let off = |inputs: &mut Inputs| inputs.bus = BusState::Off;
            let both = [travelling(), Bench::new()].into_iter().all(|mut bench| comes(&mut bench, 'I', off));
            said(&vec![("bus off", both)])
        }
        'J' => {
            let battery = bound([360, 100], |inputs, battery| inputs.battery_10mv = battery as i16);
            format!("battery voltage < {:.1} V", battery as f64 / 100.0)
        }
        _ => String::new(),
    })
}

/// Whether a fault comes within five seconds.
fn comes(bench: &mut Bench, letter: char, change: impl FnOnce(&mut Inputs)) -> bool {
    bench.world(change);
    bench.hear(5000);
    letters(bench).contains(letter)
}

/// The last number without a fault on a travel, between one without and one with.
fn bound([mut without, mut with]: [i64; 2], set: fn(&mut Inputs, i64)) -> i64 {
    while (with - without).abs() > 1 {
        let middle = without + (with - without) / 2;
        let mut bench = travelling();
        bench.world(|inputs| set(inputs, middle));
        bench.hear(5000);
        *(if letters(&bench).is_empty() { &mut without } else { &mut with }) = middle;
    }
    without
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
    once(letter, || {
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
        Fall { spared, fallen, seconds, blinks: blinks(&mut bench, |lights| lights.status) }
    })
}

fn table_20(checker: &mut Checker<'_>, case: &Case<'_>, row: &Row, code: u16, letter: char) {
    checker.cell(row, "letter", Against::Code, letter.to_string().trim());
    if code == 0xFF00 {
        // Reserved: none of the faults is reported by it.
        emcy::check(checker, case, row, code, None);
        let sent = once((), || FAULTS.iter().any(|fault| emergency(fault.code.number, fault.letter()).reports(code)));
        checker.that(row, "code", Against::Code, cause_of(code) == Cause::Unknown(code), "a code with a meaning");
        for column in ["state_fault", "stored", "communication_ends"] {
            checker.cell(row, column, Against::Drive, if sent { "a fault has it" } else { "" });
        }
        return;
    }
    let Emergency { heard, communication_ends, state_fault, newest } = emergency(code, letter);
    // Bus off: nothing can be sent.
    emcy::check(checker, case, row, code, Some(heard.as_slice()).filter(|_| code != 0xFF03));
    checker.cell(row, "communication_ends", Against::Drive, yes(communication_ends));
    let printed = match code {
        0x8120 | 0x8140 => "",
        _ => yes(state_fault),
    };
    checker.cell(row, "state_fault", Against::Drive, printed);
    checker.cell(row, "stored", Against::Drive, if code == 0 { "" } else { yes(newest == Some(code)) });
}

impl Emergency {
    fn reports(&self, code: u16) -> bool {
        self.heard.starts_with(&code.to_be_bytes()) || self.newest == Some(code)
    }
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

fn emergency(code: u16, letter: char) -> Emergency {
    once((code, letter), || {
        let mut bench = travelling();
        let heard = provoke(&mut bench, code, letter);
        let ends = matches!(bench.see(|drive, _| drive.inputs().bus), BusState::Passive | BusState::Off);
        let first = siko_ag03_1::od::PRE_DEFINED_ERROR_FIELD.at(1);
        Emergency {
            heard,
            communication_ends: ends && bench.read(0x1000, 0) == Err(0),
            state_fault: bench.is_fault(),
            newest: first.map(|first| bench.see(|drive, _| drive.stored(first).0)),
        }
    })
}

/// Brings the emergency about; its data.
fn provoke(bench: &mut Bench, code: u16, letter: char) -> Vec<u8> {
    let wait = |bench: &mut Bench| bench.hear_from(0x085, 5000).pop().unwrap_or_default();
    match (code, letter) {
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
        (_, letter) => {
            let [_, cause] = causes(letter);
            bench.world(cause);
            wait(bench)
        }
    }
}
