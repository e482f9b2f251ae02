//! Scripts as TOML.

use std::borrow::Cow;

use lexican_runtime::{Duration, NodeId};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::{Change, Condition, Script, Trigger};
use crate::fault::FaultKind;
use crate::sim::inputs::{BusError, BusState, Key, Shaft};
use crate::sim::model::Model;
use crate::sim::setup::BIT_RATES;
use crate::sim::switches::Restore;

/// A script that cannot be understood.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {problem}; {remedy}")]
pub struct ScriptError {
    /// The line, counted from 1.
    pub line: usize,
    /// What is wrong there.
    pub problem: String,
    /// What to write instead.
    pub remedy: String,
}

impl Script {
    /// Reads a script from TOML, for drives of this model: the letters of faults are its own.
    ///
    /// # Errors
    ///
    /// The first line that cannot be understood, and what to write instead.
    pub fn from_toml(model: &Model, text: &str) -> Result<Self, ScriptError> {
        read(model, text)
    }
}

fn read(model: &Model, text: &str) -> Result<Script, ScriptError> {
    let table = DeTable::parse(text).map_err(|error| {
        let at = error.span().map_or(0, |span| span.start);
        let remedy = "write every step as [[step]] with lines of `key = value` below it";
        wrong(text, at, format!("not TOML: {}", error.message().replace('\n', ", ")), remedy)
    })?;
    let mut script = Script::default();
    let mut last_at_ms = 0;
    for (key, value) in table.get_ref() {
        let steps = value.get_ref().as_array().filter(|_| key.get_ref() == "step").ok_or_else(|| {
            wrong(
                text,
                key.span().start,
                format!("`{}` stands outside of a step", key.get_ref()),
                "write [[step]] above",
            )
        })?;
        for step in steps {
            let at = step.span().start;
            let table =
                step.get_ref().as_table().ok_or_else(|| wrong(text, at, "not a step", "write it as [[step]]"))?;
            let reader = Step { model, text, table };
            let trigger = reader.trigger(at, &mut last_at_ms)?;
            let changes = reader.changes()?;
            if changes.is_empty() {
                return Err(wrong(
                    text,
                    at,
                    "a step that changes nothing",
                    "say what happens, such as `battery_v = 2.5`",
                ));
            }
            script = script.then(trigger, changes);
        }
    }
    if script.steps().is_empty() {
        return Err(wrong(text, 0, "a script without steps", "begin with [[step]]"));
    }
    Ok(script)
}

fn wrong(text: &str, at: usize, problem: impl Into<String>, remedy: impl Into<String>) -> ScriptError {
    let line = 1 + text.bytes().take(at).filter(|byte| *byte == b'\n').count();
    ScriptError { line, problem: problem.into(), remedy: remedy.into() }
}

type Name<'i> = Spanned<Cow<'i, str>>;
type Value<'i> = Spanned<DeValue<'i>>;

/// A key whose value makes changes.
type Maker = (&'static str, fn(&Reading<'_>) -> Result<Vec<Change>, ScriptError>);

/// All keys but those of the trigger. They take effect in this order, whichever they are written in: a drive is
/// switched on when everything else is as it should be.
const MAKERS: &[Maker] = &[
    ("clear", |value| value.clear()),
    ("supply_v", |value| {
        let supply = value.scaled(10.0, 0.0, 100.0, "V")? as u16;
        Ok(vec![Change::OutputStageSupply(supply), Change::ControlSupply(supply)])
    }),
    ("output_stage_v", |value| one(Change::OutputStageSupply(value.scaled(10.0, 0.0, 100.0, "V")? as u16))),
    ("control_v", |value| one(Change::ControlSupply(value.scaled(10.0, 0.0, 100.0, "V")? as u16))),
    ("battery_v", |value| one(Change::Battery(value.scaled(100.0, 0.0, 10.0, "V")? as i16))),
    ("temperature_degc", |value| one(Change::Temperature(value.scaled(10.0, -100.0, 200.0, "degC")? as i16))),
    ("load_ma", |value| one(Change::Load(value.scaled(1.0, 0.0, 32_767.0, "mA")? as u16))),
    ("attainable_rpm", |value| {
        one(Change::Attainable(match value.is("any") {
            true => None,
            false => Some(value.scaled(1.0, 1.0, 255.0, "rev/min, or \"any\"")? as u8),
        }))
    }),
    ("shaft", |value| {
        one(value.of(&[("free", Change::Shaft(Shaft::Free)), ("blocked", Change::Shaft(Shaft::Blocked))])?)
    }),
    ("turn", |value| one(Change::Turn(value.scaled(1.0, -1e9, 1e9, "increments")? as i32))),
    ("bus", |value| {
        let bus = |state| Change::Bus(state);
        one(value.of(&[
            ("active", bus(BusState::Active)),
            ("passive", bus(BusState::Passive)),
            ("off", bus(BusState::Off)),
        ])?)
    }),
    ("bus_error", |value| {
        let errors = BusError::ALL.iter().map(|(error, name)| (*name, Change::BusError(Some(*error))));
        let errors: Vec<_> = errors.chain([("none", Change::BusError(None))]).collect();
        one(value.of(&errors)?)
    }),
    ("bus_kbit", |value| {
        one(Change::BusBitRate(match value.is("any") {
            true => None,
            false => Some(value.bit_rate()?),
        }))
    }),
    ("limit_switch", |value| {
        one(value.of(&[
            ("1", Change::LimitSwitches([true, false])),
            ("2", Change::LimitSwitches([false, true])),
            ("none", Change::LimitSwitches([false; 2])),
        ])?)
    }),
    ("calibration_switch", |value| one(Change::CalibrationSwitch(value.flag()?))),
    ("enable", |value| one(Change::Enable(value.flag()?))),
    ("key", |value| {
        one(value.of(&[
            ("clockwise", Change::Key(Some(Key::Clockwise))),
            ("counter-clockwise", Change::Key(Some(Key::CounterClockwise))),
            ("none", Change::Key(None)),
        ])?)
    }),
    ("fault", |value| one(Change::Fault(value.fault("")?))),
    ("switches", |value| {
        let switches = value.text().and_then(|text| text.parse().ok());
        let switches =
            switches.ok_or_else(|| value.wrong("ten digits, SW1 first, 1 for ON: \"1010000 0 00\" is node 5"));
        one(Change::Switches(switches?))
    }),
    ("node", |value| {
        let node = NodeId::new(value.scaled(1.0, 1.0, 127.0, "node-ID")? as u8);
        one(Change::Node(node.ok_or_else(|| value.wrong("a number from 1 to 127"))?))
    }),
    ("restore", |value| {
        one(value.of(&[
            ("all", Change::Restore(Some(Restore::All))),
            ("standard", Change::Restore(Some(Restore::Standard))),
            ("controller", Change::Restore(Some(Restore::Controller))),
            ("none", Change::Restore(None)),
        ])?)
    }),
    ("termination", |value| one(Change::Termination(value.flag()?))),
    ("power", |value| {
        one(value.of(&[("on", Change::Power(true)), ("off", Change::Power(false)), ("cycle", Change::PowerCycle)])?)
    }),
];

const TRIGGERS: [&str; 3] = ["at_ms", "when", "after_ms"];

fn one(change: Change) -> Result<Vec<Change>, ScriptError> {
    Ok(vec![change])
}

/// One `[[step]]`.
struct Step<'t, 'i> {
    model: &'t Model,
    text: &'t str,
    table: &'t DeTable<'i>,
}

impl<'t, 'i> Step<'t, 'i> {
    fn get(&self, name: &'static str) -> Option<Reading<'t>>
    where
        'i: 't,
    {
        let (key, value) = self.table.iter().find(|(key, _)| key.get_ref() == name)?;
        Some(Reading { model: self.model, text: self.text, key, value })
    }

    fn trigger(&self, at: usize, last_at_ms: &mut u64) -> Result<Trigger, ScriptError> {
        let time = |name| self.get(name).map(|value| value.scaled(1.0, 0.0, 1e12, "ms")).transpose();
        let after = time("after_ms")?.map(|ms| Duration::from_millis(ms as u64));
        match (time("at_ms")?, self.get("when")) {
            (Some(_), None) if after.is_some() => {
                Err(wrong(self.text, at, "a step with both `at_ms` and `after_ms`", "keep one of them"))
            }
            (Some(_), Some(_)) => Err(wrong(self.text, at, "a step with both `at_ms` and `when`", "keep one of them")),
            (Some(ms), None) => {
                let ms = ms as u64;
                if ms < *last_at_ms {
                    let problem = format!("{ms} ms is before the {last_at_ms} ms of a step above");
                    return Err(wrong(self.text, at, problem, "write the steps in the order in which they happen"));
                }
                *last_at_ms = ms;
                Ok(Trigger::At(Duration::from_millis(ms)))
            }
            (None, Some(when)) => {
                let condition = when.text().and_then(Condition::named);
                let condition = condition.ok_or_else(|| when.wrong(&listed(Condition::names())))?;
                Ok(Trigger::When { condition, and_then: after.unwrap_or_default() })
            }
            (None, None) => Ok(Trigger::After(after.unwrap_or_default())),
        }
    }

    fn changes(&self) -> Result<Vec<Change>, ScriptError>
    where
        'i: 't,
    {
        let known = || MAKERS.iter().map(|(name, _)| *name).chain(TRIGGERS);
        for key in self.table.keys() {
            let name = key.get_ref();
            if !known().any(|known| known == name) {
                let nearest = known().max_by(|a, b| strsim::jaro(a, name).total_cmp(&strsim::jaro(b, name)));
                let near = nearest.filter(|nearest| strsim::jaro(nearest, name) > 0.8);
                let remedy =
                    near.map_or_else(|| format!("there is {}", listed(known())), |near| format!("write `{near}`"));
                return Err(wrong(self.text, key.span().start, format!("no key `{name}`"), remedy));
            }
        }
        let made = MAKERS.iter().filter_map(|(name, make)| Some(make(&self.get(name)?)));
        Ok(made.collect::<Result<Vec<_>, _>>()?.into_iter().flatten().collect())
    }
}

/// A value, and where it stands.
struct Reading<'t> {
    model: &'t Model,
    text: &'t str,
    key: &'t Name<'t>,
    value: &'t Value<'t>,
}

impl Reading<'_> {
    fn wrong(&self, remedy: &str) -> ScriptError {
        let found = self.text.get(self.value.span()).unwrap_or_default();
        let problem = format!("`{}` cannot be {found}", self.key.get_ref());
        wrong(self.text, self.key.span().start, problem, format!("write {remedy}"))
    }

    fn text(&self) -> Option<&str> {
        self.value.get_ref().as_str()
    }

    fn is(&self, word: &str) -> bool {
        self.text() == Some(word)
    }

    fn flag(&self) -> Result<bool, ScriptError> {
        self.value.get_ref().as_bool().ok_or_else(|| self.wrong("true or false"))
    }

    fn number(&self) -> Option<f64> {
        match self.value.get_ref() {
            DeValue::Integer(number) => {
                i64::from_str_radix(number.as_str(), number.radix()).ok().map(|number| number as f64)
            }
            DeValue::Float(number) => number.as_str().parse().ok(),
            _ => None,
        }
    }

    /// A number from `low` to `high`, times `scale`, as a whole number.
    fn scaled(&self, scale: f64, low: f64, high: f64, unit: &str) -> Result<f64, ScriptError> {
        let number = self.number().filter(|number| (low..=high).contains(number));
        let number = number.ok_or_else(|| self.wrong(&format!("a number from {low} to {high} ({unit})")))?;
        Ok((number * scale).round())
    }

    fn of(&self, words: &[(&str, Change)]) -> Result<Change, ScriptError> {
        let word = words.iter().find(|(word, _)| self.is(word));
        word.map(|(_, change)| *change).ok_or_else(|| self.wrong(&listed(words.iter().map(|(word, _)| *word))))
    }

    fn bit_rate(&self) -> Result<u32, ScriptError> {
        let rate = self.number().and_then(|kbit| BIT_RATES.into_iter().find(|rate| f64::from(*rate) == kbit * 1e3));
        let all: Vec<String> = BIT_RATES.iter().map(|rate| (f64::from(*rate) / 1e3).to_string()).collect();
        rate.ok_or_else(|| self.wrong(&format!("one of {} (kbit/s), or \"any\"", all.join(", "))))
    }

    fn clear(&self) -> Result<Vec<Change>, ScriptError> {
        if self.is("all") { one(Change::ClearAll) } else { one(Change::Clear(self.fault(", or \"all\"")?)) }
    }

    /// A fault by its letter or its name.
    fn fault(&self, also: &str) -> Result<FaultKind, ScriptError> {
        let asked = self.text().unwrap_or_default();
        let faults = self.model.faults;
        let named = |kind| FaultKind::ALL.iter().find(|(known, _)| *known == kind).map_or("", |(_, name)| *name);
        let found = faults.iter().find(|fault| {
            asked.eq_ignore_ascii_case(named(fault.kind)) || asked.eq_ignore_ascii_case(fault.code.label)
        });
        let letters = || [faults.first(), faults.last()].map(|fault| fault.map_or("", |fault| fault.code.label));
        let remedy = || {
            let ([first, last], names) = (letters(), listed(faults.iter().map(|fault| named(fault.kind))));
            format!("a letter from {first:?} to {last:?}, or {names}{also}")
        };
        found.map(|fault| fault.kind).ok_or_else(|| self.wrong(&remedy()))
    }
}

/// `"a", "b" or "c"`.
fn listed<'w>(words: impl Iterator<Item = &'w str>) -> String {
    let mut words: Vec<String> = words.map(|word| format!("{word:?}")).collect();
    let last = words.pop().unwrap_or_default();
    if words.is_empty() { last } else { format!("{} or {last}", words.join(", ")) }
}
