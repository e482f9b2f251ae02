//! SocketCAN frames in captures (LINKTYPE_CAN_SOCKETCAN): the identifier with flags, big-endian, the length, CAN FD
//! flags, and eight bytes.

use lexican_runtime::{CobId, Frame};

use super::codec::Skipped;

/// The link type of pcap and pcapng.
pub(super) const LINK_TYPE: u32 = 227;
/// The size of a classic frame.
pub(super) const LEN: usize = 16;

const EXTENDED: u32 = 0x8000_0000;
const REMOTE: u32 = 0x4000_0000;
const ERROR: u32 = 0x2000_0000;
/// A flag of CAN FD in byte 5, and of CAN XL in byte 4.
const FD: u8 = 0x04;
const XL: u8 = 0x80;
/// The size of a CAN FD frame, by which older captures are recognised.
const FD_LEN: usize = 72;

pub(super) fn bytes(frame: &Frame) -> [u8; LEN] {
    let id = frame.id();
    let flags = if id.is_extended() { EXTENDED } else { 0 } | if frame.is_remote() { REMOTE } else { 0 };
    let mut bytes = [0; LEN];
    bytes[..4].copy_from_slice(&(id.raw() | flags).to_be_bytes());
    bytes[4] = frame.dlc();
    bytes[8..8 + frame.data().len()].copy_from_slice(frame.data());
    bytes
}

/// The frame of a packet; counts packets with other content.
pub(super) fn frame(packet: &[u8], skipped: &mut Skipped) -> Option<Frame> {
    let Some((head, data)) = packet.split_first_chunk::<8>() else {
        skipped.other += 1;
        return None;
    };
    let [a, b, c, d, len, flags, ..] = *head;
    let id = u32::from_be_bytes([a, b, c, d]);
    if len & XL != 0 || flags & FD != 0 || len > 8 || packet.len() >= FD_LEN {
        skipped.fd += 1;
        return None;
    }
    if id & ERROR != 0 {
        skipped.errors += 1;
        return None;
    }
    let (id, is_remote) = (identifier(id & !REMOTE), id & REMOTE != 0);
    let frame = id
        .and_then(|id| if is_remote { Frame::remote(id, len) } else { Frame::new(id, data.get(..usize::from(len))?) });
    // The capture may have cut off the packet.
    skipped.other += u64::from(frame.is_none());
    frame
}

/// An identifier; its highest bit marks an extended one.
pub(super) fn identifier(number: u32) -> Option<CobId> {
    if number & EXTENDED != 0 { CobId::extended(number & !EXTENDED) } else { CobId::standard(number.try_into().ok()?) }
}

/// The reverse of [`identifier`].
pub(super) fn number(id: CobId) -> u32 {
    id.raw() | if id.is_extended() { EXTENDED } else { 0 }
}
