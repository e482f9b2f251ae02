//! The payload of the driver's SDO transfers.

use lexican_runtime::service::sdo_client::{Payload, Scalar};

/// How many bytes of a text are kept.
const TEXT: usize = 64;

/// The bytes of a transfer: a number, or the beginning of a text.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Bytes {
    Number(Scalar),
    /// The second field is the number of bytes that have come.
    Text([u8; TEXT], usize),
}

impl Bytes {
    /// Takes a text of any length, and keeps its first 64 bytes.
    pub(crate) const fn of_text() -> Self {
        Bytes::Text([0; TEXT], 0)
    }

    pub(crate) fn bytes(&self) -> &[u8] {
        match self {
            Bytes::Number(number) => number.bytes(),
            Bytes::Text(text, len) => text.get(..*len).unwrap_or(text),
        }
    }

    pub(crate) fn len(&self) -> u32 {
        self.bytes().len() as u32
    }
}

impl From<Scalar> for Bytes {
    fn from(number: Scalar) -> Self {
        Bytes::Number(number)
    }
}

impl Payload for Bytes {
    fn load(&mut self, offset: u32, buffer: &mut [u8]) -> usize {
        match self {
            Bytes::Number(number) => number.load(offset, buffer),
            Bytes::Text(text, _) => text.load(offset, buffer),
        }
    }

    /// Bytes beyond the capacity are accepted and dropped.
    fn store(&mut self, offset: u32, data: &[u8]) -> usize {
        match self {
            Bytes::Number(number) => number.store(offset, data),
            Bytes::Text(text, len) => {
                *len = (offset as usize).saturating_add(text.store(offset, data)).min(TEXT);
                data.len()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_is_kept_up_to_a_length_and_taken_whole() {
        let mut text = Bytes::of_text();
        assert_eq!(text.store(0, b"Servo 7"), 7);
        assert_eq!(text.bytes(), b"Servo 7");
        let long = [b'x'; 100];
        assert_eq!((text.store(0, &long), text.len()), (100, 64));
        assert_eq!((text.store(100, &long), text.len()), (100, 64));
    }
}
