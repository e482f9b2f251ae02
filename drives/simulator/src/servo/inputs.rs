//! The world around a servo: its supply, its shaft, its switches.

#[cfg(feature = "script")]
use crate::script::{Range, Takes};
use crate::trajectory::State;

/// The world around a servo, set by a test or a user.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inputs {
    /// Whether the motor is supplied (status word, bit 4).
    pub supply: bool,
    /// Whether the enable input is active, without which the motor has no torque.
    pub enable: bool,
    /// Whether something holds the shaft.
    pub blocked: bool,
    /// Whether SYNC is kept from the cyclic modes.
    pub ignores_sync: bool,
    /// Causes of faults. While one of them lasts, no fault can be reset.
    pub faults: Causes,
    /// Warnings (status word, bit 7).
    pub warnings: Causes,
    /// Further bits of 60FDh: the interlock in bit 3, those of the manufacturer from bit 16 on.
    pub digital: u32,
    /// The levels of touch probes 1 and 2.
    pub probes: [bool; 2],
    /// The switches of the machine.
    pub machine: Machine,
}

/// The positions of switches and index pulses, in position units from where the axis stood when it was first switched
/// on; polarity and homing do not move them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Machine {
    /// The negative limit switch is active at this position and below.
    pub negative_limit: Option<f64>,
    /// The positive limit switch is active at this position and above.
    pub positive_limit: Option<f64>,
    /// The home switch is active between these positions; either may be infinite.
    pub home_switch: Option<(f64, f64)>,
    /// The position of an index pulse, and the distance to the next one.
    pub index: Option<(f64, f64)>,
}

/// Causes of faults or warnings by their EMCY codes, up to eight of them, the oldest first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Causes {
    /// The codes, padded with 0, since 0000h means no error.
    codes: [u16; 8],
}

impl Causes {
    /// No cause.
    pub const NONE: Causes = Causes { codes: [0; 8] };

    /// These causes; `None` if there are more than eight, or one is 0000h.
    #[must_use]
    pub fn all(codes: &[u16]) -> Option<Self> {
        let mut causes = Causes::NONE;
        codes.iter().all(|code| causes.insert(*code)).then_some(causes)
    }

    /// Adds a cause. Returns whether it is in the set now: not if there are eight others already, nor for 0000h.
    pub fn insert(&mut self, code: u16) -> bool {
        let free = self.codes.iter().position(|known| [0, code].contains(known)).filter(|_| code != 0);
        if let Some(free) = free {
            self.codes[free] = code;
        }
        free.is_some()
    }

    /// Removes a cause.
    pub fn remove(&mut self, code: u16) {
        *self = self.without(code.into());
    }

    /// The causes that are not in `others`.
    #[must_use]
    pub fn without(self, others: Causes) -> Causes {
        let mut left = Causes::NONE;
        self.iter().filter(|code| !others.contains(*code)).for_each(|code| _ = left.insert(code));
        left
    }

    /// Whether the set has this cause.
    #[must_use]
    pub fn contains(self, code: u16) -> bool {
        self.iter().any(|known| known == code)
    }

    /// Whether there is no cause.
    #[must_use]
    pub fn is_empty(self) -> bool {
        self == Causes::NONE
    }

    /// The codes, in the order in which the causes came.
    pub fn iter(self) -> impl Iterator<Item = u16> {
        self.codes.into_iter().take_while(|code| *code != 0)
    }
}

/// One cause, or none.
impl From<Option<u16>> for Causes {
    fn from(code: Option<u16>) -> Self {
        let mut causes = Causes::NONE;
        code.map(|code| causes.insert(code));
        causes
    }
}

impl From<u16> for Causes {
    fn from(code: u16) -> Self {
        Some(code).into()
    }
}

/// An input with its name.
pub(super) struct Row {
    pub(super) name: &'static str,
    #[cfg(feature = "script")]
    pub(super) what: &'static str,
    kind: Kind,
}

/// The type of an input's value, and its place in [`Inputs`].
enum Kind {
    Flag(fn(&mut Inputs) -> &mut bool),
    /// Codes of emergencies.
    Codes(fn(&mut Inputs) -> &mut Causes),
    /// Bits of [`Inputs::digital`].
    Bits,
    /// A position, at least this; or none.
    #[cfg_attr(not(feature = "script"), allow(dead_code, reason = "a script shows places and their ranges"))]
    Place(f64, fn(&Machine) -> Option<f64>, fn(&mut Machine, Option<f64>)),
}

macro_rules! inputs {
    ($($name:literal, $what:literal: $kind:expr;)*) => {
        /// All inputs.
        pub(super) const ROWS: &[Row] = &[$(Row {
            name: $name,
            #[cfg(feature = "script")]
            what: $what,
            kind: $kind,
        }),*];
    };
}

inputs! {
    "supply", "the motor is supplied": Kind::Flag(|world| &mut world.supply);
    "enable", "the input without which the motor gets no torque": Kind::Flag(|world| &mut world.enable);
    "blocked", "something holds the shaft": Kind::Flag(|world| &mut world.blocked);
    "ignores_sync", "SYNC does not get through to the cyclic modes": Kind::Flag(|world| &mut world.ignores_sync);
    "fault", "the cause of a fault; while it lasts, the fault cannot be reset": Kind::Codes(|world| &mut world.faults);
    "warning", "the cause of a warning": Kind::Codes(|world| &mut world.warnings);
    "digital", "further bits of 60FDh": Kind::Bits;
    "probe_1", "the level of touch probe 1": Kind::Flag(|world| &mut world.probes[0]);
    "probe_2", "the level of touch probe 2": Kind::Flag(|world| &mut world.probes[1]);
    "negative_limit", "the negative limit switch is active here and below":
        Kind::Place(-1e9, |machine| machine.negative_limit, |machine, place| machine.negative_limit = place);
    "positive_limit", "the positive limit switch is active here and above":
        Kind::Place(-1e9, |machine| machine.positive_limit, |machine, place| machine.positive_limit = place);
    "home_low", "the home switch is active from here on":
        Kind::Place(-1e9, |machine| machine.home_switch.map(|(low, _)| low), |machine, place| {
            let high = machine.home_switch.map_or(f64::INFINITY, |(_, high)| high);
            machine.home_switch = place.map(|low| (low, high));
        });
    "home_high", "the home switch is active up to here":
        Kind::Place(-1e9, |machine| machine.home_switch.map(|(_, high)| high), |machine, place| {
            let low = machine.home_switch.map_or(f64::NEG_INFINITY, |(low, _)| low);
            machine.home_switch = place.map(|high| (low, high));
        });
    "index", "where there is an index pulse":
        Kind::Place(-1e9, |machine| machine.index.map(|(first, _)| first), |machine, place| {
            let distance = machine.index.map_or(1000.0, |(_, distance)| distance);
            machine.index = place.map(|first| (first, distance));
        });
    "index_distance", "the distance from one index pulse to the next":
        Kind::Place(0.0, |machine| machine.index.map(|(_, distance)| distance), |machine, place| {
            let first = machine.index.map_or(0.0, |(first, _)| first);
            machine.index = place.filter(|distance| *distance > 0.0).map(|distance| (first, distance));
        });
}

impl Row {
    pub(super) fn named(name: &str) -> Option<&'static Self> {
        ROWS.iter().find(|row| row.name == name)
    }

    /// Sets the input. The error describes the allowed values.
    pub(super) fn set(&self, world: &mut Inputs, value: &str) -> Result<(), &'static str> {
        let number = |text: &str| {
            let hex = text.strip_prefix("0x").and_then(|digits| u32::from_str_radix(digits, 16).ok());
            hex.or_else(|| text.parse().ok())
        };
        match self.kind {
            Kind::Flag(place) => *place(world) = value.parse().map_err(|_| "true or false")?,
            Kind::Codes(place) => {
                let codes = value.split_whitespace().map(|text| u16::try_from(number(text)?).ok());
                let codes = if value == "none" { Some(Vec::new()) } else { codes.collect::<Option<Vec<u16>>>() };
                let causes = codes.and_then(|codes| Causes::all(&codes));
                *place(world) = causes.ok_or("a code such as 0x4310, up to eight of them, or \"none\"")?;
            }
            Kind::Bits => world.digital = number(value).ok_or("a number of 32 bits")?,
            Kind::Place(_, _, put) if value == "none" => put(&mut world.machine, None),
            Kind::Place(_, _, put) => match value.parse::<f64>() {
                Ok(position) if !position.is_nan() => put(&mut world.machine, Some(position)),
                _ => return Err("a position, or \"none\""),
            },
        }
        Ok(())
    }
}

/// Descriptions for buttons.
#[cfg(feature = "script")]
impl Row {
    pub(super) fn takes(&self) -> Takes {
        match self.kind {
            Kind::Flag(_) => Takes::Flag,
            Kind::Codes(_) => Takes::Number(Range::new(1.0, 65_535.0, "EMCY code"), Some("none")),
            Kind::Bits => Takes::Number(Range::new(0.0, 4_294_967_295.0, "bits"), None),
            Kind::Place(low, ..) => Takes::Number(Range::new(low, 1e9, "position units"), Some("none")),
        }
    }

    /// The value of the input as [`Inputs::set`] takes it.
    pub(super) fn value(&self, mut world: Inputs) -> String {
        let none = || "none".to_owned();
        match self.kind {
            Kind::Flag(place) => place(&mut world).to_string(),
            Kind::Codes(place) => {
                let codes: Vec<String> = place(&mut world).iter().map(|code| format!("{code:#06x}")).collect();
                if codes.is_empty() { none() } else { codes.join(" ") }
            }
            Kind::Bits => format!("{:#010x}", world.digital),
            Kind::Place(_, get, _) => get(&world.machine).map_or_else(none, |place| place.to_string()),
        }
    }
}

impl Inputs {
    /// Sets an input by its name: `blocked` to `true`, `fault` to `0x4310` or `none`, `negative_limit` to `-20000`.
    ///
    /// After an error, nothing has changed.
    pub fn set(&mut self, key: &str, value: &str) -> Result<(), String> {
        let row = Row::named(key).ok_or_else(|| {
            let names: Vec<_> = ROWS.iter().map(|row| row.name).collect();
            format!("there is no input {key:?}; there are {}", names.join(", "))
        })?;
        row.set(self, value).map_err(|wanted| format!("{key} is {wanted}, not {value:?}"))
    }
}

impl Default for Inputs {
    fn default() -> Self {
        Inputs {
            supply: true,
            enable: true,
            blocked: false,
            ignores_sync: false,
            faults: Causes::NONE,
            warnings: Causes::NONE,
            digital: 0,
            probes: [false; 2],
            machine: Machine::default(),
        }
    }
}

/// No switches, and an index pulse every 1000 position units.
impl Default for Machine {
    fn default() -> Self {
        Machine { negative_limit: None, positive_limit: None, home_switch: None, index: Some((500.0, 1000.0)) }
    }
}

impl Machine {
    /// Bits 0 to 2 of 60FDh at a position: negative limit switch, positive limit switch, home switch.
    pub(super) fn bits(&self, state: State) -> u32 {
        let [negative, positive, before, behind] = self.passed(state);
        let home = self.home_switch.is_some() && !before && !behind;
        u32::from(negative) | u32::from(positive) << 1 | u32::from(home) << 2
    }

    /// Which thresholds are passed; each changes at most once while the axis moves in one direction.
    pub(super) fn passed(&self, state: State) -> [bool; 4] {
        let (low, high) = self.home_switch.unwrap_or_default();
        [
            self.negative_limit.is_some_and(|limit| state.position <= limit),
            self.positive_limit.is_some_and(|limit| state.position >= limit),
            state.position < low,
            state.position > high,
        ]
    }

    /// The limit switch in the direction of `sign`.
    pub(super) fn limit(&self, sign: f64) -> Option<f64> {
        if sign < 0.0 { self.negative_limit } else { self.positive_limit }
    }

    /// The first index pulse beyond a position in the direction of `sign`.
    pub(super) fn index_beyond(&self, position: f64, sign: f64) -> Option<f64> {
        let (first, distance) = self.index.filter(|(_, distance)| *distance > 0.0)?;
        let turns = (position - first) / distance;
        let turn = if sign < 0.0 { turns.ceil() - 1.0 } else { turns.floor() + 1.0 };
        Some(first + turn * distance)
    }
}
