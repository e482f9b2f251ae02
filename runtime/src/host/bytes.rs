//! A payload that grows with the data a device sends.

use std::vec::Vec;

use crate::service::sdo_client::Payload;

/// Bytes of an SDO transfer, of any length up to a bound. Memory is allocated as the bytes come, and not by the
/// announced length.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Bytes {
    data: Vec<u8>,
    bound: usize,
}

impl Bytes {
    /// Bytes to write.
    #[must_use]
    pub fn of(data: &[u8]) -> Self {
        Bytes { data: data.to_vec(), bound: data.len() }
    }

    /// Room for up to `bound` bytes to read.
    #[must_use]
    pub const fn room_for(bound: usize) -> Self {
        Bytes { data: Vec::new(), bound }
    }

    /// The first `len` bytes, which is the length of the transfer.
    #[must_use]
    pub fn into_vec(mut self, len: u32) -> Vec<u8> {
        self.data.truncate(len as usize);
        self.data
    }
}

impl Payload for Bytes {
    fn load(&mut self, offset: u32, buffer: &mut [u8]) -> usize {
        let rest = self.data.get(offset as usize..).unwrap_or_default();
        buffer.iter_mut().zip(rest).map(|(to, from)| *to = *from).count()
    }

    fn store(&mut self, offset: u32, data: &[u8]) -> usize {
        let offset = offset as usize;
        let room = self.bound.saturating_sub(offset).min(data.len());
        self.data.truncate(offset);
        self.data.extend_from_slice(data.get(..room).unwrap_or(data));
        room
    }
}
