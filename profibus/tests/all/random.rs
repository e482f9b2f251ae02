//! Pseudo-random bytes, the same in every run.

/// xorshift64*: the same bytes in every run.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn next(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_F491_4F6C_DD1D)
    }

    pub(crate) fn below(&mut self, count: usize) -> usize {
        (self.next() >> 33) as usize % count
    }

    /// Bytes with the beginnings of telegrams more often than by chance.
    pub(crate) fn line(&mut self, len: usize) -> Vec<u8> {
        const LIKELY: [u8; 8] = [0x68, 0x10, 0xA2, 0xDC, 0xE5, 0x16, 0x87, 0x07];
        let mut byte = || match (self.next() >> 24) as u8 {
            byte @ 0..16 => LIKELY[usize::from(byte & 7)],
            byte => byte,
        };
        (0..len).map(|_| byte()).collect()
    }

    /// Up to three bytes become others, come in, or go.
    pub(crate) fn alter(&mut self, telegram: &mut Vec<u8>) {
        for _ in 0..=self.below(3) {
            let at = self.below(telegram.len());
            match self.below(4) {
                0 => telegram[at] ^= 1 << self.below(8),
                1 => telegram[at] = self.below(256) as u8,
                2 => telegram.insert(at, self.below(256) as u8),
                _ if telegram.len() > 1 => drop(telegram.remove(at)),
                _ => {}
            }
        }
    }
}
