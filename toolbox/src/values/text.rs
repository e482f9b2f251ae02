//! Parses values as users type them: `5000`, `24.0 V`, `profile velocity`, `switch on + quick stop`. The runtime parses
//! names and units (`lexican_runtime::object::Meaning`); this adds limits, texts and bytes of a data sheet, and the
//! formats of CiA 301 and 402.

use lexican_eds::model::{Entry, Value};
use lexican_eds::types::{Class, DataType};
use lexican_runtime::object::{self, Address, NoValue};

use super::wire::{encode, number_of};
use super::{DeviceValues, Limits};

impl DeviceValues<'_> {
    /// Parses a text to the bytes of an entry.
    pub fn encode(&self, address: Address, text: &str) -> Result<Vec<u8>, String> {
        let entry = self.entry(address).ok_or_else(|| format!("the data sheet has no {address}"))?;
        let value = self.parse(entry, text).map_err(|error| format!("{address}: {error}"))?;
        encode(entry.data_type, &value).ok_or_else(|| format!("{address}: the value is no {}", entry.data_type))
    }

    /// Parses a text to the value of an entry: what [`describe`](Self::describe) prints, and what
    /// [`Meaning::parse`](lexican_runtime::object::Meaning::parse) accepts.
    pub fn parse(&self, entry: &Entry, text: &str) -> Result<Value, String> {
        let text = text.trim();
        if let Some(number) = self.special_number(entry, text)? {
            return Ok(Value::Integer(number));
        }
        let (Some(data_type), Class::Boolean | Class::Signed | Class::Unsigned | Class::Real | Class::Time) =
            (entry.data_type.known(), entry.data_type.class())
        else {
            return parse_as(entry.data_type, text.strip_prefix("raw:").unwrap_or(text));
        };
        let parsed = self.with_meaning(entry, None, |meaning| {
            meaning.parse(data_type, text).map_err(|error| self.refusal(entry, text, &error))
        });
        match parsed {
            Ok(raw) => Ok(number_of(entry.data_type, raw)),
            Err(error) => noted(text).filter(|value| self.describe(entry, value) == text).ok_or(error),
        }
    }

    /// The error with the limits of the data sheet, if the value is outside those of its type.
    fn refusal(&self, entry: &Entry, text: &str, error: &NoValue<'_>) -> String {
        let NoValue::OutOfType { data_type, .. } = *error else { return error.to_string() };
        let mut limits = Limits::all(entry, |when| self.holds(when));
        match limits.find(|limits| limits.low.is_some() || limits.high.is_some()) {
            Some(limits) => format!("{text} is no {data_type}: the data sheet allows {}", self.range(entry, &limits)),
            None => error.to_string(),
        }
    }
}

/// The number in a text that has it twice: `405 (0195h)`, `disable voltage (0001h)`.
fn noted(text: &str) -> Option<Value> {
    let (number, note) = text.rsplit_once(" (")?;
    let hex = || i128::from_str_radix(note.strip_suffix("h)")?, 16).ok();
    Some(Value::Integer(object::integer(number).or_else(hex)?))
}

/// Parses a text to a value of a data type.
pub fn parse_as(data_type: DataType, text: &str) -> Result<Value, String> {
    match (data_type.class(), data_type.known()) {
        (Class::Text, _) => match text.strip_prefix('"').and_then(|text| text.strip_suffix('"')) {
            Some(shown) if shown.contains(['"', '\\']) => {
                Err(format!("{text} has quotes around it: write it without them"))
            }
            Some(shown) => Ok(Value::Text(shown.to_owned())),
            None => Ok(Value::Text(text.to_owned())),
        },
        (Class::Boolean | Class::Signed | Class::Unsigned | Class::Time | Class::Real, Some(known)) => {
            let raw = object::Meaning::Plain.parse(known, text).map_err(|error| error.to_string())?;
            Ok(number_of(data_type, raw))
        }
        _ => bytes(text).map(Value::Bytes).ok_or_else(|| {
            format!("{text:?} is no sequence of bytes: write them as pairs of hexadecimal digits, such as 01 A0 FF")
        }),
    }
}

/// Parses up to `most` hexadecimal digits of a 16-bit number, with the prefix `0x`, the suffix `h`, or neither.
pub fn parse_hex(text: &str, most: usize) -> Option<u16> {
    let digits = text.strip_prefix("0x").or_else(|| text.strip_prefix("0X")).unwrap_or(text);
    let digits = digits.strip_suffix(['h', 'H']).unwrap_or(digits);
    let is_plain = (1..=most).contains(&digits.len()) && digits.bytes().all(|byte| byte.is_ascii_hexdigit());
    u16::from_str_radix(digits, 16).ok().filter(|_| is_plain)
}

fn bytes(text: &str) -> Option<Vec<u8>> {
    let digits: Vec<u8> = text.bytes().filter(|byte| !byte.is_ascii_whitespace()).collect();
    let pairs = digits.chunks(2).map(|pair| match pair {
        [high, low] if high.is_ascii_hexdigit() && low.is_ascii_hexdigit() => {
            u8::from_str_radix(std::str::from_utf8(pair).ok()?, 16).ok()
        }
        _ => None,
    });
    pairs.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples;

    #[test]
    fn texts_are_values_of_the_entry() {
        let device = samples::drive();
        let values = DeviceValues::new(&device);
        let check = |index, sub, text: &str, number: Option<i128>| {
            let entry = device.entry(index, sub).unwrap();
            assert_eq!(values.parse(entry, text).ok(), number.map(Value::Integer), "{text}");
        };
        check(0x607A, 0, "5000", Some(5000));
        check(0x607A, 0, "-5000 increments", Some(-5000));
        check(0x607A, 0, "5 mm", None);
        check(0x607A, 0, "0.5", None);
        check(0x2412, 0, "2.00 mm", Some(200));
        check(0x2412, 0, "2 mm", Some(200));
        check(0x2412, 0, "2.005 mm", None);
        check(0x2412, 0, "200", None);
        check(0x2412, 0, "raw:200", Some(200));
        check(0x6060, 0, "profile velocity", Some(2));
        check(0x6060, 0, "Profile Velocity", Some(2));
        check(0x6060, 0, "2", Some(2));
        check(0x6060, 0, "0x2", Some(2));
        check(0x6060, 0, "homing", None);
        check(0x6060, 0, "256", None);
        check(0x6040, 0, "switch on + enable voltage + quick stop", Some(7));
        check(0x6040, 0, "0x10F", Some(0x10F));
        check(0x6040, 0, "switch on + jump", None);
        check(0x6040, 0, "", None);
    }

    #[test]
    fn texts_are_values_of_the_type() {
        let check = |data_type, text: &str, value: Option<Value>| assert_eq!(parse_as(data_type, text).ok(), value);
        check(DataType::Boolean, "true", Some(Value::Integer(1)));
        check(DataType::Integer8, "-128", Some(Value::Integer(-128)));
        check(DataType::Integer8, "128", None);
        check(DataType::Integer8, "--1", None);
        check(DataType::Integer8, "0x-1", None);
        check(DataType::Unsigned32, "0xFFFFFFFF", Some(Value::Integer(0xFFFF_FFFF)));
        check(DataType::Real32, "1.5", Some(Value::Real(1.5)));
        check(DataType::Domain, "01 a0FF", Some(Value::Bytes(vec![1, 0xA0, 0xFF])));
        check(DataType::Domain, "012", None);
        check(DataType::VisibleString, "any text", Some(Value::Text("any text".to_owned())));
    }

    #[test]
    fn errors_suggest_what_to_write() {
        let device = samples::drive();
        let values = DeviceValues::new(&device);
        let check = |index, sub, text: &str, words: &str| {
            let error = values.parse(device.entry(index, sub).unwrap(), text).unwrap_err();
            assert!(error.contains(words), "{text}: {error}");
        };
        check(0x2412, 0, "", "is no number of mm: write 1.5 mm");
        check(0x2412, 0, "much", "is no number of mm");
        check(0x2412, 0, "2,5 mm", "is no number of mm");
        check(0x2412, 0, "2.5 m", "is not in mm");
        check(0x2412, 0, "250", "\"250 mm\" or \"raw:250\"");
        check(0x2412, 0, "5000 mm", "5000 mm is no UNSIGNED16: the data sheet allows 0.00 mm to 10.00 mm");
        check(0x2410, 5, "300", "300 is no UNSIGNED8: the data sheet allows 1 rev/min to 200 rev/min");
    }
}
