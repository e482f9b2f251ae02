//! One classic CAN frame, data or remote.

use core::fmt;

use crate::id::CobId;

/// A classic CAN frame: an identifier and up to eight bytes, or the request for them.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct Frame {
    id: CobId,
    remote: bool,
    len: u8,
    // Bytes beyond `len` are zero, so that derived equality is the equality of frames.
    data: [u8; 8],
}

impl Frame {
    /// A data frame; `None` when `data` is longer than eight bytes.
    pub const fn new(id: CobId, data: &[u8]) -> Option<Self> {
        if data.len() > 8 {
            return None;
        }
        let mut bytes = [0; 8];
        let (head, _) = bytes.split_at_mut(data.len());
        head.copy_from_slice(data);
        Some(Frame { id, remote: false, len: data.len() as u8, data: bytes })
    }

    /// A data frame of the first `len` of these bytes; those beyond are zero. `None` when `len` is above eight.
    pub(crate) fn of_buffer(id: CobId, data: [u8; 8], len: usize) -> Option<Self> {
        debug_assert!(data.iter().skip(len).all(|byte| *byte == 0), "derived equality needs it");
        (len <= 8).then_some(Frame { id, remote: false, len: len as u8, data })
    }

    /// A data frame of a length that the type carries, so that nothing can go wrong.
    #[inline]
    #[must_use]
    pub const fn from_array<const N: usize>(id: CobId, data: [u8; N]) -> Self {
        const { assert!(N <= 8, "a classic CAN frame carries at most eight bytes") };
        let mut bytes = [0; 8];
        let (head, _) = bytes.split_at_mut(N);
        head.copy_from_slice(&data);
        Frame { id, remote: false, len: N as u8, data: bytes }
    }

    /// A remote frame (RTR) that asks for `len` bytes; `None` above eight.
    pub const fn remote(id: CobId, len: u8) -> Option<Self> {
        if len > 8 { None } else { Some(Frame { id, remote: true, len, data: [0; 8] }) }
    }

    /// The identifier.
    #[inline]
    #[must_use]
    pub const fn id(&self) -> CobId {
        self.id
    }

    /// Whether this is a remote frame: it carries a length but no data.
    #[inline]
    #[must_use]
    pub const fn is_remote(&self) -> bool {
        self.remote
    }

    /// The key of arbitration: of the frames that begin at the same time, the one with the lowest key is sent first. By the 11
    /// bits that both formats begin with, then standard before extended, then data before remote (ISO 11898-1).
    #[must_use]
    pub const fn arbitration(&self) -> (u32, bool, u32, bool) {
        let base = if self.id.is_extended() { self.id.raw() >> 18 } else { self.id.raw() };
        (base, self.id.is_extended(), self.id.raw(), self.remote)
    }

    /// The data; empty in a remote frame.
    #[inline]
    #[must_use]
    pub fn data(&self) -> &[u8] {
        let len = if self.remote { 0 } else { usize::from(self.len) };
        self.data.get(..len).unwrap_or(&[])
    }

    /// The data length code, 0 to 8: of a remote frame, the length that is asked for.
    #[must_use]
    pub const fn dlc(&self) -> u8 {
        self.len
    }
}

/// As `candump -L` and `cansend` write frames: `605#407C600000000000`, `705#R1`.
impl fmt::Display for Frame {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}#", self.id)?;
        if self.remote {
            return write!(f, "R{}", self.len);
        }
        self.data().iter().try_for_each(|byte| write!(f, "{byte:02X}"))
    }
}

impl fmt::Debug for Frame {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Frame({self})")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prints_as_candump_does() {
        let id = CobId::standard(0x605).unwrap();
        assert_eq!(std::format!("{}", Frame::from_array(id, [0x40, 0x7C, 0x60, 0x00])), "605#407C6000");
        assert_eq!(std::format!("{}", Frame::remote(id, 2).unwrap()), "605#R2");
    }

    #[test]
    fn nine_bytes_are_no_frame() {
        assert_eq!(Frame::new(CobId::NMT, &[0; 9]), None);
        assert_eq!(Frame::remote(CobId::NMT, 9), None);
    }

    #[test]
    fn a_remote_frame_has_a_length_and_no_data() {
        let frame = Frame::remote(CobId::SYNC, 6).unwrap();
        assert_eq!((frame.dlc(), frame.data()), (6, &[][..]));
    }
}
