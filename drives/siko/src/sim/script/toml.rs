//! Scripts as TOML.

use lexican_runtime::NodeId;
use simulator::script::{FromToml, Reading, ScriptError, listed};

use super::Change;
use crate::fault::FaultKind;
use crate::sim::inputs::{BusError, BusState, Key, Shaft};
use crate::sim::model::Model;
use crate::sim::setup::BIT_RATES;
use crate::sim::switches::Restore;

/// The letters of faults are those of the model.
impl FromToml for Change {
    type Model = Model;

    const EXAMPLE: &'static str = "battery_v = 2.5";

    fn keys() -> impl Iterator<Item = &'static str> {
        MAKERS.iter().map(|(name, _)| *name)
    }

    fn read(model: &Model, reading: &Reading<'_>) -> Result<Vec<Self>, ScriptError> {
        let maker = MAKERS.iter().find(|(name, _)| *name == reading.key());
        maker.map_or(Ok(Vec::new()), |(_, make)| make(model, reading))
    }
}

/// A key whose value makes changes.
type Maker = (&'static str, fn(&Model, &Reading<'_>) -> Result<Vec<Change>, ScriptError>);

/// All keys but those of the trigger. They take effect in this order: a drive is switched on after everything else.
const MAKERS: &[Maker] = &[
    ("clear", |model, value| clear(model, value)),
    ("supply_v", |_, value| {
        let supply = value.scaled(10.0, 0.0, 100.0, "V")? as u16;
        Ok(vec![Change::OutputStageSupply(supply), Change::ControlSupply(supply)])
    }),
    ("output_stage_v", |_, value| one(Change::OutputStageSupply(value.scaled(10.0, 0.0, 100.0, "V")? as u16))),
    ("control_v", |_, value| one(Change::ControlSupply(value.scaled(10.0, 0.0, 100.0, "V")? as u16))),
    ("battery_v", |_, value| one(Change::Battery(value.scaled(100.0, 0.0, 10.0, "V")? as i16))),
    ("temperature_degc", |_, value| one(Change::Temperature(value.scaled(10.0, -100.0, 200.0, "degC")? as i16))),
    ("load_ma", |_, value| one(Change::Load(value.scaled(1.0, 0.0, 32_767.0, "mA")? as u16))),
    ("attainable_rpm", |_, value| {
        one(Change::Attainable(match value.is("any") {
            true => None,
            false => Some(value.scaled(1.0, 1.0, 255.0, "rev/min, or \"any\"")? as u8),
        }))
    }),
    ("shaft", |_, value| {
        one(value.of(&[("free", Change::Shaft(Shaft::Free)), ("blocked", Change::Shaft(Shaft::Blocked))])?)
    }),
    ("turn", |_, value| one(Change::Turn(value.scaled(1.0, -1e9, 1e9, "increments")? as i32))),
    ("bus", |_, value| {
        let bus = |state| Change::Bus(state);
        one(value.of(&[
            ("active", bus(BusState::Active)),
            ("passive", bus(BusState::Passive)),
            ("off", bus(BusState::Off)),
        ])?)
    }),
    ("bus_error", |_, value| {
        let errors = BusError::ALL.iter().map(|(error, name)| (*name, Change::BusError(Some(*error))));
        let errors: Vec<_> = errors.chain([("none", Change::BusError(None))]).collect();
        one(value.of(&errors)?)
    }),
    ("bus_kbit", |_, value| {
        one(Change::BusBitRate(match value.is("any") {
            true => None,
            false => Some(bit_rate(value)?),
        }))
    }),
    ("limit_switch", |_, value| {
        one(value.of(&[
            ("1", Change::LimitSwitches([true, false])),
            ("2", Change::LimitSwitches([false, true])),
            ("none", Change::LimitSwitches([false; 2])),
        ])?)
    }),
    ("calibration_switch", |_, value| one(Change::CalibrationSwitch(value.flag()?))),
    ("enable", |_, value| one(Change::Enable(value.flag()?))),
    ("key", |_, value| {
        one(value.of(&[
            ("clockwise", Change::Key(Some(Key::Clockwise))),
            ("counter-clockwise", Change::Key(Some(Key::CounterClockwise))),
            ("none", Change::Key(None)),
        ])?)
    }),
    ("fault", |model, value| one(Change::Fault(fault(model, value, "")?))),
    ("switches", |_, value| {
        let switches = value.text().and_then(|text| text.parse().ok());
        let switches =
            switches.ok_or_else(|| value.wrong("ten digits, SW1 first, 1 for ON: \"1010000 0 00\" is node 5"));
        one(Change::Switches(switches?))
    }),
    ("node", |_, value| {
        let node = NodeId::new(value.scaled(1.0, 1.0, 127.0, "node-ID")? as u8);
        one(Change::Node(node.ok_or_else(|| value.wrong("a number from 1 to 127"))?))
    }),
    ("restore", |_, value| {
        one(value.of(&[
            ("all", Change::Restore(Some(Restore::All))),
            ("standard", Change::Restore(Some(Restore::Standard))),
            ("controller", Change::Restore(Some(Restore::Controller))),
            ("none", Change::Restore(None)),
        ])?)
    }),
    ("termination", |_, value| one(Change::Termination(value.flag()?))),
    ("power", |_, value| {
        one(value.of(&[("on", Change::Power(true)), ("off", Change::Power(false)), ("cycle", Change::PowerCycle)])?)
    }),
];

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
    let faults = model.faults;
    let named = |kind| FaultKind::ALL.iter().find(|(known, _)| *known == kind).map_or("", |(_, name)| *name);
    let found = faults
        .iter()
        .find(|fault| asked.eq_ignore_ascii_case(named(fault.kind)) || asked.eq_ignore_ascii_case(fault.code.label));
    let letters = || [faults.first(), faults.last()].map(|fault| fault.map_or("", |fault| fault.code.label));
    let remedy = || {
        let ([first, last], names) = (letters(), listed(faults.iter().map(|fault| named(fault.kind))));
        format!("a letter from {first:?} to {last:?}, or {names}{also}")
    };
    found.map(|fault| fault.kind).ok_or_else(|| value.wrong(&remedy()))
}
