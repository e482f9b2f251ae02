//! Error control: boot-up, heartbeat and the answer to node guarding share one byte and one COB-ID
//! (CiA 301, 7.2.8.3.2 and 7.2.8.2.2).

use super::nmt::NmtState;
use crate::cia301::connection;
use crate::frame::Frame;
use crate::id::{CobId, NodeId};

/// The byte by which a node reports its state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ErrorControl {
    /// The state. INITIALISING is the boot-up message.
    pub state: NmtState,
    /// Alternates from one guarding answer to the next; always false in a heartbeat.
    pub toggle: bool,
}

impl ErrorControl {
    const TOGGLE: u8 = 0x80;

    /// A heartbeat, or the boot-up message.
    #[must_use]
    pub const fn heartbeat(state: NmtState) -> Self {
        ErrorControl { state, toggle: false }
    }

    /// The COB-ID, 700h + node-ID: it cannot be configured.
    #[must_use]
    pub const fn cob_id(node: NodeId) -> CobId {
        CobId::of_node(connection::ERROR_CONTROL, node)
    }

    /// The node whose error control has this COB-ID.
    #[must_use]
    pub fn node(id: CobId) -> Option<NodeId> {
        let low = id.raw().checked_sub(u32::from(connection::ERROR_CONTROL)).filter(|_| !id.is_extended())?;
        u8::try_from(low).ok().and_then(NodeId::new)
    }

    /// `None` if the data are not one byte with a known state.
    #[must_use]
    pub fn parse(data: &[u8]) -> Option<Self> {
        let &[byte] = data else { return None };
        Some(ErrorControl { state: NmtState::from_code(byte & !Self::TOGGLE)?, toggle: byte & Self::TOGGLE != 0 })
    }

    /// The data on the wire.
    #[must_use]
    pub const fn emit(self) -> [u8; 1] {
        [self.state.code() | if self.toggle { Self::TOGGLE } else { 0 }]
    }

    /// The whole frame.
    #[must_use]
    pub const fn frame(self, node: NodeId) -> Frame {
        Frame::from_array(Self::cob_id(node), self.emit())
    }

    /// The remote frame by which a manager guards `node`.
    ///
    /// # Panics
    ///
    /// Never: one byte is a legal length.
    #[must_use]
    pub const fn request(node: NodeId) -> Frame {
        match Frame::remote(Self::cob_id(node), 1) {
            Some(frame) => frame,
            None => panic!("one byte is a legal length"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_emitted_is_parsed() {
        for byte in 0..=0xFF {
            if let Some(message) = ErrorControl::parse(&[byte]) {
                assert_eq!(message.emit(), [byte]);
            }
        }
        assert_eq!(
            ErrorControl::parse(&[0xFF]).unwrap(),
            ErrorControl { state: NmtState::PreOperational, toggle: true }
        );
    }

    #[test]
    fn anything_but_one_known_byte_is_none() {
        for data in [&[][..], &[0x06], &[0x05, 0x00]] {
            assert_eq!(ErrorControl::parse(data), None, "{data:02X?}");
        }
    }

    #[test]
    fn the_cob_id_has_the_node() {
        for node in NodeId::all() {
            assert_eq!(ErrorControl::node(ErrorControl::cob_id(node)), Some(node));
        }
        for other in [CobId::NMT, CobId::standard(0x700).unwrap(), CobId::standard(0x780).unwrap()] {
            assert_eq!(ErrorControl::node(other), None);
        }
        assert_eq!(ErrorControl::node(CobId::extended(0x705).unwrap()), None);
    }
}
