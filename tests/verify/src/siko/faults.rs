//! Faults: table 2 with its conditions and blink codes, and the emergency codes of table 20.

use lexican_driver::Cause;
use lexican_runtime::object::{Object, Rw};
use lexican_runtime::wire::emcy::CodeOrder;
use siko::fault::{ERROR_PASSIVE, Fault, FaultKind, NO_ERROR, RECOVERED_FROM_BUS_OFF};
use siko::sim::Setup;
use siko::sim::inputs::{BusError, BusState, Inputs, Shaft};

use super::leds::blinks;
use super::rig::{NODE, Rig, Siko, running_at};
use crate::checker::{Against, Checker};
use crate::drive::Case;
use crate::kinds::emcy;
use crate::kinds::prose::said;
use crate::manual::Row;
use crate::notation::yes;
use crate::rig::{Simulator as _, once};

pub(crate) fn check<D: Siko>(checker: &mut Checker<'_>, case: &Case<'_>) {
    for fault in D::MODEL.faults {
        if let Some(row) = checker.row("faults.csv", &fault.letter().to_string()) {
            table_2::<D>(checker, case, row, fault);
        }
    }
    for row in case.manual.rows("emergency.csv") {
        let Some(code) = u16::from_str_radix(&row.key, 16).ok().filter(|code| has::<D>(*code)) else { continue };
        checker.key(row);
        table_20::<D>(checker, case, row, code);
    }
}

/// Whether the drive has a code, or reserves it.
fn has<D: Siko>(code: u16) -> bool {
    matches!(code, NO_ERROR | RESERVED) || D::CODES.cause(code) != Cause::Unknown(code)
}

/// The code that table 20 calls reserved.
const RESERVED: u16 = 0xFF00;

/// The fault of a code. Error passive is no fault, though it may become one.
fn fault_of<D: Siko>(code: u16) -> Option<&'static Fault> {
    D::MODEL.faults.iter().find(|fault| fault.code.number == code && code != ERROR_PASSIVE)
}

/// The inputs shortly before a fault, and at the fault.
fn causes(kind: FaultKind) -> [fn(&mut Inputs); 2] {
    use FaultKind as K;
    match kind {
        K::Undervoltage => {
            [|inputs| inputs.output_stage_supply_100mv = 180, |inputs| inputs.output_stage_supply_100mv = 179]
        }
        K::ShaftBlocked => [|inputs| inputs.shaft = Shaft::Free, |inputs| inputs.shaft = Shaft::Blocked],
        K::Overcurrent => [|inputs| inputs.load_ma = 2400, |inputs| inputs.load_ma = 2401],
        K::Overtemperature => [|inputs| inputs.temperature_100mdegc = 900, |inputs| inputs.temperature_100mdegc = 901],
        K::Sensor => [|_| (), |inputs| inputs.sensor_fails = true],
        K::Internal => [|_| (), |inputs| inputs.internal_error = true],
        K::Overvoltage => {
            [|inputs| inputs.output_stage_supply_100mv = 350, |inputs| inputs.output_stage_supply_100mv = 351]
        }
        K::BusPassive => [|_| (), |inputs| inputs.bus = BusState::Passive],
        K::BusOff => [|_| (), |inputs| inputs.bus = BusState::Off],
        K::Battery => [|inputs| inputs.battery_10mv = 220, |inputs| inputs.battery_10mv = 219],
    }
}

/// A drive that is travelling, with EMCY codes as printed: high byte first.
fn travelling<D: Siko>() -> Rig<D> {
    let mut setup = Setup::new(D::MODEL, NODE);
    setup.behaviour.emcy_code_order = CodeOrder::HighByteFirst;
    let mut rig = Rig::<D>::set_up(setup);
    D::prepare(&mut rig);
    rig.nmt(0x01);
    rig.enable();
    rig.travel(900_000);
    rig.hear(1000);
    rig
}

fn fails<D: Siko>(rig: &Rig<D>, kind: FaultKind) -> bool {
    rig.see(|drive, _| drive.controller().faults().iter().any(|fault| fault.kind == kind))
}

/// The letters of the drive's present faults.
fn letters<D: Siko>(rig: &Rig<D>) -> String {
    rig.see(|drive, _| drive.controller().faults().iter().map(Fault::letter).collect())
}

fn table_2<D: Siko>(checker: &mut Checker<'_>, case: &Case<'_>, row: &Row, fault: &Fault) {
    let (kind, letter) = (fault.kind, fault.letter());
    let called = case.manual.rows("terms.csv").iter().find(|term| term.get("overlay") == fault.code.text);
    checker.cell(row, "fault", Against::Code, called.map_or("", |term| term.get("printed")));
    checker.cell(row, "hex", Against::Code, format!("{:02X}", u32::from(letter)));
    checker.cell(row, "blinks", Against::Code, fault.blinks);
    let Fall { spared, fallen, seconds, blinks } = fall::<D>(kind, letter);
    let found = format!("{spared:?}, then {fallen:?}");
    checker.that(row, "letter", Against::Drive, spared.is_empty() && seconds.is_some(), found);
    checker.cell(row, "blinks", Against::Drive, blinks);
    if row.has("condition") {
        checker.cell(row, "condition", Against::Drive, condition::<D>(kind));
    }
    // Only one fault has a duration.
    if row.has("duration_s") {
        let duration = seconds.filter(|_| kind == FaultKind::Overcurrent).map_or(String::new(), |s| s.to_string());
        checker.cell(row, "duration_s", Against::Drive, duration);
    }
}

/// The condition of a fault, as the drive shows it; numbers are thresholds.
fn condition<D: Siko>(kind: FaultKind) -> String {
    let volts = |tenths: i64| tenths as f64 / 10.0;
    once::<D, _>(kind, || match kind {
        FaultKind::Undervoltage => {
            let supply = bound::<D>([400, 100], |inputs, supply| inputs.output_stage_supply_100mv = supply as u16);
            let current = bound::<D>([0, 600], |inputs, current| {
                (inputs.output_stage_supply_100mv, inputs.load_ma) = (170, current as u16);
            });
            format!("supply voltage < {} V and motor current > {current} mA", volts(supply))
        }
        FaultKind::ShaftBlocked => {
            let slow = comes(&mut travelling::<D>(), FaultKind::ShaftBlocked, |inputs| inputs.attainable_rpm = Some(1));
            let at_rest =
                comes(&mut Rig::<D>::enabled(), FaultKind::ShaftBlocked, |inputs| inputs.shaft = Shaft::Blocked);
            let mut rig = travelling::<D>();
            rig.world(|inputs| inputs.shaft = Shaft::Blocked);
            let lags = rig.system() >> 15 & 1 == 1;
            rig.hear(5000);
            let both = fails(&rig, FaultKind::ShaftBlocked) && !slow && !at_rest;
            said(&vec![("contouring error", lags && both), ("and the shaft stands", both)]).replace("; ", ", ")
        }
        FaultKind::Overcurrent => {
            let current = bound::<D>([600, 4000], |inputs, current| inputs.load_ma = current as u16);
            format!("motor current > {:.1} A", current as f64 / 1000.0)
        }
        FaultKind::Overtemperature => {
            let degrees = bound::<D>([250, 1500], |inputs, degrees| inputs.temperature_100mdegc = degrees as i16);
            format!("output stage temperature > {} degC", volts(degrees))
        }
        FaultKind::Overvoltage => {
            let supply = bound::<D>([240, 600], |inputs, supply| inputs.output_stage_supply_100mv = supply as u16);
            format!("intermediate circuit voltage > {} V", volts(supply))
        }
        FaultKind::BusPassive => {
            let passive = |inputs: &mut Inputs| inputs.bus = BusState::Passive;
            let moving = comes(&mut travelling::<D>(), FaultKind::BusPassive, passive);
            let others = [Rig::<D>::enabled(), running_at::<D>(30, 1000)];
            let only = others.into_iter().all(|mut rig| !comes(&mut rig, FaultKind::BusPassive, passive));
            said(&vec![("error passive during running positioning", moving && only)])
        }
        FaultKind::BusOff => {
            let off = |inputs: &mut Inputs| inputs.bus = BusState::Off;
            let both =
                [travelling::<D>(), Rig::<D>::new()].into_iter().all(|mut rig| comes(&mut rig, FaultKind::BusOff, off));
            said(&vec![("bus off", both)])
        }
        FaultKind::Battery => {
            let battery = bound::<D>([360, 100], |inputs, battery| inputs.battery_10mv = battery as i16);
            format!("battery voltage < {:.1} V", battery as f64 / 100.0)
        }
        _ => String::new(),
    })
}

/// Whether a fault comes within five seconds.
fn comes<D: Siko>(rig: &mut Rig<D>, kind: FaultKind, change: impl FnOnce(&mut Inputs)) -> bool {
    rig.world(change);
    rig.hear(5000);
    fails(rig, kind)
}

/// The last number without a fault during a travel, between one without and one with it.
fn bound<D: Siko>([mut without, mut with]: [i64; 2], set: fn(&mut Inputs, i64)) -> i64 {
    while (with - without).abs() > 1 {
        let middle = without + (with - without) / 2;
        let mut rig = travelling::<D>();
        rig.world(|inputs| set(inputs, middle));
        rig.hear(5000);
        *(if letters(&rig).is_empty() { &mut without } else { &mut with }) = middle;
    }
    without
}

/// How a drive gets into a fault.
#[derive(Clone)]
struct Fall {
    /// The letters of its faults shortly before, and at the fault.
    spared: String,
    fallen: String,
    /// The seconds until the fault, if it comes.
    seconds: Option<u32>,
    blinks: usize,
}

fn fall<D: Siko>(kind: FaultKind, letter: char) -> Fall {
    once::<D, _>(kind, || {
        let [before, after] = causes(kind);
        let mut rig = travelling::<D>();
        rig.world(before);
        rig.hear(5000);
        let spared = letters(&rig);
        rig.world(after);
        let seconds = (0..=11).find(|_| {
            let there = letters(&rig) == letter.to_string();
            if !there {
                rig.hear(1000);
            }
            there
        });
        let fallen = letters(&rig);
        Fall { spared, fallen, seconds, blinks: blinks(&mut rig, |lights| lights.status) }
    })
}

fn table_20<D: Siko>(checker: &mut Checker<'_>, case: &Case<'_>, row: &Row, code: u16) {
    let fault = fault_of::<D>(code);
    checker.cell(row, "letter", Against::Code, fault.map_or("", |fault| fault.code.label));
    if code == RESERVED {
        // No fault uses this code.
        emcy::check(checker, case, row, code, None);
        let sent = once::<D, _>((), || {
            let faults = D::MODEL.faults.iter();
            faults.map(|fault| fault.code.number).any(|other| emergency::<D>(other).reports(code))
        });
        checker.that(row, "code", Against::Code, !sent && fault.is_none(), "a code with a meaning");
        for column in ["state_fault", "stored", "communication_ends"] {
            checker.cell(row, column, Against::Drive, if sent { "a fault has it" } else { "" });
        }
        return;
    }
    let Emergency { heard, communication_ends, state_fault, newest } = emergency::<D>(code);
    // Bus off: nothing can be sent.
    let is_sent = fault.is_none_or(|fault| fault.kind != FaultKind::BusOff);
    emcy::check(checker, case, row, code, Some(heard.as_slice()).filter(|_| is_sent));
    checker.cell(row, "communication_ends", Against::Drive, yes(communication_ends));
    // The column about the state is filled only for faults and for their end.
    let speaks = fault.is_some() || code == NO_ERROR;
    checker.cell(row, "state_fault", Against::Drive, if speaks { yes(state_fault) } else { "" });
    // The table does not always say whether something other than a fault is stored.
    let silent = code == NO_ERROR || fault.is_none() && newest != code && row.get("stored").is_empty();
    let stored = if silent { "" } else { yes(newest == code) };
    checker.cell(row, "stored", Against::Drive, stored);
}

impl Emergency {
    fn reports(&self, code: u16) -> bool {
        self.heard.starts_with(&code.to_be_bytes()) || self.newest == code
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
    newest: u16,
}

fn emergency<D: Siko>(code: u16) -> Emergency {
    once::<D, _>(code, || {
        let mut rig = travelling::<D>();
        let heard = provoke(&mut rig, code);
        let ends = matches!(rig.see(|drive, _| drive.inputs().bus), BusState::Passive | BusState::Off);
        let first = Object::<u16, Rw>::new(0x1003, 1);
        Emergency {
            heard,
            communication_ends: ends && rig.read(0x1000, 0) == Err(0),
            state_fault: rig.is_fault(),
            newest: rig.see(|drive, _| drive.stored(first)),
        }
    })
}

/// Causes the emergency; returns its data.
fn provoke<D: Siko>(rig: &mut Rig<D>, code: u16) -> Vec<u8> {
    let wait = |rig: &mut Rig<D>| rig.hear_from(0x085, 12_000).pop().unwrap_or_default();
    if let Some(fault) = fault_of::<D>(code) {
        let [_, cause] = causes(fault.kind);
        rig.world(cause);
        return wait(rig);
    }
    match code {
        NO_ERROR => {
            rig.see(D::fail);
            rig.hear(0);
            rig.send(0x205, &[0x00, 0x00]);
            rig.send(0x205, &[0x80, 0x00]);
            wait(rig)
        }
        ERROR_PASSIVE => {
            // Not during a positioning: that may be a fault.
            rig.control(0x0100);
            rig.hear(10_000);
            rig.world(|inputs| inputs.bus = BusState::Passive);
            wait(rig)
        }
        RECOVERED_FROM_BUS_OFF => {
            rig.world(|inputs| inputs.bus = BusState::Off);
            rig.hear(100);
            rig.world(|inputs| inputs.bus = BusState::Active);
            rig.hear_from(0x085, 100).into_iter().find(|data| data.starts_with(&code.to_be_bytes())).unwrap_or_default()
        }
        _ => {
            let error = BusError::ALL.iter().find(|(error, _)| error.code() == code);
            rig.world(|inputs| inputs.bus_error = error.map(|(error, _)| *error));
            wait(rig)
        }
    }
}
