//! Values with their places in the file, and how values are written.

use std::borrow::Cow;
use std::cmp::Ordering;
use std::ops::{Deref, Range};

use lexican_runtime::wire::pdo::TransmissionType;
use lexican_runtime::{Duration, NodeId};
use lexican_toolbox::text::duration::{in_milliseconds, milliseconds};
use lexican_toolbox::text::node_id::node_id;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Deserializer};
use toml::Spanned;

/// A value with its place in the file.
#[derive(Clone, Debug, JsonSchema)]
#[schemars(transparent)]
pub struct At<T> {
    /// The value.
    pub value: T,
    /// The byte range in the file.
    #[schemars(skip)]
    pub span: Range<usize>,
}

impl<T> Deref for At<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.value
    }
}

impl<T: PartialEq> PartialEq for At<T> {
    fn eq(&self, other: &Self) -> bool {
        self.value == other.value
    }
}

impl<T: Eq> Eq for At<T> {}

impl<T: Ord> PartialOrd for At<T> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl<T: Ord> Ord for At<T> {
    fn cmp(&self, other: &Self) -> Ordering {
        self.value.cmp(&other.value)
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for At<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let spanned = Spanned::<T>::deserialize(deserializer)?;
        let span = spanned.span();
        Ok(At { value: spanned.into_inner(), span })
    }
}

/// Implements how a type is written: the TOML values it is read from, and, unless derived, its JSON Schema.
macro_rules! spelling {
    ($name:ident, $schema:tt, $expecting:literal, $($from:ident: $read:expr),+ $(,)?) => {
        spelling!($name, $expecting, $($from: $read),+);

        impl JsonSchema for $name {
            fn inline_schema() -> bool {
                true
            }

            fn schema_name() -> Cow<'static, str> {
                stringify!($name).into()
            }

            fn json_schema(_: &mut SchemaGenerator) -> Schema {
                json_schema!($schema)
            }
        }
    };
    ($name:ident, $expecting:literal, $($from:ident: $read:expr),+ $(,)?) => {
        impl<'de> Deserialize<'de> for $name {
            fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                #[allow(unused_imports, reason = "some are not read from all kinds of values")]
                use serde::de::{Error, MapAccess, SeqAccess, Visitor, value};
                struct Spelling;
                impl<'de> Visitor<'de> for Spelling {
                    type Value = $name;

                    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                        f.write_str($expecting)
                    }

                    $(spelling!(@$from $name, $read);)+
                }
                deserializer.deserialize_any(Spelling)
            }
        }
    };
    (@text $name:ident, $read:expr) => {
        fn visit_str<E: Error>(self, text: &str) -> Result<$name, E> {
            let read: fn(&str) -> Result<$name, String> = $read;
            read(text).map_err(E::custom)
        }
    };
    (@number $name:ident, $read:expr) => {
        fn visit_i64<E: Error>(self, number: i64) -> Result<$name, E> {
            let read: fn(i64) -> Result<$name, String> = $read;
            read(number).map_err(E::custom)
        }
    };
    (@real $name:ident, $read:expr) => {
        fn visit_f64<E: Error>(self, number: f64) -> Result<$name, E> {
            Ok($read(number))
        }
    };
    (@flag $name:ident, $read:expr) => {
        fn visit_bool<E: Error>(self, flag: bool) -> Result<$name, E> {
            Ok($read(flag))
        }
    };
    (@list $name:ident, $read:expr) => {
        fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<$name, A::Error> {
            Deserialize::deserialize(value::SeqAccessDeserializer::new(list)).map($read)
        }
    };
    (@table $name:ident, $read:expr) => {
        fn visit_map<A: MapAccess<'de>>(self, table: A) -> Result<$name, A::Error> {
            Deserialize::deserialize(value::MapAccessDeserializer::new(table)).map($read)
        }
    };
}
pub(crate) use spelling;

/// A duration in whole milliseconds: `"100 ms"`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Time(pub(crate) Duration);

impl Time {
    #[must_use]
    pub(crate) fn ms(self) -> u64 {
        in_milliseconds(self.0)
    }
}

spelling!(Time, { "type": "string", "examples": ["100 ms", "2 s"] }, "a time with its unit, such as \"100 ms\"",
    text: |text| milliseconds(text).map(Time),
    number: |number| Err(format!("{number} of what? write \"{number} ms\" or \"{number} s\"")));

/// A bit rate, in bit/s: `"500 kbit/s"`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct BitRate(pub(crate) u32);

spelling!(BitRate, { "type": "string", "examples": ["125 kbit/s", "500 kbit/s", "1 Mbit/s"] },
    "a bit rate such as \"500 kbit/s\"",
    text: |text| bit_rate(text).ok_or_else(|| format!("{text:?} is no bit rate such as \"500 kbit/s\" or \"1 Mbit/s\"")),
    number: |number| Err(format!("{number} of what? write \"{number} kbit/s\"")));

fn bit_rate(text: &str) -> Option<BitRate> {
    let (number, factor) = match text.strip_suffix("kbit/s") {
        Some(number) => (number, 1_000),
        None => (text.strip_suffix("Mbit/s")?, 1_000_000),
    };
    let rate = number.trim().parse::<u32>().ok()?.checked_mul(factor)?;
    (10_000..=1_000_000).contains(&rate).then_some(BitRate(rate))
}

/// A node-ID; `None` for a device that gets one by LSS.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Id(pub(crate) Option<NodeId>);

spelling!(Id, { "anyOf": [{ "type": "integer", "minimum": 1, "maximum": 127 }, { "const": "none" }] },
    "a node-ID from 1 to 127",
    text: |text| match text {
        "none" => Ok(Id(None)),
        other => Err(format!("{other:?} is no node-ID: write a number, or \"none\" for one by LSS")),
    },
    number: |number| Ok(Id(Some(node_id(&number.to_string())?))));

/// The time within which a node has to notice that its manager is gone; `None` if it need not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Protection(pub(crate) Option<Duration>);

spelling!(Protection, { "type": "string", "examples": ["500 ms", "none"] }, "a time such as \"500 ms\", or \"none\"",
text: |text| match text {
    "none" => Ok(Protection(None)),
    time => milliseconds(time).map(|time| Protection(Some(time))),
});

/// A revision number: exact, or a minimum (`">= 0x10002"`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Revision {
    /// The number.
    pub number: u32,
    /// Whether a later revision is accepted.
    pub or_later: bool,
}

spelling!(Revision, { "anyOf": [{ "type": "integer", "minimum": 0 }, { "type": "string", "examples": [">= 0x10002"] }] },
"a revision number, or the least one: \">= 0x10002\"",
text: |text| {
    let number = text.strip_prefix(">=").map(|number| number.trim().replace('_', ""));
    let number = number.and_then(|number| match number.strip_prefix("0x") {
        Some(digits) => u32::from_str_radix(digits, 16).ok(),
        None => number.parse().ok(),
    });
    let revision = number.map(|number| Revision { number, or_later: true });
    revision.ok_or_else(|| format!("{text:?} is no revision such as \">= 0x10002\""))
},
number: |number| match u32::try_from(number) {
    Ok(number) => Ok(Revision { number, or_later: false }),
    Err(_) => Err(format!("{number} is no revision number: it has 32 bits")),
});

/// When a PDO is sent or takes effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Transmission(pub(crate) TransmissionType);

spelling!(Transmission,
{ "anyOf": [{ "type": "string", "examples": ["event", "sync", "sync 4"] }, { "type": "integer", "minimum": 0, "maximum": 255 }] },
"a transmission type: \"event\", \"sync\", \"sync 4\", or its number",
text: |text| match (text, text.strip_prefix("sync ").map(str::parse)) {
    ("event", _) => Ok(Transmission(TransmissionType::EventProfile)),
    ("sync", _) => Ok(Transmission(TransmissionType::SynchronousCyclic(1))),
    (_, Some(Ok(each @ 1..=240))) => Ok(Transmission(TransmissionType::SynchronousCyclic(each))),
    _ => Err(format!("{text:?} is no transmission type: write \"event\", \"sync\", \"sync 4\", or its number")),
},
number: |number| match u8::try_from(number) {
    Ok(code) => Ok(Transmission(TransmissionType::from_code(code))),
    Err(_) => Err(format!("{number} is no transmission type: they are 0 to 255")),
});

/// A value as users write it, with its unit: a text, a number, `true` or `false`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Written(pub(crate) String);

spelling!(Written, { "type": ["string", "number", "boolean"] },
    "a value: a number, a text such as \"2.5 mm\", true or false",
    text: |text| Ok(Written(text.to_owned())),
    number: |number| Ok(Written(number.to_string())),
    real: |number: f64| Written(number.to_string()),
    flag: |flag: bool| Written(flag.to_string()));
