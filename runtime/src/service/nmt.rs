//! NMT as a device sees it: its state, and the commands that change it (CiA 301, 7.3.2).
//!
//! ```text
//! INITIALISING --boot-up sent--> PRE-OPERATIONAL <--> OPERATIONAL <--> STOPPED <--> PRE-OPERATIONAL
//!      ^                                |                  |              |
//!      +---------- reset node, reset communication --------+--------------+
//! ```

use crate::frame::Frame;
use crate::id::{CobId, NodeId};
use crate::time::Instant;
use crate::wire::heartbeat::ErrorControl;
use crate::wire::nmt::{NmtCommand, NmtMessage, NmtState};

/// Which reset a manager asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Reset {
    /// Everything, as after power-on.
    Node,
    /// The communication objects, 1000h to 1FFFh.
    Communication,
}

/// The result of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Event {
    /// The device is in another state now.
    StateChanged(NmtState),
    /// The device is INITIALISING until [`Nmt::boot`] is called.
    Reset(Reset),
}

/// The NMT state machine of a device.
#[derive(Clone, Copy, Debug)]
pub struct Nmt {
    node: NodeId,
    state: NmtState,
    boot_up: bool,
}

impl Nmt {
    /// A device that is INITIALISING, until [`Nmt::boot`] is called.
    #[must_use]
    pub const fn new(node: NodeId) -> Self {
        Nmt { node, state: NmtState::Initialising, boot_up: false }
    }

    /// The node-ID.
    #[must_use]
    pub const fn node(&self) -> NodeId {
        self.node
    }

    /// The state.
    #[must_use]
    pub const fn state(&self) -> NmtState {
        self.state
    }

    /// The initialisation is done: the boot-up message is due, and PRE-OPERATIONAL follows it.
    pub const fn boot(&mut self) {
        self.state = NmtState::Initialising;
        self.boot_up = true;
    }

    /// Changes the state from inside: by local control or error behaviour. Does nothing while the
    /// device is INITIALISING.
    pub fn enter(&mut self, state: NmtState) -> Option<Event> {
        if self.state == NmtState::Initialising || self.state == state {
            return None;
        }
        self.state = state;
        self.boot_up = false;
        Some(Event::StateChanged(state))
    }

    /// Obeys commands to this node or to all.
    pub fn handle_frame(&mut self, _now: Instant, frame: &Frame) -> Option<Event> {
        if frame.id() != CobId::NMT || frame.is_remote() {
            return None;
        }
        let message = NmtMessage::parse(frame.data()).filter(|message| message.concerns(self.node))?;
        if self.state == NmtState::Initialising {
            return None;
        }
        match message.command {
            NmtCommand::ResetNode => self.reset(Reset::Node),
            NmtCommand::ResetCommunication => self.reset(Reset::Communication),
            command => self.enter(command.target()),
        }
    }

    fn reset(&mut self, reset: Reset) -> Option<Event> {
        self.state = NmtState::Initialising;
        Some(Event::Reset(reset))
    }

    /// The boot-up message. With it the device enters PRE-OPERATIONAL.
    pub fn poll_transmit(&mut self, _now: Instant) -> Option<Frame> {
        if !core::mem::take(&mut self.boot_up) {
            return None;
        }
        self.state = NmtState::PreOperational;
        Some(ErrorControl::heartbeat(NmtState::Initialising).frame(self.node))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NODE: NodeId = NodeId::literal(5);

    fn booted() -> Nmt {
        let mut nmt = Nmt::new(NODE);
        nmt.boot();
        nmt.poll_transmit(Instant::ZERO).unwrap();
        nmt
    }

    fn send(nmt: &mut Nmt, data: &[u8]) -> Option<Event> {
        nmt.handle_frame(Instant::ZERO, &Frame::new(CobId::NMT, data).unwrap())
    }

    #[test]
    fn commands_to_the_node_or_to_all_are_obeyed_and_others_are_not() {
        let mut nmt = booted();
        assert_eq!(send(&mut nmt, &[0x01, 0x05]), Some(Event::StateChanged(NmtState::Operational)));
        assert_eq!(send(&mut nmt, &[0x01, 0x05]), None);
        assert_eq!(send(&mut nmt, &[0x02, 0x06]), None);
        assert_eq!(send(&mut nmt, &[0x02, 0x00]), Some(Event::StateChanged(NmtState::Stopped)));
        assert_eq!(send(&mut nmt, &[0x80, 0x05]), Some(Event::StateChanged(NmtState::PreOperational)));
        for nonsense in [&[][..], &[0x01], &[0x01, 0x05, 0x00], &[0x77, 0x05], &[0x01, 0x85]] {
            assert_eq!(send(&mut nmt, nonsense), None);
        }
        assert_eq!(nmt.handle_frame(Instant::ZERO, &Frame::remote(CobId::NMT, 2).unwrap()), None);
    }
}
