//! The notation of numbers in all fields, clients and languages: a decimal point, and nothing between thousands.
//!
//! What is shown beside a field can be typed into it. A text with a second reading is not sent: `5.000` means five
//! thousand in half of Europe.

use crate::request::Refused;

/// Refuses a number with two readings, unless the field itself shows this many decimals; `shown` is what the field
/// shows for it.
///
/// Errors: the readings, and what to write instead.
pub(crate) fn check(text: &str, shown: Option<&str>) -> Result<(), Refused> {
    let Some(number) = leading_number(text) else { return Ok(()) };
    let is_shown_so = |shown: &str| !number.contains(',') && shown.contains('.') && decimals(number) <= decimals(shown);
    if shown.and_then(leading_number).is_some_and(is_shown_so) && reading(number, ',', '.').is_some() {
        return Ok(());
    }
    let rest = text.trim_start().strip_prefix(number).unwrap_or_default();
    let written = |reading: String| format!("{reading}{rest}");
    // Read with a decimal point, and with a decimal comma.
    let (point, comma) = (reading(number, ',', '.'), reading(number, '.', ','));
    match (point, comma) {
        (Some(point), Some(comma)) if value(&point) != value(&comma) => {
            Err(Refused::new(format_args!("{number} may be {} or {}", plain(&point), plain(&comma)))
                .with_remedy(format_args!("write {} or {}", written(plain(&point)), written(plain(&comma)))))
        }
        (Some(reading), _) | (_, Some(reading)) if reading != number => Err(Refused::new(format_args!(
            "{number} is no number here: the decimal sign is a point, and nothing stands between thousands"
        ))
        .with_remedy(format_args!("write {}", written(reading)))),
        (None, None) => Err(Refused::new(format_args!("{number} is no number"))
            .with_remedy("the decimal sign is a point, and nothing stands between thousands: 1234.5")),
        _ => Ok(()),
    }
}

/// Parses a text after [`check`]ing its number.
pub(crate) fn read<T>(
    text: &str,
    parse: impl Fn(&str) -> Result<T, String>,
    shown: impl Fn(&T) -> String,
) -> Result<T, Refused> {
    let parsed = parse(text);
    check(text, parsed.as_ref().ok().map(shown).as_deref())?;
    parsed.map_err(Refused::new)
}

/// Parses a number.
pub(crate) fn parse(text: &str) -> Result<f64, Refused> {
    check(text, None)?;
    let number = text.trim().parse().ok().filter(|number: &f64| number.is_finite());
    number.ok_or_else(|| Refused::new(format_args!("{text:?} is no number")))
}

/// The sign, digits, points and commas at the beginning, if there is a point or comma among the digits and no exponent.
fn leading_number(text: &str) -> Option<&str> {
    let text = text.trim_start();
    let end =
        text.find(|character: char| !matches!(character, '0'..='9' | '.' | ',' | '+' | '-')).unwrap_or(text.len());
    let (number, rest) = text.split_at(end);
    let has_exponent =
        rest.starts_with(['e', 'E']) && rest[1..].starts_with(|it: char| it.is_ascii_digit() || "+-".contains(it));
    (number.contains(['.', ',']) && number.contains(|it: char| it.is_ascii_digit()) && !has_exponent).then_some(number)
}

fn decimals(number: &str) -> usize {
    number.split_once('.').map_or(0, |(_, decimals)| decimals.len())
}

fn value(reading: &str) -> Option<f64> {
    reading.parse().ok()
}

/// A reading without ambiguity: `5` for `5.000`.
fn plain(reading: &str) -> String {
    value(reading).map_or_else(|| reading.to_owned(), |number| number.to_string())
}

/// Reads a number with these separators of thousands and decimals; returns it with a decimal point.
fn reading(number: &str, thousands: char, decimal: char) -> Option<String> {
    let (sign, digits) = number.strip_prefix(['+', '-']).map_or(("", number), |digits| (&number[..1], digits));
    let (whole, decimals) =
        digits.split_once(decimal).map_or((digits, None), |(whole, decimals)| (whole, Some(decimals)));
    let is_digits = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    let mut groups = whole.split(thousands);
    let first = groups.next().unwrap_or_default();
    let are_groups = !whole.contains(thousands)
        || (is_digits(first)
            && first.len() <= 3
            && !first.starts_with('0')
            && groups.all(|it| is_digits(it) && it.len() == 3));
    let whole: String = whole.split(thousands).collect();
    let is_number = are_groups && is_digits(&whole) && decimals.is_none_or(is_digits);
    is_number.then(|| decimals.map_or(format!("{sign}{whole}"), |decimals| format!("{sign}{whole}.{decimals}")))
}

#[cfg(test)]
mod tests {
    use lexican_eds::library;
    use lexican_eds::model::{Entry, Value};
    use lexican_eds::types::Class;
    use lexican_toolbox::values::DeviceValues;

    use super::*;

    #[test]
    fn what_may_be_two_numbers_is_refused_with_both() {
        for (text, why, remedy) in [
            ("5.000", "5.000 may be 5 or 5000", "write 5 or 5000"),
            ("-5.000 mm", "-5.000 may be -5 or -5000", "write -5 mm or -5000 mm"),
            ("5,000", "5,000 may be 5000 or 5", "write 5000 or 5"),
            ("12.345deg", "12.345 may be 12.345 or 12345", "write 12.345deg or 12345deg"),
        ] {
            let refused = check(text, None).unwrap_err();
            assert_eq!((&*refused.why, refused.remedy.as_deref()), (why, Some(remedy)), "{text}");
        }
    }

    #[test]
    fn what_is_written_otherwise_is_refused_with_how_to_write_it() {
        for (text, remedy) in [
            ("5,5", "write 5.5"),
            ("+5,50 mm", "write +5.50 mm"),
            ("1.234,5", "write 1234.5"),
            ("1,234.5", "write 1234.5"),
            ("1.234.567", "write 1234567"),
            ("0,500", "write 0.500"),
        ] {
            assert_eq!(check(text, None).unwrap_err().remedy.as_deref(), Some(remedy), "{text}");
        }
        assert!(check("1.2.3", None).is_err() && check("1,2,3", None).is_err());
    }

    #[test]
    fn what_has_one_reading_passes() {
        for text in [
            "5",
            "-5000",
            "5.5",
            "0.500",
            "1234.567",
            "5.25 mm",
            "0x1F",
            "raw:5",
            "profile position",
            "1.234e3",
            "",
            "+0.5",
        ] {
            assert_eq!(check(text, None), Ok(()), "{text}");
        }
        assert_eq!(parse(" 12.5 "), Ok(12.5));
        assert!(parse("12.500").is_err() && parse("12 mm").is_err() && parse("inf").is_err());
    }

    #[test]
    fn what_the_field_shows_itself_passes() {
        assert_eq!(check("5.000 mm", Some("+5.000 mm")), Ok(()));
        assert_eq!(check("-5.000", Some("-5.000 mm")), Ok(()));
        assert!(check("5.000", Some("5")).is_err() && check("5.000", Some("+5.00 mm")).is_err());
    }

    /// Every number of the library's devices is accepted as shown, and means the same.
    #[test]
    fn what_is_shown_beside_a_field_can_be_typed_into_it() {
        let mut checked = 0;
        for shipped in library::all() {
            let (device, _) = lexican_eds::load(&shipped.input());
            let values = DeviceValues::new(&device);
            let numeric =
                |entry: &&Entry| matches!(entry.data_type.class(), Class::Signed | Class::Unsigned | Class::Real);
            for entry in device.entries().filter(numeric) {
                for number in [0, 1, 5, 100, -5, 5000, 12_345, -1_234_567] {
                    let value = match entry.data_type.class() {
                        Class::Real => Value::Real(number as f64 / 1000.0),
                        _ => Value::Integer(number),
                    };
                    if entry.data_type.range().is_some_and(|(low, high)| !(low..=high).contains(&number)) {
                        continue;
                    }
                    let shown = values.describe(entry, &value);
                    let taken = read(&shown, |text| values.parse(entry, text), |value| values.describe(entry, value));
                    // Names and bits are texts.
                    if shown.starts_with(|it: char| it.is_ascii_digit() || "+-".contains(it)) {
                        // A mapping entry is shown with the name of its object, and refused when typed.
                        let is_mapping = matches!(entry.index, 0x1600..=0x17FF | 0x1A00..=0x1BFF) && taken.is_err();
                        assert!(taken == Ok(value) || is_mapping, "{} {} {shown:?}", shipped.id, entry.name);
                        checked += 1;
                    }
                }
            }
        }
        assert!(checked > 3_000, "{checked}");
    }
}
