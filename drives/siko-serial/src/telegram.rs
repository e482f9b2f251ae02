//! The bytes of a command or of an answer.

use core::fmt;

/// The bytes of a command or of an answer, at most 12, as in the answer to `J1`.
#[derive(Clone, Copy, Default, PartialEq, Eq)]
pub struct Telegram {
    bytes: [u8; Telegram::MOST],
    len: usize,
}

impl Telegram {
    /// The length of the longest telegram.
    pub const MOST: usize = 12;

    /// The bytes.
    #[must_use]
    pub fn as_bytes(&self) -> &[u8] {
        self.bytes.get(..self.len).unwrap_or(&self.bytes)
    }

    /// Appends bytes. Bytes beyond the capacity are dropped; no telegram of the protocol has them.
    pub(crate) fn push(mut self, bytes: &[u8]) -> Self {
        for byte in bytes {
            if let Some(place) = self.bytes.get_mut(self.len) {
                *place = *byte;
                self.len += 1;
            }
        }
        self
    }

    /// Appends a number with `width` decimal digits; higher digits are left out.
    pub(crate) fn digits(self, number: u32, width: u32) -> Self {
        let digit = |place| number / 10_u32.pow(place) % 10;
        (0..width).rev().fold(self, |telegram, place| telegram.push(&[b'0' + digit(place) as u8]))
    }

    /// Appends a sign and `width` decimal digits.
    pub(crate) fn signed(self, number: i32, width: u32) -> Self {
        self.push(if number < 0 { b"-" } else { b"+" }).digits(number.unsigned_abs(), width)
    }

    /// Appends a number with `width` hexadecimal digits.
    pub(crate) fn hex(self, number: u16, width: u32) -> Self {
        const DIGITS: &[u8; 16] = b"0123456789ABCDEF";
        let digit = |place| DIGITS[usize::from(number >> (4 * place) & 0xF)];
        (0..width).rev().fold(self, |telegram, place| telegram.push(&[digit(place)]))
    }

    pub(crate) fn clear(&mut self) {
        *self = Telegram::default();
    }
}

impl fmt::Debug for Telegram {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "\"{}\"", self.as_bytes().escape_ascii())
    }
}

/// The number of decimal digits; `None` if there is any other character.
pub(crate) fn decimal(digits: &[u8]) -> Option<u32> {
    number(digits, 10)
}

/// The number of hexadecimal digits.
pub(crate) fn hexadecimal(digits: &[u8]) -> Option<u16> {
    number(digits, 16).and_then(|number| number.try_into().ok())
}

/// The number of a sign and decimal digits.
pub(crate) fn signed(text: &[u8]) -> Option<i32> {
    let (sign, digits) = text.split_first()?;
    let number = i32::try_from(decimal(digits)?).ok()?;
    match sign {
        b'+' => Some(number),
        b'-' => Some(-number),
        _ => None,
    }
}

fn number(digits: &[u8], radix: u32) -> Option<u32> {
    digits
        .iter()
        .try_fold(0_u32, |number, digit| number.checked_mul(radix)?.checked_add(char::from(*digit).to_digit(radix)?))
}
