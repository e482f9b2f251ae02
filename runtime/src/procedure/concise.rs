//! Concise DCF: a configuration as one block of bytes (CiA 302-3, 1F22h).
//!
//! ```text
//! number of entries (4 bytes), and for each: index (2), sub-index (1), length (4), data
//! ```

use super::step::{Data, Step};
use crate::object::Address;

/// The steps of a concise DCF. The iterator ends at the first truncated entry, which [`ConciseDcf::check`] can find
/// beforehand.
#[derive(Clone, Copy, Debug)]
pub struct ConciseDcf<'a> {
    rest: &'a [u8],
    left: u32,
}

/// A place in a concise DCF, for a caller that cannot keep the bytes borrowed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Position {
    bytes_left: usize,
    entries_left: u32,
}

/// The concise DCF is truncated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[error("the concise DCF promises {expected} entries, and ends in entry {got}")]
pub struct ConciseDcfError {
    /// The announced number of entries.
    pub expected: u32,
    /// The truncated entry, counted from 1.
    pub got: u32,
}

/// Why steps cannot be encoded as a concise DCF.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum EncodeError {
    /// The buffer is too short.
    #[error("step {step} does not fit into the {capacity} bytes that there are")]
    Full {
        /// The step, counted from 1; 0 if there is no room for the number of entries.
        step: u32,
        /// The length of the buffer.
        capacity: usize,
    },
    /// A step is not a write.
    #[error("step {step} writes nothing: a concise DCF has only writes")]
    NotAWrite {
        /// The step, counted from 1.
        step: u32,
    },
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

    /// Encodes the writes of `steps` into the beginning of `buffer`, and returns that part of it.
    ///
    /// ```
    /// use lexican_runtime::object::Address;
    /// use lexican_runtime::procedure::{ConciseDcf, Step};
    ///
    /// let mut buffer = [0; 64];
    /// let settings = [Step::value(Address::new(0x1017, 0), 1000_u16), Step::value(Address::new(0x6060, 0), 1_i8)];
    /// assert_eq!(
    ///     ConciseDcf::encode(settings, &mut buffer)?,
    ///     [2, 0, 0, 0, 0x17, 0x10, 0, 2, 0, 0, 0, 0xE8, 3, 0x60, 0x60, 0, 1, 0, 0, 0, 1]
    /// );
    /// # Ok::<(), lexican_runtime::procedure::EncodeError>(())
    /// ```
    pub fn encode<'s, 'b>(
        steps: impl IntoIterator<Item = Step<'s>>,
        buffer: &'b mut [u8],
    ) -> Result<&'b [u8], EncodeError> {
        let (mut len, capacity) = (0, buffer.len());
        let count = write(steps, |step, bytes| {
            let end = len + bytes.len();
            buffer.get_mut(len..end).ok_or(EncodeError::Full { step, capacity })?.copy_from_slice(bytes);
            len = end;
            Ok(())
        })?;
        if let Some(first) = buffer.first_chunk_mut() {
            *first = count.to_le_bytes();
        }
        Ok(buffer.get(..len).unwrap_or(&[]))
    }

    /// As [`ConciseDcf::encode`], into a new vector.
    #[cfg(any(feature = "std", test))]
    pub fn to_vec<'s>(steps: impl IntoIterator<Item = Step<'s>>) -> Result<std::vec::Vec<u8>, EncodeError> {
        let mut bytes = std::vec::Vec::new();
        let count = write(steps, |_, piece| {
            bytes.extend(piece);
            Ok(())
        })?;
        if let Some(first) = bytes.first_chunk_mut() {
            *first = count.to_le_bytes();
        }
        Ok(bytes)
    }

    /// Checks that no entry is truncated.
    pub fn check(self) -> Result<(), ConciseDcfError> {
        let expected = self.left;
        let mut got = 0;
        for _ in self {
            got += 1;
        }
        if got == expected { Ok(()) } else { Err(ConciseDcfError { expected, got: got + 1 }) }
    }

    /// The present place.
    pub(super) const fn position(&self) -> Position {
        Position { bytes_left: self.rest.len(), entries_left: self.left }
    }

    /// The entries of `bytes` from a place on.
    pub(super) fn at(bytes: &'a [u8], position: Position) -> Self {
        let begin = bytes.len().saturating_sub(position.bytes_left);
        ConciseDcf { rest: bytes.get(begin..).unwrap_or(&[]), left: position.entries_left }
    }

    /// The address and the data of the next entry, and what follows it.
    pub(super) fn split(&self) -> Option<(Address, &'a [u8], Self)> {
        let left = self.left.checked_sub(1)?;
        let (&[low, high, sub, l0, l1, l2, l3], rest) = self.rest.split_first_chunk()?;
        let len = usize::try_from(u32::from_le_bytes([l0, l1, l2, l3])).ok()?;
        let (data, rest) = rest.split_at_checked(len)?;
        Some((Address::new(u16::from_le_bytes([low, high]), sub), data, ConciseDcf { rest, left }))
    }
}

/// Writes room for the number of entries, then the entries. Returns their number.
fn write<'s>(
    steps: impl IntoIterator<Item = Step<'s>>,
    mut put: impl FnMut(u32, &[u8]) -> Result<(), EncodeError>,
) -> Result<u32, EncodeError> {
    put(0, &[0; 4])?;
    let mut count = 0;
    for step in steps {
        count += 1;
        let Step::Write { address, data } = step else { return Err(EncodeError::NotAWrite { step: count }) };
        let data = match &data {
            Data::Value(value) => value.bytes(),
            Data::Bytes(bytes) => bytes,
        };
        // An SDO transfers less than 4 GiB.
        let len = u32::try_from(data.len()).unwrap_or(u32::MAX);
        put(count, &address.index().to_le_bytes())?;
        put(count, &[address.sub()])?;
        put(count, &len.to_le_bytes())?;
        put(count, data)?;
    }
    Ok(count)
}

impl<'a> Iterator for ConciseDcf<'a> {
    type Item = Step<'a>;

    fn next(&mut self) -> Option<Step<'a>> {
        let (address, data, rest) = self.split()?;
        *self = rest;
        Some(Step::bytes(address, data))
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

    #[test]
    fn what_is_made_is_read_again() {
        let long = [7; 20];
        let steps = || {
            let values = [Step::value(Address::new(0x1017, 0), 1000_u16), Step::bytes(Address::new(0x2000, 3), &long)];
            values.into_iter().chain([Step::value(Address::new(0x6060, 0), -1_i8)])
        };
        let bytes = ConciseDcf::to_vec(steps()).unwrap();
        assert_eq!(ConciseDcf::new(&bytes).check(), Ok(()));
        let mut room = std::vec![0xEE; bytes.len()];
        assert_eq!(ConciseDcf::encode(steps(), &mut room), Ok(&bytes[..]));
        let again = ConciseDcf::to_vec(ConciseDcf::new(&bytes)).unwrap();
        assert_eq!(again, bytes);
        assert_eq!(ConciseDcf::to_vec([]), Ok(std::vec![0; 4]));
        assert_eq!(ConciseDcf::to_vec(ConciseDcf::new(TWO)).unwrap(), TWO);
    }

    #[test]
    fn what_does_not_fit_or_does_not_write_is_refused() {
        for len in 0..TWO.len() {
            let step = [4, 13].iter().filter(|&&end| len >= end).count() as u32;
            let mut room = std::vec![0; len];
            let error = ConciseDcf::encode(ConciseDcf::new(TWO), &mut room).unwrap_err();
            assert_eq!(error, EncodeError::Full { step, capacity: len });
        }
        let waits = || [Step::value(Address::new(0x1017, 0), 0_u16), Step::Wait(crate::Duration::ZERO)];
        assert_eq!(ConciseDcf::encode(waits(), &mut [0; 99]), Err(EncodeError::NotAWrite { step: 2 }));
        assert_eq!(ConciseDcf::to_vec(waits()), Err(EncodeError::NotAWrite { step: 2 }));
    }
}
