//! Whether the data sheet allows writing a value.

use std::cmp::Ordering;

use lexican_eds::model::{AccessType, Entry, Meaning, Value};
use lexican_runtime::NodeId;

use super::{DeviceValues, Limits};

/// Why the data sheet does not allow writing a value.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum WriteRefusal {
    /// The entry is not writable.
    #[error("the data sheet says {}: the object cannot be written", .0.name())]
    Access(AccessType),
    /// The value is below the limit.
    #[error("{value} is too low: the data sheet allows {allowed}")]
    TooLow {
        /// With its unit.
        value: String,
        /// The range, with its unit.
        allowed: String,
    },
    /// The value is above the limit.
    #[error("{value} is too high: the data sheet allows {allowed}")]
    TooHigh {
        /// With its unit.
        value: String,
        /// The range, with its unit.
        allowed: String,
    },
    /// The enumeration has no such value.
    #[error("{value} is none of the values that the data sheet names: {names}")]
    Unnamed {
        /// As it was to be written.
        value: i128,
        /// The names in the enumeration, with their numbers.
        names: String,
    },
}

impl DeviceValues<'_> {
    /// Checks whether the data sheet allows a value for an entry, by access, limits and enumeration.
    pub fn check_write(&self, entry: &Entry, value: &Value, node: NodeId) -> Result<(), WriteRefusal> {
        if !entry.access.writable() {
            return Err(WriteRefusal::Access(entry.access));
        }
        if let Some((side, limits)) = Limits::violated(entry, node, |when| self.holds(when), value) {
            let (value, allowed) = (self.describe(entry, value), self.range(entry, &limits));
            return Err(match side {
                Ordering::Less => WriteRefusal::TooLow { value, allowed },
                _ => WriteRefusal::TooHigh { value, allowed },
            });
        }
        match (&entry.meaning, value) {
            (Meaning::Enumeration(name), Value::Integer(number)) if self.name_of(entry, *number).is_none() => {
                let values = self.device.enumerations.get(name).map(|it| it.values.as_slice()).unwrap_or_default();
                let names: Vec<_> = values.iter().map(|named| format!("{} ({})", named.name, named.value)).collect();
                Err(WriteRefusal::Unnamed { value: *number, names: names.join(", ") })
            }
            _ => Ok(()),
        }
    }

    /// A range as text: `-5.0 V to 30.0 V`, `10 and more`, `up to 10`.
    pub fn range(&self, entry: &Entry, limits: &Limits) -> String {
        let text = |value: &Value| self.describe(entry, value);
        match (&limits.low, &limits.high) {
            (Some(low), Some(high)) => format!("{} to {}", text(low), text(high)),
            (Some(low), None) => format!("{} and more", text(low)),
            (None, Some(high)) => format!("up to {}", text(high)),
            (None, None) => "any value".to_owned(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples;
    use lexican_eds::model::{Enumeration, Named};
    use lexican_eds::text::Span;

    #[test]
    fn the_data_sheet_refuses_by_access_limits_and_enumeration() {
        let mut device = samples::drive();
        let direction = |value| Named { name: format!("way {value}"), description: None, value };
        let values = vec![direction(1), direction(4)];
        let ways = Enumeration { description: None, values, is_hex: false, span: Span::default() };
        device.enumerations.insert("ways".to_owned(), ways);
        let mut named = device.entry(0x6060, 0).unwrap().clone();
        named.meaning = Meaning::Enumeration("ways".to_owned());
        (named.low, named.high) = (None, None);
        let values = DeviceValues::new(&device);
        let entry = |index, sub| device.entry(index, sub).unwrap();
        for (entry, number, refusal) in [
            (entry(0x6060, 0), 2, None),
            (entry(0x1018, 1), 2, Some("the data sheet says ro")),
            (
                entry(0x6060, 0),
                9,
                Some("9 is too high: the data sheet allows profile position (1) to profile velocity (2)"),
            ),
            (entry(0x6060, 0), 0, Some("0 is too low")),
            (&named, 4, None),
            (&named, 2, Some("2 is none of the values that the data sheet names: way 1 (1), way 4 (4)")),
        ] {
            let error = values.check_write(entry, &Value::Integer(number), NodeId::literal(5)).err();
            let words = error.map(|error| error.to_string());
            match (&words, refusal) {
                (None, None) => {}
                (Some(words), Some(refusal)) => assert!(words.starts_with(refusal), "{words}"),
                _ => panic!("{number}: {words:?}"),
            }
        }
    }
}
