//! The checksum of SDO block transfers (CiA 301, 7.2.4.3.16): x^16 + x^12 + x^5 + 1, starting from 0; and the checksum
//! of stored values.

/// The checksum of the bytes so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Crc(u16);

impl Crc {
    /// The checksum of no bytes.
    #[must_use]
    pub const fn new() -> Self {
        Crc(0)
    }

    /// The checksum.
    #[must_use]
    pub const fn get(self) -> u16 {
        self.0
    }

    /// Adds bytes.
    #[inline]
    pub fn update(&mut self, data: &[u8]) {
        if IS_SMALL {
            return data.iter().for_each(|byte| self.update_byte(*byte));
        }
        let (segments, rest) = data.as_chunks::<7>();
        for segment in segments {
            self.update_segment(segment);
        }
        for byte in rest {
            self.update_byte(*byte);
        }
    }

    /// Adds a byte without a table: the byte is divided in two steps of four bits, of which the second depends on the
    /// first.
    fn update_byte(&mut self, byte: u8) {
        let [high, low] = self.0.to_be_bytes();
        let first = high ^ byte;
        let both = u16::from(first ^ first >> 4);
        self.0 = u16::from(low) << 8 ^ both << 12 ^ both << 5 ^ both;
    }

    /// Adds the bytes of a full segment. Their terms are independent of each other (README: SDO block read).
    #[inline]
    pub fn update_segment(&mut self, segment: &[u8; 7]) {
        if IS_SMALL {
            return self.update(segment);
        }
        let [a, b, c, d, e, f, g] = *segment;
        let [high, low] = self.0.to_be_bytes();
        self.0 = term(6, a ^ high) ^ term(5, b ^ low) ^ term(4, c) ^ term(3, d) ^ term(2, e) ^ term(1, f) ^ term(0, g);
    }
}

/// On a microcontroller, the tables would take more memory than the saved time is worth.
const IS_SMALL: bool = cfg!(target_pointer_width = "32");

/// The contribution of a byte to the checksum if `after` more bytes follow it. The checksum is linear, so the
/// contribution of a byte is the sum of those of its two nibbles. Sixteen values per nibble are enough (448 bytes for a
/// segment), instead of the 3,584 bytes of a table for whole bytes.
#[inline(always)]
fn term(after: usize, byte: u8) -> u16 {
    let [low, high] = TABLE[after];
    high[usize::from(byte >> 4)] ^ low[usize::from(byte & 0x0F)]
}

/// Indexed by the number of following bytes, then by low or high nibble.
static TABLE: [[[u16; 16]; 2]; 7] = {
    let mut table = [[[0; 16]; 2]; 7];
    let mut after = 0;
    while after < 7 {
        let mut nibble = 0;
        while nibble < 16 {
            table[after][0][nibble] = remainder(nibble as u8, after);
            table[after][1][nibble] = remainder((nibble as u8) << 4, after);
            nibble += 1;
        }
        after += 1;
    }
    table
};

/// The checksum of `byte` and `after` zero bytes, by the definition.
const fn remainder(byte: u8, after: usize) -> u16 {
    let mut crc = (byte as u16) << 8;
    let mut bit = 0;
    while bit < 8 * (after + 1) {
        crc = crc << 1 ^ if crc & 0x8000 != 0 { 0x1021 } else { 0 };
        bit += 1;
    }
    crc
}

/// CRC-32 of IEEE 802.3, for stored values, which are few and seldom read, so it has no table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Crc32(u32);

impl Crc32 {
    /// The checksum of no bytes.
    #[must_use]
    pub const fn new() -> Self {
        Crc32(u32::MAX)
    }

    /// The checksum.
    #[must_use]
    pub const fn get(self) -> u32 {
        !self.0
    }

    /// Adds bytes.
    pub fn update(&mut self, data: &[u8]) {
        self.0 = data.iter().fold(self.0, |crc, byte| {
            (0..8).fold(crc ^ u32::from(*byte), |crc, _| if crc & 1 == 0 { crc >> 1 } else { crc >> 1 ^ 0xEDB8_8320 })
        });
    }
}

impl Default for Crc32 {
    fn default() -> Self {
        Crc32::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_check_value_of_crc_32_holds() {
        let mut crc = Crc32::new();
        crc.update(b"1234");
        crc.update(b"56789");
        assert_eq!(crc.get(), 0xCBF4_3926);
    }

    #[track_caller]
    fn check(data: &[u8], crc: u16) {
        let mut whole = Crc::new();
        whole.update(data);
        assert_eq!(whole.get(), crc);
        let mut in_pieces = Crc::new();
        data.chunks(3).for_each(|piece| in_pieces.update(piece));
        assert_eq!(in_pieces, whole);
        let mut in_bytes = Crc::new();
        data.iter().for_each(|byte| in_bytes.update_byte(*byte));
        assert_eq!(in_bytes, whole);
    }

    #[test]
    fn the_check_value_of_the_standard_holds() {
        check(b"123456789", 0x31C3);
    }

    #[test]
    fn every_length_agrees_with_the_definition() {
        let data: std::vec::Vec<u8> = (0..=255).map(|n: u8| n.wrapping_mul(167)).collect();
        for len in 0..data.len() {
            let bitwise = data[..len].iter().fold(0_u16, |crc, byte| {
                (0..8).fold(crc ^ (u16::from(*byte) << 8), |crc, _| (crc << 1) ^ ((crc >> 15) * 0x1021))
            });
            check(&data[..len], bitwise);
        }
    }
}
