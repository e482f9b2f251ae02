//! Parses numbers without sign, which `parse` would accept.

pub(super) fn decimal(digits: &str) -> Option<u64> {
    digits.parse().ok().filter(|_| !digits.starts_with('+'))
}

pub(crate) fn hex(digits: &str) -> Option<u32> {
    u32::from_str_radix(digits, 16).ok().filter(|_| !digits.starts_with('+'))
}

/// A decimal number with at most one point, in units of its `places`th decimal; further decimals are dropped.
///
/// `fixed("1.5", 6)` is 1,500,000.
pub(super) fn fixed(text: &str, places: u32) -> Option<u64> {
    let (whole, fraction) = text.split_once('.').unwrap_or((text, "0"));
    if fraction.is_empty() || !fraction.bytes().all(|byte| byte.is_ascii_digit()) {
        return None;
    }
    let digits = fraction.bytes().chain(std::iter::repeat(b'0')).take(places as usize);
    digits.fold(decimal(whole), |number, digit| number?.checked_mul(10)?.checked_add(u64::from(digit - b'0')))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_with_a_point_are_cut_and_filled_up() {
        for (text, value) in [
            ("1.5", Some(1_500_000)),
            ("1", Some(1_000_000)),
            ("0000000012.0000019", Some(12_000_001)),
            ("1.", None),
            (".5", None),
            ("+1.5", None),
            ("1.+5", None),
            ("1.5e3", None),
            ("99999999999999999999.0", None),
        ] {
            assert_eq!(fixed(text, 6), value, "{text:?}");
        }
    }
}
