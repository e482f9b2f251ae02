//! PDOs as structs: what the generated ones implement.
//!
//! A PDO has at most 64 bits, and so has its number: mapped values lie in it one after the other, the
//! first in the lowest bits (CiA 301, 7.2.2.4.1, figure 22 with 7.1.4).

use super::{Address, Value};
use crate::frame::Frame;
use crate::id::CobId;

/// A PDO with a fixed mapping, as a struct with one field per mapped object.
pub trait Pdo: Copy {
    /// The direction, as the device sees it.
    const DIRECTION: Direction;
    /// 1 to 512: 1400h and 1800h describe number 1.
    const NUMBER: u16;
    /// What is mapped, in order.
    const MAPPING: &'static [Mapped];
    /// The bytes on the bus, 0 to 8: the mapped bits, rounded up.
    const LENGTH: usize = mapped_length(Self::MAPPING);

    /// The bits as a number; byte 0 of the frame is its lowest.
    fn to_raw(self) -> u64;

    /// The values of a number.
    fn from_raw(raw: u64) -> Self;

    /// The values of a frame's data. Bytes beyond the mapped ones are ignored: CiA 301, 7.5.2.36, has
    /// the values used, and the wrong length reported (EMCY 8220h).
    ///
    /// Errors: [`MappedLengthMismatch`] when there are fewer bytes than mapped (EMCY 8210h).
    fn from_data(data: &[u8]) -> Result<Self, MappedLengthMismatch> {
        if data.len() < Self::LENGTH {
            return Err(MappedLengthMismatch { mapped: Self::LENGTH, got: data.len() });
        }
        Ok(Self::from_raw(number(data)))
    }

    /// The frame that carries the values under `id`.
    ///
    /// # Panics
    ///
    /// Never: a PDO has at most eight bytes.
    fn frame(self, id: CobId) -> Frame {
        let bytes = self.to_raw().to_le_bytes();
        Frame::new(id, bytes.get(..Self::LENGTH).unwrap_or(&bytes)).expect("a PDO has at most eight bytes")
    }
}

/// The direction of a PDO as the device sees it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "the names say what it is")]
pub enum Direction {
    Receive,
    Transmit,
}

/// One entry of a PDO mapping (CiA 301, 7.5.2.36).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Mapped {
    /// The object; of a data type (0001h to 0007h) when it is a placeholder.
    pub address: Address,
    /// The length in bits.
    pub bits: u8,
}

impl Mapped {
    /// `bits` of the object `index`:`sub`.
    #[must_use]
    pub const fn new(index: u16, sub: u8, bits: u8) -> Self {
        Mapped { address: Address::new(index, sub), bits }
    }

    /// As the mapping parameter holds it: index, sub-index and length, from the highest byte down.
    #[must_use]
    pub const fn to_parameter(self) -> u32 {
        (self.address.index() as u32) << 16 | (self.address.sub() as u32) << 8 | self.bits as u32
    }

    /// From the value of a mapping parameter.
    #[must_use]
    pub const fn from_parameter(value: u32) -> Self {
        Mapped::new((value >> 16) as u16, (value >> 8) as u8, value as u8)
    }
}

/// A frame has fewer bytes than the PDO maps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[error("the PDO maps {mapped} bytes, the frame has {got}")]
#[allow(missing_docs, reason = "the names say what it is")]
pub struct MappedLengthMismatch {
    pub mapped: usize,
    pub got: usize,
}

/// The data of a PDO of `N` bytes.
#[must_use]
#[inline]
pub fn pack<P: Pdo, const N: usize>(pdo: P) -> [u8; N] {
    const { assert!(N == P::LENGTH, "the generated length is that of the mapping") };
    let mut data = [0; N];
    data.iter_mut().zip(pdo.to_raw().to_le_bytes()).for_each(|(to, from)| *to = from);
    data
}

/// The number of which these are the lowest bytes.
pub(crate) fn number(bytes: &[u8]) -> u64 {
    let mut raw = [0; 8];
    raw.iter_mut().zip(bytes).for_each(|(to, from)| *to = *from);
    u64::from_le_bytes(raw)
}

/// `bits` bits of `raw`, moved up to bit `low`; nothing where they leave the 64.
#[must_use]
#[inline]
pub const fn place(raw: u64, low: u8, bits: u8) -> u64 {
    if low > 63 { 0 } else { (raw & mask(bits)) << low }
}

/// The `bits` bits of `raw` from bit `low` on.
#[must_use]
#[inline]
pub const fn take(raw: u64, low: u8, bits: u8) -> u64 {
    if low > 63 { 0 } else { (raw >> low) & mask(bits) }
}

/// The same of a signed number: where it has fewer than 64 bits, its sign fills those above.
#[must_use]
#[inline]
pub const fn take_signed(raw: u64, low: u8, bits: u8) -> u64 {
    let above = if bits == 0 || bits >= 64 { 0 } else { 64 - bits };
    ((take(raw, low, bits) << above) as i64 >> above) as u64
}

/// The value in `bits` bits of `raw` from bit `low` on. If a mapping has fewer bits than a signed type, the highest of
/// them is the sign.
#[must_use]
#[inline]
pub fn field<T: Value>(raw: u64, low: u8, bits: u8) -> T {
    T::from_raw(if T::DATA_TYPE.is_signed() { take_signed(raw, low, bits) } else { take(raw, low, bits) })
}

/// `word` with the `bits` bits from bit `low` on replaced by the lowest of `value`.
#[must_use]
#[inline]
pub const fn replace(word: u64, low: u8, bits: u8, value: u64) -> u64 {
    (word & !place(u64::MAX, low, bits)) | place(value, low, bits)
}

const fn mask(bits: u8) -> u64 {
    if bits >= 64 { u64::MAX } else { (1 << bits) - 1 }
}

const fn mapped_length(mapping: &[Mapped]) -> usize {
    let mut bits = 0;
    let mut rest = mapping;
    while let [first, others @ ..] = rest {
        bits += first.bits as usize;
        rest = others;
    }
    assert!(bits <= 64, "a PDO maps at most 64 bits");
    bits.div_ceil(8)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The slow and obvious way: bit by bit.
    fn bit(raw: u64, at: u8) -> u64 {
        (raw >> at) & 1
    }

    proptest! {
        #[test]
        fn bits_are_placed_and_taken_as_one_by_one(raw: u64, low in 0_u8..64, bits in 0_u8..=64) {
            let bits = bits.min(64 - low);
            let expected = (0..bits).fold(0, |sum, at| sum | (bit(raw, at) << (at + low)));
            prop_assert_eq!(place(raw, low, bits), expected);
            let expected = (0..bits).fold(0, |sum, at| sum | (bit(raw, at + low) << at));
            prop_assert_eq!(take(raw, low, bits), expected);
            let replaced = replace(raw, low, bits, !take(raw, low, bits));
            prop_assert_eq!(replaced ^ raw, place(u64::MAX, low, bits));
        }
    }

    #[test]
    fn a_sign_fills_the_bits_above() {
        assert_eq!(take_signed(0b1010_1100, 3, 4) as i64, 0b0101);
        assert_eq!(take_signed(0b1010_1100, 2, 4) as i64, -5);
        assert_eq!(take_signed(0xFF, 7, 1) as i64, -1);
        assert_eq!((take_signed(u64::MAX, 0, 64), take_signed(u64::MAX, 0, 0)), (u64::MAX, 0));
        assert_eq!((take_signed(1, 64, 8), take_signed(1, 0, 255)), (0, 1));
    }

    #[test]
    fn nothing_lies_beyond_64_bits() {
        assert_eq!((place(1, 64, 8), take(1, 255, 8)), (0, 0));
        assert_eq!((place(u64::MAX, 0, 255), take(u64::MAX, 0, 64)), (u64::MAX, u64::MAX));
    }

    #[test]
    fn a_mapping_parameter_is_index_sub_index_and_bits() {
        assert_eq!(Mapped::new(0x6040, 0, 16).to_parameter(), 0x6040_0010);
        assert_eq!(Mapped::from_parameter(0x2410_0A08), Mapped::new(0x2410, 0x0A, 8));
    }

    #[derive(Clone, Copy, Debug, PartialEq)]
    struct Three {
        bit: u8,
        word: u16,
    }

    impl Pdo for Three {
        const DIRECTION: Direction = Direction::Transmit;
        const NUMBER: u16 = 3;
        const MAPPING: &'static [Mapped] = &[Mapped::new(0x2000, 0, 1), Mapped::new(0x2001, 0, 16)];
        fn to_raw(self) -> u64 {
            place(self.bit.into(), 0, 1) | place(self.word.into(), 1, 16)
        }
        fn from_raw(raw: u64) -> Self {
            Three { bit: take(raw, 0, 1) as u8, word: take(raw, 1, 16) as u16 }
        }
    }

    #[test]
    fn a_short_frame_is_an_error_and_a_long_one_is_not() {
        assert_eq!(Three::LENGTH, 3);
        assert_eq!(Three::from_data(&[0x03, 0]), Err(MappedLengthMismatch { mapped: 3, got: 2 }));
        let value = Three { bit: 1, word: 0x8001 };
        assert_eq!(Three::from_data(&[0x03, 0x00, 0xFF, 0xAA]), Ok(value));
        assert_eq!(pack(value), [0x03, 0x00, 0x01]);
        assert_eq!(std::format!("{}", value.frame(CobId::SYNC)), "080#030001");
    }
}
