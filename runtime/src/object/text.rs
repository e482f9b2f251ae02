//! Numbers as text, by name and unit, and back: what is shown can be typed, and means the same. Generated code and the tools, which
//! read data sheets as they run, both come here.

use core::fmt;

use super::meaning::{counts, nearest_raw, whole, wire_form};
use super::{BitField, BitName, DataType, Meaning, Name, Quantity, Unit, ValueName};

/// Why a text is no value of an entry.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the names say what it is")]
pub enum NoValue<'a> {
    #[error("{text:?} is no {data_type}")]
    NoNumber { text: &'a str, data_type: DataType },
    /// The data type does not reach that far.
    #[error("{number} is no {data_type}: that is {} to {}", range(*data_type).0, range(*data_type).1)]
    OutOfType {
        /// In counts.
        number: i128,
        data_type: DataType,
    },
    /// It does not begin with a number.
    #[error("{text:?} is no number of {symbol}: write 1.5 {symbol}")]
    NoQuantity { text: &'a str, symbol: &'a str },
    /// The number has a unit that is not the entry's, or several units have its symbol.
    #[error("{text:?} is not in {symbol}")]
    OtherUnit { text: &'a str, symbol: &'a str },
    /// A number without unit and decimal point, where a count is not worth one of the unit.
    #[error("is {text} in {symbol}, or a count? Write \"{text} {symbol}\" or \"raw:{text}\"")]
    NoUnit { text: &'a str, symbol: &'a str },
    /// The number lies between two counts.
    #[error("{text} cannot be set: the step is {} {}", unit.scale(1.0), unit.symbol)]
    BetweenCounts { text: &'a str, unit: Unit<'a> },
    /// No value, or bit, has that name; or more than one.
    #[error("{text:?} is none of: {names}")]
    NoName { text: &'a str, names: Names<'a> },
    /// The number does not fit into the bits of a field.
    #[error("{name} has only {width} bits")]
    TooWide { name: &'a str, width: u8 },
}

/// The names of values, or of bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names say what it is")]
pub enum Names<'a> {
    Values(&'a [ValueName<'a>]),
    Bits(&'a [BitName<'a>]),
}

impl fmt::Display for Names<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let separator = |at| if at == 0 { "" } else { ", " };
        match self {
            Names::Values(values) => {
                (0..).zip(*values).try_for_each(|(at, it)| write!(f, "{}{}", separator(at), it.name))
            }
            Names::Bits(bits) => (0..).zip(*bits).try_for_each(|(at, it)| write!(f, "{}{}", separator(at), it.name)),
        }
    }
}

impl Name {
    /// A number in wire form by name and unit: see [`Meaning::show`].
    #[must_use]
    pub fn show(&self, raw: u64) -> impl fmt::Display + use<'_> {
        self.meaning.show(self.data_type, raw)
    }

    /// The wire form of a value that is written as text: see [`Meaning::parse`].
    ///
    /// ```
    /// use lexican_runtime::object::{DataType, Meaning, Name, Unit};
    ///
    /// const VOLTAGE: Name =
    ///     Name::new(0x6079, 0, "DC link voltage", DataType::Unsigned32, Meaning::Quantity(&[Unit::new("V", 1, 1000)]));
    /// assert_eq!((VOLTAGE.parse("24.5 V"), VOLTAGE.parse("raw:0x10")), (Ok(24_500), Ok(16)));
    /// assert_eq!(VOLTAGE.parse("24").unwrap_err().to_string(), "is 24 in V, or a count? Write \"24 V\" or \"raw:24\"");
    /// assert_eq!(format!("{}", VOLTAGE.show(24_500)), "24.500 V");
    /// ```
    pub fn parse<'a>(&self, text: &'a str) -> Result<u64, NoValue<'a>> {
        self.meaning.parse(self.data_type, text)
    }
}

impl<'a> Meaning<'a> {
    /// A number in wire form by name and unit: `24.5 V`, `+5.00 mm` if it may be negative, `profile velocity (3)`,
    /// `switch on + mode 2 + bit 15`. A quantity on whose unit other objects decide is a bare number.
    #[must_use]
    pub const fn show(self, data_type: DataType, raw: u64) -> impl fmt::Display + use<'a> {
        Shown { data_type, meaning: self, raw }
    }

    /// The wire form of a value that is written as text: what [`show`](Self::show) writes; a name alone; a number, hexadecimal after
    /// `0x`. A number with a unit or a decimal point is in the unit. One with neither is ambiguous, and is refused unless a count
    /// is worth one unit; `raw:240` is always the number in wire form.
    pub fn parse(self, data_type: DataType, text: &'a str) -> Result<u64, NoValue<'a>> {
        let text = text.trim();
        if let Some(raw) = text.strip_prefix("raw:") {
            return plain(data_type, raw);
        }
        match self {
            Meaning::Quantity([unit]) => quantity(data_type, unit, text),
            Meaning::Quantity(units) => match split(data_type, text).1.trim() {
                given if !given.is_empty() && integer(text).is_none() => {
                    // Other objects decide on the unit: a symbol that several units have is ambiguous.
                    let mut called = units.iter().filter(|unit| is_symbol(unit, given));
                    let first = called.next();
                    let only = first.filter(|unit| called.all(|it| (it.num, it.den) == (unit.num, unit.den)));
                    let symbol = units.first().map_or("counts", |unit| unit.symbol);
                    quantity(data_type, only.ok_or(NoValue::OtherUnit { text, symbol })?, text)
                }
                _ => plain(data_type, text),
            },
            Meaning::Enumeration(_) | Meaning::BitField(_) if integer(text).is_some() => plain(data_type, text),
            Meaning::Enumeration(values) => named(data_type, values, text),
            Meaning::BitField(bits) => within(data_type, parse_bits(bits, text)?),
            Meaning::Plain => plain(data_type, text),
        }
    }
}

/// A number in wire form, and what it means.
struct Shown<'a> {
    data_type: DataType,
    meaning: Meaning<'a>,
    raw: u64,
}

impl fmt::Display for Shown<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let &Shown { data_type, meaning, raw } = self;
        let number = whole(data_type, raw);
        match meaning {
            Meaning::Quantity([unit]) => {
                let plus = if data_type.is_signed() && number > 0 { "+" } else { "" };
                f.write_str(plus)?;
                show_quantity(f, unit, data_type, raw)
            }
            Meaning::BitField(bits) => show_bits(f, bits, raw),
            Meaning::Enumeration(values) if let Some(named) = values.iter().find(|named| named.raw == raw) => {
                write!(f, "{} ({number})", named.name)
            }
            _ => match data_type {
                DataType::Real32 | DataType::Real64 => show_real(f, data_type, counts(data_type, raw)),
                DataType::Boolean => fmt::Display::fmt(&(number != 0), f),
                _ => fmt::Display::fmt(&number, f),
            },
        }
    }
}

/// The fewest digits that parse to the same number; very large and very small numbers with an exponent.
fn show_real(f: &mut fmt::Formatter<'_>, data_type: DataType, number: f64) -> fmt::Result {
    let is_long = number.is_finite() && number != 0.0 && !(1e-5..1e16).contains(&number.abs());
    match (data_type == DataType::Real32, is_long) {
        (true, true) => write!(f, "{:e}", number as f32),
        (true, false) => write!(f, "{}", number as f32),
        (false, true) => write!(f, "{number:e}"),
        (false, false) => write!(f, "{number}"),
    }
}

/// Prints the bits that are set: `StatusWord(0x0221 ready to switch on + operation mode 2)`.
pub fn debug_bits<T: BitField>(f: &mut fmt::Formatter<'_>, type_name: &str, value: T) -> fmt::Result {
    let raw = value.to_raw();
    write!(f, "{type_name}({raw:#0width$X}", width = 2 + 2 * T::DATA_TYPE.size().unwrap_or(8))?;
    if raw != 0 {
        f.write_str(" ")?;
        show_bits(f, T::BITS, raw)?;
    }
    f.write_str(")")
}

/// Names joined by `+`, after that of several bits their number; `bit 15` where there is no name, or another field has it, too.
fn show_bits(f: &mut fmt::Formatter<'_>, bits: &[BitName<'_>], raw: u64) -> fmt::Result {
    if raw == 0 {
        return f.write_str("0");
    }
    let (mut rest, mut separator) = (raw, "");
    for (at, bits_of) in bits.iter().enumerate() {
        let value = super::take(rest, bits_of.low, bits_of.width);
        let is_first = || !bits[..at].iter().any(|it| it.name.eq_ignore_ascii_case(bits_of.name));
        if value == 0 || !is_first() {
            continue;
        }
        match bits_of.width {
            1 => write!(f, "{separator}{}", bits_of.name)?,
            _ => write!(f, "{separator}{} {value}", bits_of.name)?,
        }
        rest &= !(value << bits_of.low);
        separator = " + ";
    }
    for bit in (0..64).filter(|bit| rest >> bit & 1 == 1) {
        write!(f, "{separator}bit {bit}")?;
        separator = " + ";
    }
    Ok(())
}

/// Prints a quantity in its only unit: `24.5 V`; in counts where other objects decide on the unit. With a width or a precision,
/// these are those of the number.
pub fn display_quantity<T: Quantity>(f: &mut fmt::Formatter<'_>, value: T) -> fmt::Result {
    let (data_type, raw) = (T::DATA_TYPE, value.to_raw());
    match T::UNITS {
        [unit] if f.width().is_none() && f.precision().is_none() && !f.sign_plus() => {
            show_quantity(f, unit, data_type, raw)
        }
        [unit] => {
            fmt::Display::fmt(&unit.scale(counts(data_type, raw)), f)?;
            write!(f, " {}", unit.symbol)
        }
        _ => fmt::Display::fmt(&counts(data_type, raw), f),
    }
}

fn show_quantity(f: &mut fmt::Formatter<'_>, unit: &Unit<'_>, data_type: DataType, raw: u64) -> fmt::Result {
    let decimals = decimals(unit);
    match (data_type, scaled(unit, whole(data_type, raw), decimals)) {
        (DataType::Real32, _) if unit.num == unit.den => show_real(f, data_type, counts(data_type, raw))?,
        // All digits of a REAL32 in its unit: fewer may be another one's.
        (DataType::Real32 | DataType::Real64, _) | (_, None) => {
            show_real(f, DataType::Real64, unit.scale(counts(data_type, raw)))?;
        }
        (_, Some(number)) => {
            let (minus, number) = (if number < 0 { "-" } else { "" }, number.unsigned_abs());
            let one = 10_u128.pow(decimals);
            write!(f, "{minus}{}", number / one)?;
            if decimals > 0 {
                write!(f, ".{:0width$}", number % one, width = decimals as usize)?;
            }
        }
    }
    write!(f, " {}", unit.symbol)
}

/// How many decimals tell the counts of a unit apart: as many as make them exact, else at least four.
fn decimals(unit: &Unit<'_>) -> u32 {
    let (num, den) = (i128::from(unit.num), i128::from(unit.den));
    let is_exact = |decimals: &u32| (num * 10_i128.pow(*decimals)).checked_rem(den) == Some(0);
    let are_apart = |decimals: &u32| num.abs() * 10_i128.pow(*decimals) >= den.abs();
    (0..=9).find(is_exact).or_else(|| (4..18).find(are_apart)).unwrap_or(18)
}

/// A number of counts in the last decimal of the unit; `None` if that is too large.
fn scaled(unit: &Unit<'_>, counts: i128, decimals: u32) -> Option<i128> {
    let number = counts.checked_mul(unit.num.into())?.checked_mul(10_i128.pow(decimals))?;
    rounded(number, unit.den.into())
}

/// The whole number nearest to a fraction, half away from zero.
fn rounded(dividend: i128, divisor: i128) -> Option<i128> {
    let (whole, rest) = (dividend.checked_div(divisor)?, dividend.checked_rem(divisor)?);
    let is_up = rest.unsigned_abs() >= divisor.unsigned_abs().div_ceil(2);
    let away = if (dividend < 0) == (divisor < 0) { 1 } else { -1 };
    Some(if rest != 0 && is_up { whole + away } else { whole })
}

/// Decimal, or hexadecimal after `0x`, with or without a sign; `None` of anything else.
#[must_use]
pub fn integer(text: &str) -> Option<i128> {
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

/// A number of a type, and nothing else.
fn plain(data_type: DataType, text: &str) -> Result<u64, NoValue<'_>> {
    let wrong = NoValue::NoNumber { text, data_type };
    match data_type {
        DataType::Real32 | DataType::Real64 => {
            let number: f64 = text.parse().map_err(|_| wrong)?;
            // What is no number is shown, and taken, too.
            if number.is_finite() { nearest_raw(data_type, number).ok_or(wrong) } else { Ok(real(data_type, number)) }
        }
        DataType::Boolean if text.eq_ignore_ascii_case("true") => Ok(1),
        DataType::Boolean if text.eq_ignore_ascii_case("false") => Ok(0),
        _ if data_type.bits().is_none() => Err(wrong),
        _ => within(data_type, integer(text).ok_or(wrong)?),
    }
}

const fn real(data_type: DataType, number: f64) -> u64 {
    match data_type {
        DataType::Real32 => (number as f32).to_bits() as u64,
        _ => number.to_bits(),
    }
}

/// The wire form of a number, if the type can hold it.
fn within<'a>(data_type: DataType, number: i128) -> Result<u64, NoValue<'a>> {
    let raw = wire_form(data_type, number);
    if whole(data_type, raw) == number { Ok(raw) } else { Err(NoValue::OutOfType { number, data_type }) }
}

/// The lowest and the highest number of a type.
fn range(data_type: DataType) -> (i128, i128) {
    let all = wire_form(data_type, -1);
    match data_type.is_signed() {
        true => (-1 - i128::from(all >> 1), i128::from(all >> 1)),
        false => (0, i128::from(all)),
    }
}

/// A name, or a name and its number: `profile velocity (3)`.
fn named<'a>(data_type: DataType, values: &'a [ValueName<'a>], text: &'a str) -> Result<u64, NoValue<'a>> {
    let called = |name: &'a str| values.iter().filter(move |it| it.name.eq_ignore_ascii_case(name));
    let number = text.strip_suffix(')').and_then(|text| text.rsplit_once(" (")).and_then(|(name, number)| {
        let raw = wire_form(data_type, integer(number)?);
        called(name).find(|it| it.raw == raw)
    });
    let mut all = called(text);
    match (all.next(), all.next(), number) {
        (Some(only), None, _) | (_, _, Some(only)) => Ok(only.raw),
        _ => Err(NoValue::NoName { text, names: Names::Values(values) }),
    }
}

/// Names joined by `+`; after the name of a field of several bits comes its number. A name may hold a `+` itself.
fn parse_bits<'a>(bits: &'a [BitName<'a>], text: &'a str) -> Result<i128, NoValue<'a>> {
    let (mut number, mut rest) = (0_i128, text);
    loop {
        let longest = bits.iter().filter_map(|it| Some((it, field(it, rest)?))).min_by_key(|(_, (_, rest))| rest.len());
        let end = rest.find('+').unwrap_or(rest.len());
        let unnamed = || {
            let bit = rest.get(..end)?.trim().strip_prefix("bit ")?.trim().parse().ok().filter(|bit: &u8| *bit < 64)?;
            Some((1_i128 << bit, rest.get(end..)?))
        };
        let (value, after) = match longest {
            Some((it, (value, _))) if it.width < 64 && value >> it.width != 0 => {
                return Err(NoValue::TooWide { name: it.name, width: it.width });
            }
            Some((it, (value, after))) => (i128::from(value) << it.low.min(63), after),
            None => {
                let part = rest.get(..end).unwrap_or(rest).trim();
                unnamed().ok_or(NoValue::NoName { text: part, names: Names::Bits(bits) })?
            }
        };
        number |= value;
        match after.strip_prefix('+') {
            Some(next) => rest = next.trim_start(),
            None => return Ok(number),
        }
    }
}

/// The value of a field with which a text begins, and what comes after it: nothing, or a `+`.
fn field<'a>(bits: &BitName<'_>, text: &'a str) -> Option<(u64, &'a str)> {
    let (name, rest) = text.split_at_checked(bits.name.len())?;
    if !name.eq_ignore_ascii_case(bits.name) {
        return None;
    }
    let ends = |rest: &str| rest.is_empty() || rest.starts_with('+');
    let after = rest.trim_start();
    if ends(after) {
        return Some((1, after));
    }
    let digits = after.find(|letter: char| !letter.is_ascii_alphanumeric()).unwrap_or(after.len());
    let (digits, after) = after.split_at_checked(digits).filter(|_| rest.starts_with(' '))?;
    let value = integer(digits).and_then(|value| u64::try_from(value).ok())?;
    ends(after.trim_start()).then_some((value, after.trim_start()))
}

fn is_symbol(unit: &Unit<'_>, text: &str) -> bool {
    text.trim().eq_ignore_ascii_case(unit.symbol)
}

const fn is_real(data_type: DataType) -> bool {
    matches!(data_type, DataType::Real32 | DataType::Real64)
}

/// A number and what comes after it.
fn split(data_type: DataType, text: &str) -> (&str, &str) {
    let of_number = |it: char| matches!(it, '0'..='9' | '.' | '-' | '+') || is_real(data_type) && it == 'e';
    text.split_at_checked(text.find(|it| !of_number(it)).unwrap_or(text.len())).unwrap_or((text, ""))
}

/// `24.0 V` in counts.
fn quantity<'a>(data_type: DataType, unit: &Unit<'a>, text: &'a str) -> Result<u64, NoValue<'a>> {
    let symbol = unit.symbol;
    let (number, given) = split(data_type, text);
    let no_number = NoValue::NoQuantity { text, symbol };
    if number.is_empty() || given.starts_with(',') {
        return Err(no_number);
    }
    if !given.trim().is_empty() && !is_symbol(unit, given) {
        return Err(NoValue::OtherUnit { text, symbol });
    }
    if given.trim().is_empty() && !number.contains('.') && unit.num != unit.den {
        return Err(NoValue::NoUnit { text, symbol });
    }
    if is_real(data_type) {
        let number: f64 = number.parse().map_err(|_| no_number)?;
        return nearest_raw(data_type, number * unit.den as f64 / unit.num as f64).ok_or(no_number);
    }
    match of_decimal(unit, number).ok_or(no_number)? {
        Some(counts) => within(data_type, counts),
        None => Err(NoValue::BetweenCounts { text, unit: *unit }),
    }
}

/// The count whose value is the decimal number, or is printed as it. `Some(None)` if the number lies between two counts.
fn of_decimal(unit: &Unit<'_>, number: &str) -> Option<Option<i128>> {
    let (whole, fraction) = number.split_once('.').unwrap_or((number, ""));
    if fraction.len() > 18 || !fraction.bytes().all(|byte| byte.is_ascii_digit()) {
        return None;
    }
    let (sign, whole) = whole.strip_prefix(['-', '+']).map_or(("", whole), |rest| (whole.split_at(1).0, rest));
    let power = 10_i128.pow(fraction.len() as u32);
    let (integral, parts) = (integer_digits(whole)?, if fraction.is_empty() { 0 } else { integer_digits(fraction)? });
    if whole.is_empty() && fraction.is_empty() {
        return None;
    }
    let digits = integral.checked_mul(power)?.checked_add(parts)?;
    // The sign is kept apart from the digits, so that "-0.5" is negative.
    let digits = if sign == "-" { -digits } else { digits };
    let (dividend, divisor) = (digits.checked_mul(unit.den.into())?, power.checked_mul(unit.num.into())?);
    let counts = rounded(dividend, divisor)?;
    let decimals = decimals(unit);
    let is_shown =
        || Some(scaled(unit, counts, decimals)?.checked_mul(power)? == digits.checked_mul(10_i128.pow(decimals))?);
    Some((dividend.checked_rem(divisor)? == 0 || is_shown() == Some(true)).then_some(counts))
}

fn integer_digits(digits: &str) -> Option<i128> {
    let is_plain = digits.bytes().all(|byte| byte.is_ascii_digit());
    if digits.is_empty() { Some(0) } else { digits.parse().ok().filter(|_| is_plain) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::format;
    use std::string::ToString as _;

    #[test]
    fn counts_are_exact_in_their_unit_or_told_apart() {
        for (number, num, den, data_type, text) in [
            (5000, 1, 1, DataType::Integer32, "+5000 x"),
            (-5000, 1, 1, DataType::Integer32, "-5000 x"),
            (0, 1, 1, DataType::Integer32, "0 x"),
            (240, 1, 10, DataType::Unsigned16, "24.0 x"),
            (-5, 1, 100, DataType::Integer32, "-0.05 x"),
            (7, 5, 1, DataType::Unsigned16, "35 x"),
            (1, 1, 3, DataType::Unsigned16, "0.3333 x"),
            (2, 1, 3, DataType::Unsigned16, "0.6667 x"),
            (3, 1, 4, DataType::Unsigned16, "0.75 x"),
            (1, 360, 65_536, DataType::Unsigned16, "0.0055 x"),
            (-1, 1, 700_001, DataType::Integer32, "-0.000001 x"),
            (i128::from(i64::MIN), 1, 10, DataType::Integer64, "-922337203685477580.8 x"),
        ] {
            let units = [Unit::new("x", num, den)];
            let (meaning, raw) = (Meaning::Quantity(&units), wire_form(data_type, number));
            assert_eq!(meaning.show(data_type, raw).to_string(), text);
            assert_eq!(meaning.parse(data_type, text), Ok(raw), "{text}");
        }
    }

    #[test]
    fn fractions_keep_their_sign() {
        const VOLTS: Meaning<'_> = Meaning::Quantity(&[Unit::new("V", 1, 10)]);
        let volts = |text| VOLTS.parse(DataType::Integer16, text);
        assert_eq!((volts("-0.5 V"), volts("24.0"), volts("+.5 v")), (Ok(0xFFFB), Ok(240), Ok(5)));
        for text in ["24.05", "1-2 V", ". V", "+-1 V", "1.5 A", "24", "V", ""] {
            assert!(volts(text).is_err(), "{text}");
        }
        assert_eq!(volts("4000 V").unwrap_err().to_string(), "40000 is no INTEGER16: that is -32768 to 32767");
        assert_eq!(volts("24.05 V").unwrap_err().to_string(), "24.05 V cannot be set: the step is 0.1 V");
    }

    #[test]
    fn a_unit_that_other_objects_decide_is_taken_only_if_it_says_all() {
        let units = [Unit::new("mm", 1, 100), Unit::new("deg", 1, 10), Unit::new("mm", 1, 1000)];
        let position = |text| Meaning::Quantity(&units).parse(DataType::Integer32, text);
        assert_eq!((position("2.5 deg"), position("25")), (Ok(25), Ok(25)));
        assert!(position("2.5 mm").is_err() && position("2.5").is_err() && position("2 in").is_err());
        assert_eq!(Meaning::Quantity(&units).show(DataType::Integer32, 25).to_string(), "25");
    }

    #[test]
    fn names_with_signs_and_doubles_mean_the_same() {
        let bits = [
            BitName::new(0, 1, "mode"),
            BitName::new(1, 1, "limit +"),
            BitName::new(2, 2, "mode of motion"),
            BitName::new(4, 1, "reserved"),
            BitName::new(5, 1, "reserved"),
        ];
        let word = Meaning::BitField(&bits);
        for raw in 0..=0xFF {
            let text = word.show(DataType::Unsigned8, raw).to_string();
            assert_eq!(word.parse(DataType::Unsigned8, &text), Ok(raw), "{text}");
        }
        assert_eq!(
            word.show(DataType::Unsigned8, 0xAF).to_string(),
            "mode + limit + + mode of motion 3 + bit 5 + bit 7"
        );
        assert_eq!(
            word.parse(DataType::Unsigned8, "mode of motion 4").unwrap_err().to_string(),
            "mode of motion has only 2 bits"
        );
        let values = [ValueName::new(1, "off"), ValueName::new(0xFF, "reserved"), ValueName::new(3, "reserved")];
        let mode = |text| Meaning::Enumeration(&values).parse(DataType::Integer8, text);
        assert_eq!(
            (mode("OFF"), mode("reserved (-1)"), mode("reserved (3)"), mode("7")),
            (Ok(1), Ok(0xFF), Ok(3), Ok(7))
        );
        assert!(mode("reserved").is_err() && mode("off (3)").is_err());
        assert_eq!(format!("{}", Meaning::Enumeration(&values).show(DataType::Integer8, 0xFF)), "reserved (-1)");
    }
}
