//! The length of a frame on the wire.

use crate::Frame;

/// The number of bits that a frame occupies on the bus, from its start to the end of the intermission of three bits
/// (ISO 11898-1), including its stuff bits: between 47 and 160.
#[must_use]
pub fn wire_bits(frame: &Frame) -> u32 {
    /// Delimiter of the checksum, acknowledgement, end of frame, intermission, which are not stuffed.
    const TAIL: u32 = 1 + 2 + 7 + 3;
    let id = frame.id().raw();
    let mut bits = StuffedBits::default();
    bits.push(0, 1);
    if frame.id().is_extended() {
        bits.push(id >> 18, 11);
        bits.push(0b11, 2);
        bits.push(id & 0x3_FFFF, 18);
        bits.push(u32::from(frame.is_remote()), 1);
        bits.push(0, 2);
    } else {
        bits.push(id, 11);
        bits.push(u32::from(frame.is_remote()), 1);
        bits.push(0, 2);
    }
    bits.push(frame.dlc().into(), 4);
    frame.data().iter().for_each(|byte| bits.push((*byte).into(), 8));
    let checksum = bits.checksum;
    bits.push(checksum, CHECKSUM_BITS);
    bits.count + TAIL
}

const CHECKSUM_BITS: u32 = 15;

/// Counts bits with a stuff bit after each five equal ones, and calculates their checksum.
#[derive(Default)]
struct StuffedBits {
    count: u32,
    checksum: u32,
    last: Option<u32>,
    equal: u32,
}

impl StuffedBits {
    /// Adds the lowest `count` bits, the highest first.
    fn push(&mut self, value: u32, count: u32) {
        const POLYNOMIAL: u32 = 0x4599;
        for place in (0..count).rev() {
            let bit = value >> place & 1;
            let carry = self.checksum >> (CHECKSUM_BITS - 1) & 1;
            self.checksum = self.checksum << 1 & 0x7FFF ^ if carry == bit { 0 } else { POLYNOMIAL };
            self.equal = if self.last == Some(bit) { self.equal + 1 } else { 1 };
            (self.last, self.count) = (Some(bit), self.count + 1);
            if self.equal == 5 {
                (self.last, self.equal, self.count) = (Some(1 - bit), 1, self.count + 1);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::CobId;
    use proptest::prelude::*;

    /// The check value of CRC-15/CAN in the catalogues.
    #[test]
    fn the_checksum_is_that_of_can() {
        let mut bits = StuffedBits::default();
        b"123456789".iter().for_each(|byte| bits.push((*byte).into(), 8));
        assert_eq!(bits.checksum, 0x059E);
    }

    #[test]
    fn stuff_bits_are_counted() {
        // 19 zeros and a checksum of zeros: one bit after each five of 34.
        let zeros = Frame::new(CobId::NMT, &[]).unwrap();
        assert_eq!(wire_bits(&zeros), 34 + 6 + 13);
        let mut bits = StuffedBits::default();
        // The stuff bit after five ones counts among the zeros that follow.
        bits.push(0b11_1110_0001, 10);
        assert_eq!(bits.count, 12);
    }

    proptest! {
        #[test]
        fn a_frame_is_as_long_as_its_format_permits(id in 0_u16..0x800, data in prop::collection::vec(any::<u8>(), 0..=8)) {
            let frame = Frame::new(CobId::standard(id).unwrap(), &data).unwrap();
            let stuffed = 34 + 8 * data.len() as u32;
            prop_assert!((stuffed + 13..=stuffed + 13 + (stuffed - 1) / 4).contains(&wire_bits(&frame)));
        }
    }
}
