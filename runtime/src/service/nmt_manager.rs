//! NMT and everything else that a manager sends without keeping state: one frame at a time waits to be
//! pulled (CiA 301, 7.2.8.2.1).

use crate::frame::Frame;
use crate::id::NodeId;
use crate::time::Instant;
use crate::wire::nmt::{NmtCommand, NmtMessage};

/// Holds one frame until it is pulled.
#[derive(Clone, Copy, Debug, Default)]
pub struct Outbox {
    frame: Option<Frame>,
}

/// The frame before was not pulled yet: pull the transmissions first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[error("{frame} was not sent yet")]
pub struct Unsent {
    /// The frame before.
    pub frame: Frame,
}

impl Outbox {
    /// With nothing to send.
    #[must_use]
    pub const fn new() -> Self {
        Outbox { frame: None }
    }

    /// Sends a frame.
    pub const fn send(&mut self, frame: Frame) -> Result<(), Unsent> {
        if let Some(frame) = self.frame {
            return Err(Unsent { frame });
        }
        self.frame = Some(frame);
        Ok(())
    }

    /// Commands a node, or all of them.
    pub const fn command(&mut self, command: NmtCommand, node: Option<NodeId>) -> Result<(), Unsent> {
        self.send(NmtMessage { command, node }.frame())
    }

    /// The frame.
    pub const fn poll_transmit(&mut self, _now: Instant) -> Option<Frame> {
        self.frame.take()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_second_frame_waits_for_the_first_to_be_pulled() {
        let mut outbox = Outbox::new();
        outbox.command(NmtCommand::ResetNode, NodeId::new(5)).unwrap();
        let error = outbox.command(NmtCommand::Start, None).unwrap_err();
        assert_eq!(std::format!("{error}"), "000#8105 was not sent yet");
        assert_eq!(outbox.poll_transmit(Instant::ZERO), Some(error.frame));
        outbox.command(NmtCommand::Start, None).unwrap();
        assert_eq!(std::format!("{}", outbox.poll_transmit(Instant::ZERO).unwrap()), "000#0100");
        assert_eq!(outbox.poll_transmit(Instant::ZERO), None);
    }
}
