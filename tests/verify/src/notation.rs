//! The manual's notation of numbers.

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

/// `None` when the cell is none of these.
pub(crate) fn default(text: &str) -> Option<Default> {
    if text == "no" {
        return Some(Default::None);
    }
    match text.strip_suffix(" + Node-ID") {
        Some(base) => number(base).map(Default::NodeIdPlus),
        None => number(text).map(Default::Value),
    }
}

/// Decimal, or hexadecimal with an `h` behind it.
pub(crate) fn number(text: &str) -> Option<i128> {
    match text.strip_suffix('h') {
        Some(digits) => i128::from_str_radix(digits, 16).ok(),
        None => text.parse().ok(),
    }
}

/// Hexadecimal without a prefix.
pub(crate) fn hex(text: &str) -> Option<u32> {
    u32::from_str_radix(text, 16).ok()
}

/// Bytes in hexadecimal, separated by spaces.
pub(crate) fn bytes(text: &str) -> Option<Vec<u8>> {
    text.split(' ').map(|byte| u8::from_str_radix(byte, 16).ok()).collect()
}

/// Bytes as the manual prints them.
pub(crate) fn print(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02X}")).collect::<Vec<_>>().join(" ")
}

/// A range: `1..500`.
pub(crate) fn range(text: &str) -> Option<(i128, i128)> {
    let (low, high) = text.split_once("..")?;
    Some((low.parse().ok()?, high.parse().ok()?))
}

/// `yes` or `no`.
pub(crate) fn yes(yes: bool) -> &'static str {
    if yes { "yes" } else { "no" }
}

/// A name as it would be written in code: `v-Pos` is `v_pos`.
pub(crate) fn snake(name: &str) -> String {
    let words = name.split(|c: char| !c.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
    words.map(str::to_ascii_lowercase).collect::<Vec<_>>().join("_")
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
    }
}
