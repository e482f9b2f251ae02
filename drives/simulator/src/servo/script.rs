//! Scripts for a servo: changes and conditions.
//!
//! Besides the keys of every script ([`crate::script`]), a step has those of [`Inputs::set`], and:
//!
//! | Key | Value | What it does |
//! |---|---|---|
//! | `turn` | position units | somebody turns the shaft by hand; a motor that has torque holds it |
//! | `power` | `"on"`, `"off"`, `"cycle"` | the supply is switched |
//!
//! ```toml
//! # Half a second after it has set off, something holds the shaft, and two seconds later lets it go.
//! [[step]]
//! when = "moving"
//! after_ms = 500
//! blocked = true
//!
//! [[step]]
//! after_ms = 2000
//! blocked = false
//! ```

use lexican_runtime::Instant;
use lexican_runtime::profile::cia402::{State, status};
use lexican_runtime::wire::nmt::NmtState;

use super::inputs::{Inputs, Row};
use super::model::Servo;
use super::objects::STATUS_WORD;
use crate::script::{Condition, Following};
use crate::storage::Storage;

/// What happens to a servo, step by step.
pub type Script = crate::script::Script<Change>;

/// Something that happens to a servo.
#[derive(Clone, Debug, PartialEq)]
pub enum Change {
    /// An input changes.
    Input(Setting),
    /// Somebody turns the shaft by this many position units, if it is free to turn.
    Turn(f64),
    /// The supply of the device is switched on or off.
    Power(bool),
    /// The supply is switched off and on again.
    PowerCycle,
}

/// An input and its value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Setting {
    key: &'static str,
    value: String,
}

impl Setting {
    /// An input by its name, and its value, as [`Inputs::set`] has them.
    pub fn new(key: &str, value: &str) -> Result<Self, String> {
        Inputs::default().set(key, value)?;
        Ok(Setting { key: Row::named(key).map_or("", |row| row.name), value: value.to_owned() })
    }

    /// Sets the input.
    pub fn apply(&self, inputs: &mut Inputs) {
        // `new` has tried the same.
        let _ = inputs.set(self.key, &self.value);
    }
}

/// What the conditions of a script see of a servo and its device.
#[derive(Clone, Copy, Debug)]
pub struct Seen<'a> {
    /// The servo.
    pub servo: &'a Servo,
    /// Its dictionary.
    pub storage: &'a dyn Storage,
    /// The NMT state; `None` while the device is off.
    pub state: Option<NmtState>,
}

impl Seen<'_> {
    /// Whether a condition holds. "Positioning" is a travel of profile position mode; positions are those of 6064h, but
    /// do not wrap around at 607Bh.
    #[must_use]
    pub fn is_so(&self, now: Instant, condition: Condition) -> bool {
        let (servo, on) = (self.servo, self.state.is_some());
        match condition {
            Condition::Moving => servo.is_moving(now),
            Condition::Standing => !servo.is_moving(now),
            Condition::Positioning => on && servo.points.travels,
            Condition::TargetReached => {
                on && self.storage.raw(STATUS_WORD).unwrap_or_default() as u16 & status::TARGET_REACHED != 0
            }
            Condition::State(state) => on && servo.state() == state,
            Condition::NoFault => on && servo.state() != State::Fault,
            Condition::Nmt(state) => self.state == Some(state),
            Condition::On => on,
            Condition::Off => !on,
            Condition::PositionAbove(position) => self.position(servo.shaft(now).position) > f64::from(position),
            Condition::PositionBelow(position) => self.position(servo.shaft(now).position) < f64::from(position),
        }
    }

    /// When to check the next step again.
    #[must_use]
    pub fn next_step(&self, following: &Following<Change>) -> Option<Instant> {
        following
            .next_step(|at, condition| self.is_so(at, condition), |at, condition| self.may_become_so(at, condition))
    }

    /// When a condition may come true by itself after `now`, as far as the servo has no event for it.
    fn may_become_so(&self, now: Instant, condition: Condition) -> Option<Instant> {
        let way = &self.servo.way;
        let passes = |is_beyond: &dyn Fn(f64) -> bool| {
            let moves = self.servo.is_moving(now);
            moves.then(|| way.next_change(now, |state| is_beyond(self.position(state.position)))).flatten()
        };
        match condition {
            // The axis of a device that is off coasts to a standstill.
            Condition::Standing => way.end().filter(|end| *end > now),
            Condition::PositionAbove(position) => passes(&|at| at > f64::from(position)),
            Condition::PositionBelow(position) => passes(&|at| at < f64::from(position)),
            _ => None,
        }
    }

    fn position(&self, shaft: f64) -> f64 {
        let parameters = self.servo.parameters(self.storage);
        ((shaft - self.servo.zero) * parameters.position_sign()).round()
    }
}

#[cfg(feature = "script")]
pub use from_toml::inputs;

#[cfg(feature = "script")]
mod from_toml {
    use super::{Change, Setting};
    use crate::script::{FromToml, Input, Range, Reading, ScriptError, Takes};
    use crate::servo::inputs::{ROWS, Row};
    use crate::servo::{Inputs, ServoModel};

    const TURN: Range = Range::new(-1e9, 1e9, "position units");
    /// Values of the key `power`; `None` is off and on again.
    const POWER: &[(&str, Option<bool>)] = &[("on", Some(true)), ("off", Some(false)), ("cycle", None)];

    /// The inputs of a servo with their present values: one for each key of a step.
    #[must_use]
    pub fn inputs(world: &Inputs) -> Vec<Input> {
        let own = ROWS.iter().map(|row| Input {
            name: row.name,
            takes: row.takes(),
            what: row.what,
            value: Some(row.value(*world)),
        });
        let turn = Input {
            name: "turn",
            takes: Takes::Number(TURN, None),
            what: "somebody turns the shaft by hand; a motor that has torque holds it",
            value: None,
        };
        let what = "the supply of the device is switched";
        let power = Input { name: "power", takes: Takes::words(POWER), what, value: None };
        own.chain([turn, power]).collect()
    }

    impl FromToml for Change {
        type Model = ServoModel;

        const EXAMPLE: &'static str = "blocked = true";

        fn keys() -> impl Iterator<Item = &'static str> {
            ROWS.iter().map(|row| row.name).chain(["turn", "power"])
        }

        fn read(_: &ServoModel, reading: &Reading<'_>) -> Result<Vec<Self>, ScriptError> {
            let change = match reading.key() {
                "turn" => Change::Turn(reading.scaled(1.0, TURN)?),
                "power" => reading.of(POWER)?.map_or(Change::PowerCycle, Change::Power),
                key => {
                    let value = reading.plain();
                    let row = Row::named(key).ok_or_else(|| reading.wrong("an input"))?;
                    row.set(&mut Inputs::default(), &value).map_err(|wanted| reading.wrong(wanted))?;
                    Change::Input(Setting { key: row.name, value })
                }
            };
            Ok(vec![change])
        }
    }
}
