//! Scripts as TOML.

use lexican_runtime::NodeId;
use simulator::script::{FromToml, Input, Range, Reading, ScriptError, Takes, listed};

use super::Change;
use crate::fault::FaultKind;
use crate::model::{Addressing, Model};
use crate::sim::drive::SimulatedDrive;
use crate::sim::inputs::{BusError, BusState, Inputs, Key, Shaft};
use crate::sim::setup::BIT_RATES;
use crate::sim::switches::Restore;

/// The inputs of a drive: one for each key of a step that applies to its model.
#[must_use]
pub fn inputs(drive: &SimulatedDrive) -> Vec<Input> {
    let (model, world) = (drive.model(), drive.inputs());
    let input = |row: &Row| {
        let (name, what, value) = (row.name, row.what, (row.value)(world));
        (row.takes)(model).map(|takes| Input { name, takes, what, value })
    };
    ROWS.iter().filter_map(input).collect()
}

/// The letters of faults depend on the model.
impl FromToml for Change {
    type Model = Model;

    const EXAMPLE: &'static str = "battery_v = 2.5";

    fn keys() -> impl Iterator<Item = &'static str> {
        ROWS.iter().map(|row| row.name)
    }

    fn read(model: &Model, reading: &Reading<'_>) -> Result<Vec<Self>, ScriptError> {
        let row = ROWS.iter().find(|row| row.name == reading.key());
        row.map_or(Ok(Vec::new()), |row| (row.make)(model, reading))
    }
}

/// A key of a script.
struct Row {
    name: &'static str,
    what: &'static str,
    /// The values that it takes; `None` if it does not apply to the model.
    takes: fn(&Model) -> Option<Takes>,
    make: fn(&Model, &Reading<'_>) -> Result<Vec<Change>, ScriptError>,
    /// Its present value; `None` for a key that acts once.
    value: fn(&Inputs) -> Option<String>,
}

const SUPPLY: Range = Range::new(0.0, 100.0, "V");
const BATTERY: Range = Range::new(0.0, 10.0, "V");
const TEMPERATURE: Range = Range::new(-100.0, 200.0, "degC");
const LOAD: Range = Range::new(0.0, 32_767.0, "mA");
const VELOCITY: Range = Range::new(1.0, 255.0, "rev/min");
const TURN: Range = Range::new(-1e9, 1e9, "increments");
const BIT_RATE: Range = Range::new(15.625, 1000.0, "kbit/s");
const NODE: Range = Range::new(1.0, 127.0, "node-ID");
/// The word for no limit.
const ANY: &str = "any";

type Words = &'static [(&'static str, Change)];

const SHAFT: Words = &[("free", Change::Shaft(Shaft::Free)), ("blocked", Change::Shaft(Shaft::Blocked))];
const BUS: Words = &[
    ("active", Change::Bus(BusState::Active)),
    ("passive", Change::Bus(BusState::Passive)),
    ("off", Change::Bus(BusState::Off)),
];
const LIMIT_SWITCH: Words = &[
    ("1", Change::LimitSwitches([true, false])),
    ("2", Change::LimitSwitches([false, true])),
    ("none", Change::LimitSwitches([false; 2])),
];
const KEY: Words = &[
    ("clockwise", Change::Key(Some(Key::Clockwise))),
    ("counter-clockwise", Change::Key(Some(Key::CounterClockwise))),
    ("none", Change::Key(None)),
];
const RESTORE: Words = &[
    ("all", Change::Restore(Some(Restore::All))),
    ("standard", Change::Restore(Some(Restore::Standard))),
    ("controller", Change::Restore(Some(Restore::Controller))),
    ("none", Change::Restore(None)),
];
const POWER: Words = &[("on", Change::Power(true)), ("off", Change::Power(false)), ("cycle", Change::PowerCycle)];

fn bus_errors() -> Vec<(&'static str, Change)> {
    let errors = BusError::ALL.iter().map(|(error, name)| (*name, Change::BusError(Some(*error))));
    errors.chain([("none", Change::BusError(None))]).collect()
}

/// All keys but those of the trigger. They take effect in this order: the supply is switched after everything else.
const ROWS: &[Row] = &[
    Row {
        name: "clear",
        what: "the cause of a fault goes; all is a world in which all is well",
        takes: |model| Some(Takes::Words(faults(model).chain(["all"]).collect())),
        make: |model, value| clear(model, value),
        value: |_| None,
    },
    Row {
        name: "supply_v",
        what: "both supplies",
        takes: |_| number(SUPPLY),
        make: |_, value| {
            let supply = value.scaled(10.0, SUPPLY)? as u16;
            Ok(vec![Change::OutputStageSupply(supply), Change::ControlSupply(supply)])
        },
        value: |world| {
            tenths(world.control_supply_100mv).filter(|_| world.output_stage_supply_100mv == world.control_supply_100mv)
        },
    },
    Row {
        name: "output_stage_v",
        what: "the supply of the output stage",
        takes: |_| number(SUPPLY),
        make: |_, value| one(Change::OutputStageSupply(value.scaled(10.0, SUPPLY)? as u16)),
        value: |world| tenths(world.output_stage_supply_100mv),
    },
    Row {
        name: "control_v",
        what: "the supply of the control; without it, the drive is off",
        takes: |_| number(SUPPLY),
        make: |_, value| one(Change::ControlSupply(value.scaled(10.0, SUPPLY)? as u16)),
        value: |world| tenths(world.control_supply_100mv),
    },
    Row {
        name: "battery_v",
        what: "the battery of the absolute encoder",
        takes: |_| number(BATTERY),
        make: |_, value| one(Change::Battery(value.scaled(100.0, BATTERY)? as i16)),
        value: |world| text(f64::from(world.battery_10mv) / 100.0),
    },
    Row {
        name: "temperature_degc",
        what: "the temperature of the output stage",
        takes: |_| number(TEMPERATURE),
        make: |_, value| one(Change::Temperature(value.scaled(10.0, TEMPERATURE)? as i16)),
        value: |world| text(f64::from(world.temperature_100mdegc) / 10.0),
    },
    Row {
        name: "load_ma",
        what: "the current that the motor takes while it moves",
        takes: |_| number(LOAD),
        make: |_, value| one(Change::Load(value.scaled(1.0, LOAD)? as u16)),
        value: |world| text(world.load_ma),
    },
    Row {
        name: "attainable_rpm",
        what: "the velocity that the load allows: a lag error below what is asked for",
        takes: |_| Some(Takes::Number(VELOCITY, Some(ANY))),
        make: |_, value| one(Change::Attainable(value.scaled_or(ANY, 1.0, VELOCITY)?.map(|rpm| rpm as u8))),
        value: |world| world.attainable_rpm.map_or_else(|| text(ANY), text),
    },
    Row {
        name: "shaft",
        what: "whether the shaft can turn",
        takes: |_| Some(Takes::words(SHAFT)),
        make: |_, value| one(value.of(SHAFT)?),
        value: |world| word(SHAFT, Change::Shaft(world.shaft)),
    },
    Row {
        name: "turn",
        what: "somebody turns the shaft by hand; a motor that is not released holds it",
        takes: |_| number(TURN),
        make: |_, value| one(Change::Turn(value.scaled(1.0, TURN)? as i32)),
        value: |_| None,
    },
    Row {
        name: "bus",
        what: "fault confinement of the CAN controller",
        takes: |_| Some(Takes::words(BUS)),
        make: |_, value| one(value.of(BUS)?),
        value: |world| word(BUS, Change::Bus(world.bus)),
    },
    Row {
        name: "bus_error",
        what: "what the CAN controller finds wrong with a frame",
        takes: |model| Some(Takes::words(&bus_errors())).filter(|_| reports_bus_errors(model)),
        make: |_, value| one(value.of(&bus_errors())?),
        value: |world| word(&bus_errors(), Change::BusError(world.bus_error)),
    },
    Row {
        name: "bus_kbit",
        what: "the bit rate of the bus; a drive that has another one is not there",
        takes: |_| Some(Takes::Number(BIT_RATE, Some(ANY))),
        make: |_, value| {
            one(Change::BusBitRate(match value.is(ANY) {
                true => None,
                false => Some(bit_rate(value)?),
            }))
        },
        value: |world| world.bus_bit_rate.map_or_else(|| text(ANY), |rate| text(f64::from(rate) / 1e3)),
    },
    Row {
        name: "limit_switch",
        what: "the limit switch that is active",
        takes: |model| Some(Takes::words(LIMIT_SWITCH)).filter(|_| model.switches),
        make: |_, value| one(value.of(LIMIT_SWITCH)?),
        value: |world| word(LIMIT_SWITCH, Change::LimitSwitches(world.limit_switches)),
    },
    Row {
        name: "calibration_switch",
        what: "the switch that calibrates",
        takes: |model| Some(Takes::Flag).filter(|_| model.switches),
        make: |_, value| one(Change::CalibrationSwitch(value.flag()?)),
        value: |world| text(world.calibration_switch),
    },
    Row {
        name: "enable",
        what: "the input that enables the motor",
        takes: |model| Some(Takes::Flag).filter(|_| model.enable_input),
        make: |_, value| one(Change::Enable(value.flag()?)),
        value: |world| text(world.enable),
    },
    Row {
        name: "key",
        what: "the operator key that is pressed (2.2.1.2)",
        takes: |model| Some(Takes::words(KEY)).filter(|_| model.keys),
        make: |_, value| one(value.of(KEY)?),
        value: |world| word(KEY, Change::Key(world.key)),
    },
    Row {
        name: "fault",
        what: "a fault whose cause stays until it is cleared",
        takes: |model| Some(Takes::Words(faults(model).collect())),
        make: |model, value| one(Change::Fault(fault(model, value, "")?)),
        value: |_| None,
    },
    Row {
        name: "switches",
        what: "all DIP switches, for the next power-on",
        takes: |model| Some(Takes::Text(TEN_DIGITS)).filter(|_| has_switches(model)),
        make: |_, value| {
            let switches = value.text().and_then(|text| text.parse().ok());
            one(Change::Switches(switches.ok_or_else(|| value.wrong(TEN_DIGITS))?))
        },
        value: |_| None,
    },
    Row {
        name: "node",
        what: "SW1 to SW7, for the next power-on",
        takes: |model| number(NODE).filter(|_| has_switches(model)),
        make: |_, value| {
            let node = NodeId::new(value.scaled(1.0, NODE)? as u8);
            one(Change::Node(node.ok_or_else(|| value.wrong("a number from 1 to 127"))?))
        },
        value: |_| None,
    },
    Row {
        name: "restore",
        what: "DIP switches for factory settings (2.4)",
        takes: |model| Some(Takes::words(RESTORE)).filter(|_| has_switches(model)),
        make: |_, value| one(value.of(RESTORE)?),
        value: |_| None,
    },
    Row {
        name: "termination",
        what: "SW9 and SW10",
        takes: |model| Some(Takes::Flag).filter(|_| has_switches(model)),
        make: |_, value| one(Change::Termination(value.flag()?)),
        value: |_| None,
    },
    Row {
        name: "power",
        what: "the supply is switched",
        takes: |_| Some(Takes::words(POWER)),
        make: |_, value| one(value.of(POWER)?),
        value: |_| None,
    },
];

const TEN_DIGITS: &str = "ten digits, SW1 first, 1 for ON: \"1010000 0 00\" is node 5";

fn number(range: Range) -> Option<Takes> {
    Some(Takes::Number(range, None))
}

fn text(value: impl ToString) -> Option<String> {
    Some(value.to_string())
}

fn tenths(value: u16) -> Option<String> {
    text(f64::from(value) / 10.0)
}

/// The word for the present value.
fn word(words: &[(&'static str, Change)], now: Change) -> Option<String> {
    words.iter().find(|(_, change)| *change == now).and_then(|(word, _)| text(word))
}

fn has_switches(model: &Model) -> bool {
    model.addressing == Addressing::Switches
}

fn reports_bus_errors(model: &Model) -> bool {
    let codes = || BusError::ALL.iter().map(|(error, _)| error.code());
    model.notices.iter().any(|notice| codes().any(|code| code == notice.number))
}

fn faults(model: &Model) -> impl Iterator<Item = &'static str> {
    model.faults.iter().map(|fault| named(fault.kind))
}

fn named(kind: FaultKind) -> &'static str {
    FaultKind::ALL.iter().find(|(known, _)| *known == kind).map_or("", |(_, name)| *name)
}

fn one(change: Change) -> Result<Vec<Change>, ScriptError> {
    Ok(vec![change])
}

fn bit_rate(value: &Reading<'_>) -> Result<u32, ScriptError> {
    let rate = value.number().and_then(|kbit| BIT_RATES.into_iter().find(|rate| f64::from(*rate) == kbit * 1e3));
    let all: Vec<String> = BIT_RATES.iter().map(|rate| (f64::from(*rate) / 1e3).to_string()).collect();
    rate.ok_or_else(|| value.wrong(&format!("one of {} (kbit/s), or \"any\"", all.join(", "))))
}

fn clear(model: &Model, value: &Reading<'_>) -> Result<Vec<Change>, ScriptError> {
    if value.is("all") { one(Change::ClearAll) } else { one(Change::Clear(fault(model, value, ", or \"all\"")?)) }
}

/// A fault by its letter or its name.
fn fault(model: &Model, value: &Reading<'_>, also: &str) -> Result<FaultKind, ScriptError> {
    let asked = value.text().unwrap_or_default();
    let rows = model.faults;
    let found = rows
        .iter()
        .find(|fault| asked.eq_ignore_ascii_case(named(fault.kind)) || asked.eq_ignore_ascii_case(fault.code.label));
    let letters = || [rows.first(), rows.last()].map(|fault| fault.map_or("", |fault| fault.code.label));
    let remedy = || {
        let ([first, last], names) = (letters(), listed(faults(model)));
        format!("a letter from {first:?} to {last:?}, or {names}{also}")
    };
    found.map(|fault| fault.kind).ok_or_else(|| value.wrong(&remedy()))
}
