//! What a drive can be ordered to do: each order in a row, with its words.

use super::ending::Ending;
use super::scales::Scales;

/// The texts of an order.
struct Texts {
    word: &'static str,
    help: &'static str,
    doing: &'static str,
    done: &'static str,
}

macro_rules! orders {
    ($($order:ident $(($value:ty))? $([$attribute:meta])?: $word:literal, $help:literal, $doing:literal, $done:literal;)*) => {
        /// What a person orders of a drive, with its value. Positions and velocities are as its objects have them.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum Order {
            $(#[doc = $help] $order $(($value))?,)*
        }

        /// What a person orders of a drive, without its value.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Deserialize, serde::Serialize)]
        pub enum Verb {
            $(#[doc = $help] #[serde(rename = $word)] $(#[$attribute])? $order,)*
        }

        impl Order {
            /// The order without its value.
            #[must_use]
            pub const fn verb(&self) -> Verb {
                match self {
                    $(Order::$order { .. } => Verb::$order,)*
                }
            }
        }

        impl Verb {
            /// All of them.
            pub const ALL: &'static [Verb] = &[$(Verb::$order),*];

            const fn texts(self) -> Texts {
                match self {
                    $(Verb::$order => Texts { word: $word, help: $help, doing: $doing, done: $done },)*
                }
            }
        }
    };
}

// By its word; in a sentence; while the drive does it; when it has done it.
orders! {
    Enable: "enable", "Lead it to OPERATION ENABLED: it has torque, and nothing moves", "enabling it", "it is enabled";
    Disable: "disable", "Stop it, then take its torque away", "stopping and disabling it", "it is disabled";
    ResetFault: "reset-fault", "Reset a fault", "resetting its fault", "it was in no fault";
    MoveTo(i32): "move-to", "Travel to a position", "travels{from} to {value}", "it has reached its target";
    Step(Option<i32>): "step", "Travel by a distance; without one, by the step that the drive is set to (inching)",
        "travels{from} by {value}", "it has reached its target";
    Run(i32): "run", "Run at a velocity for a time or until interrupted, then stop",
        "runs at {value} {until}", "it has run, and has been stopped";
    Home(Option<i8>): "home", "Find the reference point, by a method of 6098h or the one that the drive is set to",
        "homes by {value}{from}", "it has found its reference point";
    Stop: "stop", "Stop what moves, with the programmed deceleration", "stopping it", "it stands";
    QuickStop: "quick-stop", "Stop what moves, with full deceleration", "stopping it at once", "it stands";
    Resume: "resume", "Go on with a travel that is interrupted, by a stop say",
        "goes on with its travel{from}", "it has reached its target";
    Drop: "drop", "Drop what is left of a travel that is interrupted, and disable the drive",
        "dropping what is left of its travel, and disabling it",
        "what was left of its travel is dropped, and it is disabled";
    Watch [serde(skip)]: "watch", "Show state, position and velocity for a time or until interrupted; nothing is ordered",
        "watching it", "watched";
}

impl Order {
    /// Its position, distance, velocity or homing method.
    #[must_use]
    pub const fn value(&self) -> Option<i32> {
        match *self {
            Order::MoveTo(value) | Order::Step(Some(value)) | Order::Run(value) => Some(value),
            Order::Home(Some(method)) => Some(method as i32),
            _ => None,
        }
    }

    /// Its value with the unit.
    #[must_use]
    pub fn value_text(&self, scales: &Scales<'_>) -> String {
        match (self, self.value()) {
            (Order::Run(velocity), _) => scales.target_velocity(*velocity),
            (Order::Home(_), Some(method)) => format!("method {method}"),
            (Order::Home(_), None) => "the method that it is set to".to_owned(),
            (_, value) => value.map_or_else(String::new, |value| scales.target(value)),
        }
    }

    /// What the drive does by it, in a sentence: from a position, if that is known, and `until` when it runs.
    #[must_use]
    pub fn words(&self, scales: &Scales<'_>, from: Option<i32>, until: &str) -> String {
        let from = from.map_or_else(String::new, |from| format!(" from {}", scales.position(from)));
        let doing = if *self == Order::Step(None) { "takes a step{from}" } else { self.verb().texts().doing };
        doing.replace("{from}", &from).replace("{value}", &self.value_text(scales)).replace("{until}", until)
    }

    /// How it has ended, in a sentence.
    #[must_use]
    pub fn sentence(&self, ending: Ending) -> String {
        match ending {
            Ending::Reached => self.verb().texts().done.to_owned(),
            Ending::Blocked | Ending::Stalled | Ending::TimedOut | Ending::ForeignOrder if self.moves() => {
                format!("{ending}; it has been stopped")
            }
            ending => ending.to_string(),
        }
    }
}

impl Verb {
    /// As people type it.
    #[must_use]
    pub const fn word(self) -> &'static str {
        self.texts().word
    }

    /// What the drive is to do, in a sentence.
    #[must_use]
    pub const fn help(self) -> &'static str {
        self.texts().help
    }

    /// Whether it only lets the drive stand.
    #[must_use]
    pub const fn is_stop(self) -> bool {
        matches!(self, Verb::Stop | Verb::QuickStop)
    }

    /// Whether it has no end of its own: a time that is over ends it, or a person.
    #[must_use]
    pub const fn lasts(self) -> bool {
        matches!(self, Verb::Run | Verb::Watch)
    }

    /// Whether its sentence says from which position.
    #[must_use]
    pub fn begins_at_a_position(self) -> bool {
        self.texts().doing.contains("{from}")
    }

    /// Checks whether a value is there where one belongs.
    ///
    /// # Errors
    ///
    /// What is missing, or too much.
    pub fn check(self, value: Option<&str>) -> Result<(), String> {
        match (self, value) {
            (Verb::MoveTo, None) => Err("where to? move-to takes a position, such as 5000 or \"5 mm\"".to_owned()),
            (Verb::Run, None) => Err("how fast? run takes a velocity, such as 60 or \"60 rpm\"".to_owned()),
            (Verb::MoveTo | Verb::Run | Verb::Step | Verb::Home, _) | (_, None) => Ok(()),
            (_, Some(value)) => Err(format!("this order takes no value, and {value:?} is there")),
        }
    }

    /// The order with its value: a position, a distance or a velocity with or without unit, or a homing method.
    ///
    /// # Errors
    ///
    /// As [`check`](Self::check), and why the text is no value of it.
    pub fn order(self, value: Option<&str>, scales: &Scales<'_>) -> Result<Order, String> {
        self.check(value)?;
        let position = |text| scales.parse_position(text);
        let method = |text: &str| {
            text.parse().map_err(|_| format!("{text:?} is no homing method: these are -128 to 127 (6098h)"))
        };
        Ok(match self {
            Verb::Enable => Order::Enable,
            Verb::Disable => Order::Disable,
            Verb::ResetFault => Order::ResetFault,
            Verb::MoveTo => Order::MoveTo(position(value.unwrap_or_default())?),
            Verb::Step => Order::Step(value.map(position).transpose()?),
            Verb::Run => Order::Run(scales.parse_velocity(value.unwrap_or_default())?),
            Verb::Home => Order::Home(value.map(method).transpose()?),
            Verb::Stop => Order::Stop,
            Verb::QuickStop => Order::QuickStop,
            Verb::Resume => Order::Resume,
            Verb::Drop => Order::Drop,
            Verb::Watch => Order::Watch,
        })
    }
}
