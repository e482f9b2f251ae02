//! Values as they are typed: `5000`, `24.0 V`, `profile velocity`, `switch on + quick stop`.

use lexican_eds::model::{BitField, Entry, Meaning, Unit, Value};
use lexican_eds::types::{Class, DataType};
use lexican_runtime::object::Address;

use super::DeviceValues;
use super::wire::encode;

impl DeviceValues<'_> {
    /// The bytes of an entry from a text.
    ///
    /// # Errors
    ///
    /// Why the text is no value of the entry.
    pub fn encode(&self, address: Address, text: &str) -> Result<Vec<u8>, String> {
        let entry = self.entry(address).ok_or_else(|| format!("the data sheet has no {address}"))?;
        let value = self.parse(entry, text).map_err(|error| format!("{address}: {error}"))?;
        encode(entry.data_type, &value).ok_or_else(|| format!("{address}: the value is no {}", entry.data_type))
    }

    /// The value of an entry from a text.
    ///
    /// A number with a unit or a decimal point is in the unit of the entry. A number with neither is ambiguous, and is
    /// refused unless a count is worth one unit; `raw:240` is always the number in wire form.
    ///
    /// # Errors
    ///
    /// Why the text is no value of the entry.
    pub fn parse(&self, entry: &Entry, text: &str) -> Result<Value, String> {
        let text = text.trim();
        if let Some(raw) = text.strip_prefix("raw:") {
            return parse_as(entry.data_type, raw);
        }
        match &entry.meaning {
            Meaning::Quantity(_) => match self.unit(entry) {
                Some(unit) => within(entry.data_type, quantity(unit, text)?),
                None => parse_as(entry.data_type, text),
            },
            Meaning::Enumeration(_) if integer(text).is_some() => parse_as(entry.data_type, text),
            Meaning::Enumeration(name) => {
                let values = self.device.enumerations.get(name).map(|it| it.values.as_slice()).unwrap_or_default();
                let named = values.iter().find(|named| named.name.eq_ignore_ascii_case(text));
                named.map(|named| Value::Integer(named.value)).ok_or_else(|| {
                    let names: Vec<_> = values.iter().map(|named| named.name.as_str()).collect();
                    format!("{text:?} is none of: {}", names.join(", "))
                })
            }
            Meaning::BitField(_) if integer(text).is_some() => parse_as(entry.data_type, text),
            Meaning::BitField(name) => match self.device.bit_fields.get(name) {
                Some(field) => within(entry.data_type, bits(field, text)?),
                None => parse_as(entry.data_type, text),
            },
            Meaning::Plain => parse_as(entry.data_type, text),
        }
    }
}

/// The value of a type from a text.
///
/// # Errors
///
/// Why the text is no value of the type.
pub fn parse_as(data_type: DataType, text: &str) -> Result<Value, String> {
    let wrong = || format!("{text:?} is no {data_type}");
    match data_type.class() {
        Class::Boolean if text.eq_ignore_ascii_case("true") => Ok(Value::Integer(1)),
        Class::Boolean if text.eq_ignore_ascii_case("false") => Ok(Value::Integer(0)),
        Class::Boolean | Class::Signed | Class::Unsigned | Class::Time => {
            within(data_type, integer(text).ok_or_else(wrong)?)
        }
        Class::Real => text.parse().map(Value::Real).map_err(|_| wrong()),
        Class::Text => Ok(Value::Text(text.to_owned())),
        Class::Bytes | Class::Other => bytes(text).map(Value::Bytes).ok_or_else(|| {
            format!("{text:?} is no sequence of bytes: write them as pairs of hexadecimal digits, such as 01 A0 FF")
        }),
    }
}

/// The number, if the type can hold it.
fn within(data_type: DataType, number: i128) -> Result<Value, String> {
    match data_type.range() {
        Some((low, high)) if !(low..=high).contains(&number) => {
            Err(format!("{number} is no {data_type}: that is {low} to {high}"))
        }
        _ => Ok(Value::Integer(number)),
    }
}

/// Parses up to `most` hexadecimal digits, of which 16 bits have four, with `0x` before or `h` after them, or neither.
pub fn parse_hex(text: &str, most: usize) -> Option<u16> {
    let digits = text.strip_prefix("0x").or_else(|| text.strip_prefix("0X")).unwrap_or(text);
    let digits = digits.strip_suffix(['h', 'H']).unwrap_or(digits);
    let is_plain = (1..=most).contains(&digits.len()) && digits.bytes().all(|byte| byte.is_ascii_hexdigit());
    u16::from_str_radix(digits, 16).ok().filter(|_| is_plain)
}

/// Decimal, or hexadecimal after `0x`.
fn integer(text: &str) -> Option<i128> {
    let (minus, digits) = match text.strip_prefix('-') {
        Some(digits) => (true, digits),
        None => (false, text.strip_prefix('+').unwrap_or(text)),
    };
    let hex = digits.strip_prefix("0x").or_else(|| digits.strip_prefix("0X"));
    // The parsers below would accept a second sign.
    let number = match hex {
        Some(hex) if hex.bytes().all(|byte| byte.is_ascii_hexdigit()) => i128::from_str_radix(hex, 16).ok()?,
        None if digits.bytes().all(|byte| byte.is_ascii_digit()) => digits.parse().ok()?,
        _ => return None,
    };
    Some(if minus { -number } else { number })
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

/// `24.0 V` in counts; an error if it is not a whole number of them.
fn quantity(unit: &Unit, text: &str) -> Result<i128, String> {
    let end = text.find(|letter: char| !matches!(letter, '0'..='9' | '.' | '-' | '+')).unwrap_or(text.len());
    let (number, symbol) = (&text[..end], text[end..].trim());
    let no_number = || format!("{text:?} is no number of {symbol}: write 1.5 {symbol}", symbol = unit.symbol);
    if number.is_empty() || symbol.starts_with(',') {
        return Err(no_number());
    }
    if !symbol.is_empty() && !symbol.eq_ignore_ascii_case(&unit.symbol) {
        return Err(format!("{text:?} is not in {}", unit.symbol));
    }
    let scale_is_one = unit.num == unit.den;
    if symbol.is_empty() && !number.contains('.') && !scale_is_one {
        let symbol = &unit.symbol;
        return Err(format!("is {text} in {symbol}, or a count? Write \"{text} {symbol}\" or \"raw:{text}\""));
    }
    let (counts, rest) = counts(unit, number).ok_or_else(no_number)?;
    if rest != 0 {
        let step = f64::from(i32::try_from(unit.num).unwrap_or(i32::MAX)) / unit.den as f64;
        return Err(format!("{text} cannot be set: the step is {step} {}", unit.symbol));
    }
    Ok(counts)
}

/// A decimal number over `num / den`, and the remainder.
fn counts(unit: &Unit, number: &str) -> Option<(i128, i128)> {
    let (whole, fraction) = number.split_once('.').unwrap_or((number, ""));
    if fraction.len() > 9 || !fraction.bytes().all(|byte| byte.is_ascii_digit()) {
        return None;
    }
    let power = 10_i128.pow(fraction.len() as u32);
    // The sign stays before the digits, so that "-0.5" is negative.
    let digits: i128 = integer(&format!("{whole}{fraction}"))?;
    let (dividend, divisor) = (digits.checked_mul(unit.den.into())?, power.checked_mul(unit.num.into())?);
    Some((dividend.checked_div(divisor)?, dividend.checked_rem(divisor)?))
}

/// Names joined by `+`; after the name of a field of several bits comes its number.
fn bits(field: &BitField, text: &str) -> Result<i128, String> {
    let mut number = 0_i128;
    for part in text.split('+').map(str::trim) {
        let single = field.fields.iter().find(|named| named.name.eq_ignore_ascii_case(part));
        let (named, value) = match (single, part.rsplit_once(' ')) {
            (Some(named), _) => (named, 1),
            (None, Some((name, value))) => {
                let named = field.fields.iter().find(|named| named.name.eq_ignore_ascii_case(name.trim()));
                let value = integer(value).filter(|value| *value >= 0);
                named.zip(value).ok_or_else(|| unknown_bit(field, part))?
            }
            (None, None) => return Err(unknown_bit(field, part)),
        };
        let width = u32::from(named.value.high.saturating_sub(named.value.low)) + 1;
        if value >> width != 0 {
            return Err(format!("{} has only {width} bits", named.name));
        }
        number |= value << named.value.low;
    }
    Ok(number)
}

fn unknown_bit(field: &BitField, part: &str) -> String {
    let names: Vec<_> = field.fields.iter().map(|named| named.name.as_str()).collect();
    format!("{part:?} is none of: {}", names.join(", "))
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
    fn fractions_keep_their_sign() {
        let unit = Unit { symbol: "V".to_owned(), method: "volts".to_owned(), num: 1, den: 10, when: None };
        assert_eq!(quantity(&unit, "-0.5 V"), Ok(-5));
        assert_eq!(quantity(&unit, "24.0"), Ok(240));
        assert!(quantity(&unit, "24.05").is_err());
        assert!(quantity(&unit, "1-2 V").is_err());
        assert!(quantity(&unit, ". V").is_err());
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
        check(0x2412, 0, "5000 mm", "500000 is no UNSIGNED16: that is 0 to 65535");
        check(0x2410, 5, "300", "300 is no UNSIGNED8: that is 0 to 255");
    }
}
