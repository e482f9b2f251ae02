//! Concise DCF: a configuration as one block of bytes (CiA 302-3, 1F22h).
//!
//! ```text
//! number of entries (4 bytes), and for each: index (2), sub-index (1), length (4), data
//! ```

use super::step::Step;
use crate::object::Address;

/// The steps of a concise DCF. Ends at the first entry that is cut off; [`ConciseDcf::check`] tells
/// beforehand whether one is.
#[derive(Clone, Copy, Debug)]
pub struct ConciseDcf<'a> {
    rest: &'a [u8],
    left: u32,
}

/// A concise DCF is cut off.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the concise DCF promises {expected} entries, and ends in entry {got}")]
pub struct ConciseDcfError {
    /// How many entries it promises.
    pub expected: u32,
    /// The number of the entry in which it ends, counted from 1.
    pub got: u32,
}

impl<'a> ConciseDcf<'a> {
    /// The entries of `bytes`. Empty bytes are a configuration without entries.
    #[must_use]
    pub fn new(bytes: &'a [u8]) -> Self {
        match bytes.split_first_chunk() {
            Some((count, rest)) => ConciseDcf { rest, left: u32::from_le_bytes(*count) },
            None => ConciseDcf { rest: &[], left: 0 },
        }
    }

    /// Whether all entries are there.
    ///
    /// # Errors
    ///
    /// [`ConciseDcfError`] when the bytes end before.
    pub fn check(self) -> Result<(), ConciseDcfError> {
        let expected = self.left;
        let mut got = 0;
        for _ in self {
            got += 1;
        }
        if got == expected { Ok(()) } else { Err(ConciseDcfError { expected, got: got + 1 }) }
    }
}

impl<'a> Iterator for ConciseDcf<'a> {
    type Item = Step<'a>;

    fn next(&mut self) -> Option<Step<'a>> {
        let left = self.left.checked_sub(1)?;
        let (&[low, high, sub, l0, l1, l2, l3], rest) = self.rest.split_first_chunk()?;
        let len = usize::try_from(u32::from_le_bytes([l0, l1, l2, l3])).ok()?;
        let (data, rest) = rest.split_at_checked(len)?;
        (self.left, self.rest) = (left, rest);
        Some(Step::bytes(Address::new(u16::from_le_bytes([low, high]), sub), data))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TWO: &[u8] = &[2, 0, 0, 0, 0x17, 0x10, 0, 2, 0, 0, 0, 0xE8, 0x03, 0x60, 0x60, 0, 1, 0, 0, 0, 1];

    #[test]
    fn every_entry_is_a_step() {
        let steps: std::vec::Vec<_> = ConciseDcf::new(TWO).map(|step| std::format!("{step}")).collect();
        assert_eq!(steps, ["write 1017:00", "write 6060:00"]);
        assert_eq!(ConciseDcf::new(TWO).check(), Ok(()));
        assert_eq!(ConciseDcf::new(&[]).check(), Ok(()));
    }

    #[test]
    fn a_cut_is_noticed_wherever_it_is() {
        for len in 4..TWO.len() {
            let got = if len < 13 { 1 } else { 2 };
            assert_eq!(ConciseDcf::new(&TWO[..len]).check(), Err(ConciseDcfError { expected: 2, got }), "{len}");
        }
        let endless = [0xFF, 0xFF, 0xFF, 0xFF, 0, 0, 0, 0xFF, 0xFF, 0xFF, 0xFF];
        assert!(ConciseDcf::new(&endless).check().is_err());
    }
}
