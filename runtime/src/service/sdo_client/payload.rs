//! What a client transfers: bytes that the application lends.

use crate::object::{LengthMismatch, Value};

/// The bytes of a transfer, accessed by offset. Slices and arrays are payloads; a file or a flash
/// memory can be one.
pub trait Payload {
    /// Copies bytes to be written, from `offset` on, into `buffer`, and returns how many: less than the whole
    /// buffer only when there are no more. May be asked again for bytes before, when they got lost, and for
    /// bytes beyond the number that is written.
    fn load(&mut self, offset: u32, buffer: &mut [u8]) -> usize;

    /// Takes bytes that were read, at `offset`: ascending and without gaps. Returns how many of them there was
    /// room for; less than all of them fails the transfer.
    fn store(&mut self, offset: u32, data: &[u8]) -> usize;
}

/// A buffer for both directions.
impl<const N: usize> Payload for [u8; N] {
    #[inline]
    fn load(&mut self, offset: u32, buffer: &mut [u8]) -> usize {
        load(self, offset, buffer)
    }

    #[inline]
    fn store(&mut self, offset: u32, data: &[u8]) -> usize {
        store(self, offset, data)
    }
}

/// A buffer for both directions.
impl Payload for &mut [u8] {
    #[inline]
    fn load(&mut self, offset: u32, buffer: &mut [u8]) -> usize {
        load(self, offset, buffer)
    }

    #[inline]
    fn store(&mut self, offset: u32, data: &[u8]) -> usize {
        store(self, offset, data)
    }
}

/// Bytes to be written. They cannot receive any.
impl Payload for &[u8] {
    #[inline]
    fn load(&mut self, offset: u32, buffer: &mut [u8]) -> usize {
        load(self, offset, buffer)
    }

    #[inline]
    fn store(&mut self, _offset: u32, _data: &[u8]) -> usize {
        0
    }
}

/// A value of a fixed size, on its way from or to a device.
///
/// It has room for just that size, so a device that sends more fails the transfer; and one that does not
/// say how many of four bytes count (command 42h) is taken at the size of the type.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Scalar {
    bytes: [u8; 8],
    len: usize,
    capacity: usize,
}

impl Scalar {
    /// A value to be written: [`Scalar::len`] bytes.
    #[must_use]
    pub fn of<T: Value>(value: T) -> Self {
        Scalar { bytes: value.to_bytes(), len: T::SIZE, capacity: T::SIZE }
    }

    /// Room for a value to be read.
    #[must_use]
    pub const fn room_for<T: Value>() -> Self {
        Scalar { bytes: [0; 8], len: 0, capacity: T::SIZE }
    }

    /// The bytes it holds.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        self.bytes.get(..self.len).unwrap_or(&self.bytes)
    }

    /// How many bytes it holds, at most eight.
    #[must_use]
    pub const fn len(&self) -> u32 {
        self.len as u32
    }

    /// Whether it holds none yet.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The bytes as one number.
    pub(crate) fn number(&self) -> u64 {
        self.bytes().iter().rev().fold(0, |number, byte| number << 8 | u64::from(*byte))
    }

    /// The value.
    pub fn get<T: Value>(&self) -> Result<T, LengthMismatch> {
        T::from_bytes(self.bytes())
    }
}

impl Payload for Scalar {
    #[inline]
    fn load(&mut self, offset: u32, buffer: &mut [u8]) -> usize {
        load(self.bytes(), offset, buffer)
    }

    #[inline]
    fn store(&mut self, offset: u32, data: &[u8]) -> usize {
        let taken = self.bytes.get_mut(..self.capacity).map_or(0, |room| store(room, offset, data));
        self.len = (offset as usize).saturating_add(taken).min(self.capacity);
        taken
    }
}

#[inline]
fn load(bytes: &[u8], offset: u32, buffer: &mut [u8]) -> usize {
    copy(bytes.get(offset as usize..).unwrap_or(&[]), buffer)
}

#[inline]
fn store(room: &mut [u8], offset: u32, data: &[u8]) -> usize {
    copy(data, room.get_mut(offset as usize..).unwrap_or(&mut []))
}

/// Copies as many bytes as there are, and there is room for.
#[inline]
fn copy(from: &[u8], to: &mut [u8]) -> usize {
    // The common case without a call.
    if let (Some(from), Ok(to)) = (from.first_chunk::<8>(), <&mut [u8; 8]>::try_from(&mut *to)) {
        *to = *from;
        return 8;
    }
    let len = from.len().min(to.len());
    if let (Some(from), Some(to)) = (from.get(..len), to.get_mut(..len)) {
        match (to.first_chunk_mut::<4>(), from.first_chunk(), from.last_chunk::<4>()) {
            // The end of most texts: two pieces that may overlap.
            (Some(first), Some(head), Some(tail)) if len <= 8 => {
                *first = *head;
                to.last_chunk_mut().into_iter().for_each(|last| *last = *tail);
            }
            _ => to.copy_from_slice(from),
        }
    }
    len
}
