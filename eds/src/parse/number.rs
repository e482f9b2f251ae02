//! Numbers as CiA 306-1 writes them, and in other spellings that people use.

use crate::finding::Oddity;
use crate::model::Value;
use crate::model::types::{Class, DataType};

/// A number, with what was irregular about it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Read<T> {
    pub(crate) value: T,
    pub(crate) oddity: Option<Oddity>,
}

/// Reads an integer; `None` if it is none.
pub(crate) fn integer(text: &str) -> Option<Read<i128>> {
    let text = text.trim();
    if let Some(value) = plain_integer(text) {
        return Some(value);
    }
    if let (before, oddity @ Some(_)) = without_comment(text) {
        let value = integer(before)?.value;
        return Some(Read { value, oddity });
    }
    odd_integer(text).map(|value| Read { value, oddity: Some(Oddity::Spelling) })
}

/// Reads `$NODEID` plus numbers in any order; `None` without a variable.
pub(crate) fn formula(text: &str) -> Option<Read<i64>> {
    text.contains('$').then_some(())?;
    let (text, mut oddity) = without_comment(text);
    let mut offset: i64 = 0;
    let mut variables = 0;
    for term in text.split('+').map(str::trim) {
        if let Some(name) = term.strip_prefix('$') {
            let known = name.eq_ignore_ascii_case("NODEID");
            if !known {
                let word = !name.is_empty() && name.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_');
                word.then_some(())?;
                oddity = Some(Oddity::Variable);
            }
            variables += 1;
        } else {
            let read = plain_integer(term)?;
            oddity = oddity.or(read.oddity);
            offset = offset.checked_add(i64::try_from(read.value).ok()?)?;
        }
    }
    (variables == 1).then_some(Read { value: offset, oddity })
}

/// Reads a value of a data type; `Ok(None)` if the text is empty, `Err` if it is not a value of the type.
pub(crate) fn value(text: &str, data_type: DataType) -> Result<Option<Read<Value>>, ()> {
    let text = text.trim();
    if text.is_empty() {
        return Ok(None);
    }
    let read = match data_type.class() {
        Class::Text => Read { value: Value::Text(text.to_owned()), oddity: None },
        Class::Bytes => bytes(text, data_type),
        _ if text.eq_ignore_ascii_case("null") => return Ok(None),
        Class::Real => real(text, data_type).ok_or(())?,
        Class::Other => return Ok(Some(any(text))),
        class @ (Class::Boolean | Class::Signed | Class::Unsigned | Class::Time) => {
            if let Some(formula) = formula(text) {
                Read { value: Value::NodeIdPlus(formula.value), oddity: formula.oddity }
            } else if let (Class::Time, Some(time)) = (class, days_and_ms(text)) {
                Read { value: Value::Integer(time), oddity: None }
            } else {
                let read = integer(text).ok_or(())?;
                Read { value: Value::Integer(signed(text, read.value, data_type)), oddity: read.oddity }
            }
        }
    };
    Ok(Some(read))
}

/// `days ms`: the 48 bits of a TIME_OF_DAY or TIME_DIFFERENCE (CiA 301, 7.1.6.6).
fn days_and_ms(text: &str) -> Option<i128> {
    let (days, ms) = text.split_once(char::is_whitespace)?;
    let (days, ms) = (plain_integer(days)?.value, plain_integer(ms.trim())?.value);
    let valid = (0..=0xFFFF).contains(&days) && (0..1 << 28).contains(&ms);
    valid.then_some(days << 32 | ms)
}

/// The text before a comment on the same line.
fn without_comment(text: &str) -> (&str, Option<Oddity>) {
    match text.split_once([';', '#']) {
        Some((before, _)) => (before.trim_end(), Some(Oddity::Comment)),
        None => (text, None),
    }
}

/// Decimal, `0x` and octal with a leading zero, with a sign.
fn plain_integer(text: &str) -> Option<Read<i128>> {
    let (negative, digits) = match text.as_bytes() {
        [b'-', ..] => (true, &text[1..]),
        [b'+', ..] => (false, &text[1..]),
        _ => (false, text),
    };
    let (digits, radix, oddity) = match digits.as_bytes() {
        [b'0', b'x' | b'X', ..] => (&digits[2..], 16, None),
        [b'0', rest @ ..] if rest.iter().any(|&b| b > b'7') => (digits, 10, Some(Oddity::NotOctal)),
        [b'0', rest @ ..] => {
            let small = rest.iter().rev().skip(1).all(|&b| b == b'0');
            (digits, 8, (!small).then_some(Oddity::Octal))
        }
        _ => (digits, 10, None),
    };
    // `from_str_radix` would accept a second sign.
    if digits.is_empty() || !digits.bytes().all(|b| b.is_ascii_hexdigit()) {
        return None;
    }
    // Faster than `i128` for the usual short numbers.
    let value = match digits.len() {
        ..16 => u64::from_str_radix(digits, radix).ok()?.into(),
        _ => i128::from_str_radix(digits, radix).ok()?,
    };
    Some(Read { value: if negative { -value } else { value }, oddity })
}

/// Reads spellings that CiA 306 does not define but that can mean only one number.
fn odd_integer(text: &str) -> Option<i128> {
    if text.eq_ignore_ascii_case("true") {
        return Some(1);
    }
    if text.eq_ignore_ascii_case("false") {
        return Some(0);
    }
    if let Some(hex) = text.strip_suffix(['h', 'H']).filter(|hex| !hex.is_empty()) {
        let digits = hex.strip_prefix("0x").unwrap_or(hex);
        return digits.bytes().all(|b| b.is_ascii_hexdigit()).then(|| i128::from_str_radix(digits, 16).ok())?;
    }
    // The suffix `f` of C needs a point before it: `1F` could also be hexadecimal with its `0x` missing.
    let decimal = text.strip_suffix(['f', 'F']).filter(|decimal| decimal.contains('.')).unwrap_or(text);
    let number: f64 = decimal.parse().ok()?;
    let whole = number.is_finite() && number.fract() == 0.0 && number.abs() < 1e15;
    (whole && text.bytes().any(|b| b.is_ascii_digit())).then_some(number as i128)
}

/// A hexadecimal number is negative if the sign bit of its type is set.
fn signed(text: &str, value: i128, data_type: DataType) -> i128 {
    let (Class::Signed, Some(bits)) = (data_type.class(), data_type.bits()) else { return value };
    let hex = text.starts_with("0x") || text.starts_with("0X");
    let sign = 1_i128 << (bits - 1);
    if hex && (sign..sign << 1).contains(&value) { value - (sign << 1) } else { value }
}

/// Reads a REAL: decimal, or in hexadecimal as the bits of IEEE 754.
fn real(text: &str, data_type: DataType) -> Option<Read<Value>> {
    let (number, mut oddity) = without_comment(text);
    if let Some(hex) = number.strip_prefix("0x").or_else(|| number.strip_prefix("0X")) {
        let bits = u64::from_str_radix(hex, 16).ok()?;
        let (value, is_subnormal) = match data_type {
            DataType::Real32 => {
                let value = f32::from_bits(u32::try_from(bits).ok()?);
                (value.into(), value.is_subnormal())
            }
            _ => (f64::from_bits(bits), f64::from_bits(bits).is_subnormal()),
        };
        // Nobody means a subnormal number: 0xFFFF is 65535.
        if is_subnormal {
            return Some(Read { value: Value::Real(bits as f64), oddity: oddity.or(Some(Oddity::Spelling)) });
        }
        return value.is_finite().then_some(Read { value: Value::Real(value), oddity: oddity.or(Some(Oddity::Bits)) });
    }
    let value: f64 = number.parse().ok().or_else(|| {
        oddity = Some(Oddity::Spelling);
        number.trim_end_matches(['f', 'F']).replace(',', ".").parse().ok()
    })?;
    value.is_finite().then_some(Read { value: Value::Real(value), oddity })
}

/// Reads pairs of hexadecimal digits, with or without blanks between them; any other text is kept as it is.
fn bytes(text: &str, data_type: DataType) -> Read<Value> {
    let digits: String = text.trim_start_matches("0x").split_whitespace().collect();
    let padded = if digits.len() % 2 == 1 { format!("0{digits}") } else { digits };
    let pairs = padded.as_bytes().chunks(2).map(|pair| u8::from_str_radix(str::from_utf8(pair).ok()?, 16).ok());
    match pairs.collect::<Option<Vec<u8>>>() {
        Some(bytes) if !bytes.is_empty() && !padded.contains('+') => Read { value: Value::Bytes(bytes), oddity: None },
        _ => {
            let oddity = (data_type == DataType::OctetString).then_some(Oddity::NotHex);
            Read { value: Value::Text(text.to_owned()), oddity }
        }
    }
}

/// Reads a value whose data type is unknown.
fn any(text: &str) -> Read<Value> {
    if let Some(Read { value, oddity }) = formula(text) {
        Read { value: Value::NodeIdPlus(value), oddity }
    } else if let Some(Read { value, oddity }) = plain_integer(text) {
        Read { value: Value::Integer(value), oddity }
    } else {
        Read { value: Value::Text(text.to_owned()), oddity: None }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integers_are_read_in_every_notation() {
        let check = |text: &str, value: i128, oddity: Option<Oddity>| {
            assert_eq!(integer(text), Some(Read { value, oddity }), "{text:?}");
        };
        check("0", 0, None);
        check(" 42 ", 42, None);
        check("-7", -7, None);
        check("+384", 384, None);
        check("0x1F", 31, None);
        check("0XfF", 255, None);
        check("001", 1, None);
        check("0000", 0, None);
        check("010", 8, Some(Oddity::Octal));
        check("014101", 0o14101, Some(Oddity::Octal));
        check("0189", 189, Some(Oddity::NotOctal));
        check("0x10 ; prevent homing", 16, Some(Oddity::Comment));
        check("0;", 0, Some(Oddity::Comment));
        check("true", 1, Some(Oddity::Spelling));
        check("FALSE", 0, Some(Oddity::Spelling));
        check("1F80h", 0x1F80, Some(Oddity::Spelling));
        check("1.0", 1, Some(Oddity::Spelling));
        check("0.0f", 0, Some(Oddity::Spelling));
    }

    #[test]
    fn what_is_no_integer_is_refused() {
        for text in
            ["", "x", "0x", "1.5", "--1", "0x-1", "12 V", "h", "f", "nan", "inf", "0xG", ";", "9".repeat(60).as_str()]
                // Hexadecimal without 0x, not to be taken for the suffix of `1.0f`.
                .into_iter()
                .chain(["1F", "0F", "1f", "FF", "0x0x1Fh", "1.0ff"])
        {
            assert_eq!(integer(text), None, "{text:?}");
        }
    }

    #[test]
    fn formulas_stay_symbolic_in_every_spelling() {
        let check = |text: &str, offset: i64, oddity: Option<Oddity>| {
            assert_eq!(formula(text), Some(Read { value: offset, oddity }), "{text:?}");
        };
        check("$NODEID", 0, None);
        check("$NODEID+0x180", 0x180, None);
        check("0x180+$NODEID", 0x180, None);
        check("$NodeID + 0x600", 0x600, None);
        check("$nodeid+1536", 1536, None);
        check("$NODEID+0x80000180", 0x8000_0180, None);
        check("0xC0000000+$NODEID", 0xC000_0000, None);
        check("0x100+$NODEID+0x80", 0x180, None);
        check("$MY_NODE_ID+0x200", 0x200, Some(Oddity::Variable));
        check("$NODEID+0x80 ; emergency", 0x80, Some(Oddity::Comment));
        check("$NODEID+0x80 # emergency", 0x80, Some(Oddity::Comment));
        check("$NODEID+010", 8, Some(Oddity::Octal));
        for text in ["", "0x180", "$NODEID+$NODEID", "$NODEID+", "$+1", "$NODEID 0x180", "$NODEID-1"] {
            assert_eq!(formula(text), None, "{text:?}");
        }
    }

    #[test]
    fn values_are_those_of_their_type() {
        let check = |text: &str, data_type, expected: Option<Value>| {
            let read = value(text, data_type).map(|read| read.map(|read| read.value));
            assert_eq!(read, Ok(expected), "{text:?}");
        };
        use DataType as D;
        check("", D::Unsigned8, None);
        check("NULL", D::Unsigned8, None);
        check("0x80000000", D::Integer32, Some(Value::Integer(-0x8000_0000)));
        check("0xFFFFFF", D::Integer24, Some(Value::Integer(-1)));
        check("0xFF", D::Unsigned8, Some(Value::Integer(255)));
        check("4294967295", D::Integer32, Some(Value::Integer(0xFFFF_FFFF)));
        check("$NODEID+0x180", D::Unsigned32, Some(Value::NodeIdPlus(0x180)));
        check("1.5", D::Real32, Some(Value::Real(1.5)));
        check("0x3F800000", D::Real32, Some(Value::Real(1.0)));
        check("0.0f", D::Real32, Some(Value::Real(0.0)));
        check("0xFFFF", D::Real32, Some(Value::Real(65535.0)));
        check("0x00800000", D::Real32, Some(Value::Real(f32::MIN_POSITIVE.into())));
        check("0x0A", D::Real64, Some(Value::Real(10.0)));
        check("-3.4E+38", D::Real64, Some(Value::Real(-3.4e38)));
        check("v1 ; x", D::VisibleString, Some(Value::Text("v1 ; x".into())));
        check("2 3600000", D::TimeOfDay, Some(Value::Integer(2 << 32 | 3_600_000)));
        check("0 0", D::TimeDifference, Some(Value::Integer(0)));
        check("C4 0D BB", D::OctetString, Some(Value::Bytes(vec![0xC4, 0x0D, 0xBB])));
        check("C40DBB", D::OctetString, Some(Value::Bytes(vec![0xC4, 0x0D, 0xBB])));
        check("file.bin", D::Domain, Some(Value::Text("file.bin".into())));
        check("17", D::Other(0x42), Some(Value::Integer(17)));
        check("x17", D::Other(0x42), Some(Value::Text("x17".into())));
        check("1.5 # rad", D::Real32, Some(Value::Real(1.5)));
        assert_eq!(
            value("010", D::Other(0x42)),
            Ok(Some(Read { value: Value::Integer(8), oddity: Some(Oddity::Octal) }))
        );
        for text in ["12 V", "x", "nan", "1 -2", "70000 1", "1 2 3"] {
            assert_eq!(value(text, D::Unsigned8), Err(()), "{text:?}");
            assert_eq!(value(text, D::Real32), Err(()), "{text:?}");
            assert_eq!(value(text, D::TimeOfDay), Err(()), "{text:?}");
        }
    }
}
