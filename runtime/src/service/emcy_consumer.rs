//! Receiving another node's emergencies (CiA 301, 7.2.7; 1028h).

use crate::frame::Frame;
use crate::id::CobId;
use crate::time::Instant;
use crate::wire::emcy::{CodeOrder, Emergency, ErrorRegister};

/// Receives the emergencies of one node.
#[derive(Clone, Copy, Debug)]
pub struct EmcyConsumer {
    id: CobId,
    order: CodeOrder,
    register: ErrorRegister,
}

impl EmcyConsumer {
    /// Receives `id`, with the bytes of the error code in `order`.
    #[must_use]
    pub const fn new(id: CobId, order: CodeOrder) -> Self {
        EmcyConsumer { id, order, register: ErrorRegister::NONE }
    }

    /// The COB-ID.
    #[must_use]
    pub const fn id(&self) -> CobId {
        self.id
    }

    /// The node's error register, from the last emergency since its boot-up.
    #[must_use]
    pub const fn register(&self) -> ErrorRegister {
        self.register
    }

    /// The node has booted: it has no errors until it reports one.
    pub const fn reset(&mut self) {
        self.register = ErrorRegister::NONE;
    }

    /// Takes an emergency.
    pub fn handle_frame(&mut self, _now: Instant, frame: &Frame) -> Option<Emergency> {
        if frame.id() != self.id || frame.is_remote() {
            return None;
        }
        let emergency = Emergency::parse(frame.data(), self.order)?;
        self.register = emergency.register;
        Some(emergency)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::id::NodeId;
    use crate::wire::emcy::ErrorCode;

    #[test]
    fn an_emergency_of_the_node_is_taken_in_its_byte_order() {
        let id = Emergency::cob_id(NodeId::literal(5));
        let mut consumer = EmcyConsumer::new(id, CodeOrder::HighByteFirst);
        let emergency = Emergency { code: ErrorCode(0x3120), register: ErrorRegister::VOLTAGE, vendor: [0; 5] };
        let frame = Frame::from_array(id, emergency.emit(CodeOrder::HighByteFirst));
        assert_eq!(consumer.handle_frame(Instant::ZERO, &frame), Some(emergency));
        assert_eq!(consumer.register(), ErrorRegister::VOLTAGE);
        for other in [Frame::from_array(CobId::SYNC, [0; 8]), Frame::from_array(id, [0; 7])] {
            assert_eq!(consumer.handle_frame(Instant::ZERO, &other), None);
        }
    }
}
