//! The manuals' notation of numbers.

/// A default as printed: `no`, `100`, `195h`, `80h + Node-ID`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Default {
    /// `no`.
    None,
    /// A number.
    Value(i128),
    /// A number to which the node-ID is added.
    NodeIdPlus(i128),
}

/// Parses a default; `None` if the cell is not one.
pub(crate) fn default(text: &str) -> Option<Default> {
    if text == "no" {
        return Some(Default::None);
    }
    match text.strip_suffix(" + Node-ID") {
        Some(base) => number(base).map(Default::NodeIdPlus),
        None => number(text).map(Default::Value),
    }
}

/// Parses a decimal or hexadecimal number (`65h`, `0x65`), a power, or one less than a power (`2^20`, `2^32-1`), with
/// or without a sign.
pub(crate) fn number(text: &str) -> Option<i128> {
    if let Some(text) = text.strip_prefix('-') {
        let bare = text.strip_prefix('(').and_then(|text| text.strip_suffix(')'));
        return number(bare.unwrap_or(text)).map(|number| -number);
    }
    if let Some(power) = text.strip_prefix("2^") {
        let (power, less) = power.strip_suffix("-1").map_or((power, 0), |power| (power, 1));
        return Some((1 << power.parse::<u32>().ok().filter(|power| *power <= 64)?) - less);
    }
    match (text.strip_prefix("0x"), text.strip_suffix('h')) {
        (Some(digits), _) => i128::from_str_radix(digits.strip_suffix('h').unwrap_or(digits), 16).ok(),
        (None, Some(digits)) => i128::from_str_radix(digits, 16).ok(),
        (None, None) => text.parse().ok(),
    }
}

/// Parses hexadecimal digits without a prefix.
pub(crate) fn hex(text: &str) -> Option<u32> {
    u32::from_str_radix(text, 16).ok()
}

/// Bytes in hexadecimal, separated by spaces.
pub(crate) fn bytes(text: &str) -> Option<Vec<u8>> {
    text.split(' ').map(|byte| u8::from_str_radix(byte, 16).ok()).collect()
}

/// Bytes in the notation of the manual.
pub(crate) fn print(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02X}")).collect::<Vec<_>>().join(" ")
}

/// A range: `1..500`.
pub(crate) fn range(text: &str) -> Option<(i128, i128)> {
    let (low, high) = text.split_once("..")?;
    Some((number(low)?, number(high)?))
}

/// Lowest and highest bit of `31..24` or `5..6` or `7`.
pub(crate) fn bits(text: &str) -> Option<(u8, u8)> {
    let (first, last) = text.split_once("..").unwrap_or((text, text));
    let (first, last) = (first.parse::<u8>().ok()?, last.parse::<u8>().ok()?);
    Some((first.min(last), first.max(last)))
}

/// The access of an entry, in the notation of a data sheet.
pub(crate) fn access(text: &str) -> &str {
    match text {
        "read-only" | "read" | "RO" | "R/O" | "r" => "ro",
        "write-only" | "WO" | "W" => "wo",
        "read-write" | "RW" | "R/W" => "rw",
        other => other,
    }
}

/// The name of a data type: `U8` is UNSIGNED8.
pub(crate) fn data_type(text: &str) -> String {
    let text = text.to_ascii_uppercase();
    let wide = |letters: &str, name: &str| {
        let bits = text.strip_prefix(letters)?;
        bits.parse::<u8>().is_ok().then(|| format!("{name}{bits}"))
    };
    let string = || (text == "VISSTR").then(|| "VISIBLE_STRING".to_owned());
    wide("U", "UNSIGNED").or_else(|| wide("INT", "INTEGER")).or_else(string).unwrap_or(text.clone())
}

/// `yes` or `no`.
pub(crate) fn yes(yes: bool) -> &'static str {
    if yes { "yes" } else { "no" }
}

/// A name in the notation of code: `v-Pos` is `v_pos`, `StdIn` is `std_in`.
pub(crate) fn snake(name: &str) -> String {
    let mut words = String::new();
    let mut before = ' ';
    for c in name.chars() {
        if c.is_ascii_uppercase() && before.is_ascii_lowercase() {
            words.push(' ');
        }
        words.push(if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { ' ' });
        before = c;
    }
    words.split_whitespace().collect::<Vec<_>>().join("_")
}

/// Whether a word matches a pattern of 1, 0 and x, whose groups are separated by spaces.
pub(crate) fn fits(word: u16, pattern: &str) -> bool {
    let digits: Vec<char> = pattern.chars().filter(|digit| *digit != ' ').collect();
    let is = |(bit, digit): (usize, &char)| *digit == 'x' || *digit == if word >> bit & 1 == 1 { '1' } else { '0' };
    digits.len() == 16 && digits.iter().rev().enumerate().all(is)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_as_printed() {
        assert_eq!(default("00000192h"), Some(Default::Value(402)));
        assert_eq!(default("80h + Node-ID"), Some(Default::NodeIdPlus(0x80)));
        assert_eq!((default("no"), default(""), default("0..5")), (Some(Default::None), None, None));
        assert_eq!(range("-200..200"), Some((-200, 200)));
        assert_eq!(bytes("0F 01"), Some(vec![0x0F, 1]));
        assert_eq!(snake("CAN Baud Rate"), "can_baud_rate");
        assert_eq!(range("-(2^31-1)..2^32-1"), Some((-0x7FFF_FFFF, 0xFFFF_FFFF)));
        assert_eq!(
            ["0x6Ah", "FFh", "+1", "2^20", "2^99", "60 rpm"].map(number),
            [Some(0x6A), Some(0xFF), Some(1), Some(1 << 20), None, None]
        );
        assert_eq!(
            ["U8", "INT32", "Unsigned16", "VisStr", "Uhr"].map(data_type),
            ["UNSIGNED8", "INTEGER32", "UNSIGNED16", "VISIBLE_STRING", "UHR"]
        );
        assert_eq!([bits("15..0"), bits("5..6"), bits("7")], [Some((0, 15)), Some((5, 6)), Some((7, 7))]);
        let patterns = ["1xx0 0000 0000 00x1", "1xx0 0000 0000 00x0", "1yx0 0000 0000 00x1", "1xx0 0000 0000 00x"];
        assert_eq!(patterns.map(|pattern| fits(0xE001, pattern)), [true, false, false, false]);
    }
}
