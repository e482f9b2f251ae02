//! NMT: the state of a node, and the command to change it (CiA 301, 7.2.8.2.1 and 7.3.2.2).

use core::fmt;

use crate::frame::Frame;
use crate::id::{CobId, NodeId};

macro_rules! codes {
    ($(#[$doc:meta])* $name:ident { $($(#[$of_variant:meta])* $variant:ident = $code:literal, $text:literal;)* }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        #[repr(u8)]
        pub enum $name { $($(#[$of_variant])* $variant = $code,)* }

        impl $name {
            /// `None` for a code that is not in CiA 301.
            #[must_use]
            pub const fn from_code(code: u8) -> Option<Self> {
                match code { $($code => Some($name::$variant),)* _ => None }
            }

            /// The code on the wire.
            #[must_use]
            pub const fn code(self) -> u8 {
                self as u8
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.pad(match self { $($name::$variant => $text,)* })
            }
        }
    };
}

codes! {
    /// The NMT state of a node, as in heartbeats and guarding answers.
    NmtState {
        /// Not yet on the bus; on the wire this is the boot-up message.
        Initialising = 0x00, "INITIALISING";
        /// Only NMT and error control work.
        Stopped = 0x04, "STOPPED";
        /// Everything works.
        Operational = 0x05, "OPERATIONAL";
        /// Everything but PDOs works.
        PreOperational = 0x7F, "PRE-OPERATIONAL";
    }
}

codes! {
    /// A command of a manager to nodes.
    NmtCommand {
        /// Enter OPERATIONAL.
        Start = 0x01, "start";
        /// Enter STOPPED.
        Stop = 0x02, "stop";
        /// Enter PRE-OPERATIONAL.
        EnterPreOperational = 0x80, "enter PRE-OPERATIONAL";
        /// Restart as after power-on.
        ResetNode = 0x81, "reset node";
        /// Restart with the communication objects (1000h to 1FFFh) only.
        ResetCommunication = 0x82, "reset communication";
    }
}

impl NmtState {
    /// Whether the state allows SDO, SYNC, TIME and EMCY (CiA 301, table 38).
    #[must_use]
    pub const fn allows_messages(self) -> bool {
        matches!(self, NmtState::Operational | NmtState::PreOperational)
    }
}

impl NmtCommand {
    /// The state of a node afterwards; INITIALISING lasts until it boots up after a reset.
    #[must_use]
    pub const fn target(self) -> NmtState {
        match self {
            NmtCommand::Start => NmtState::Operational,
            NmtCommand::Stop => NmtState::Stopped,
            NmtCommand::EnterPreOperational => NmtState::PreOperational,
            NmtCommand::ResetNode | NmtCommand::ResetCommunication => NmtState::Initialising,
        }
    }
}

/// A command and its node: the message with COB-ID 000h.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct NmtMessage {
    /// What is asked.
    pub command: NmtCommand,
    /// `None` for all nodes.
    pub node: Option<NodeId>,
}

impl NmtMessage {
    /// `None` if the data are not two bytes: a known command, and a node-ID or 0.
    #[must_use]
    pub fn parse(data: &[u8]) -> Option<Self> {
        let &[command, node] = data else { return None };
        let node = match node {
            0 => None,
            id => Some(NodeId::new(id)?),
        };
        Some(NmtMessage { command: NmtCommand::from_code(command)?, node })
    }

    /// The data on the wire.
    #[must_use]
    pub const fn emit(self) -> [u8; 2] {
        let node = match self.node {
            Some(node) => node.get(),
            None => 0,
        };
        [self.command.code(), node]
    }

    /// The whole frame.
    #[must_use]
    pub const fn frame(self) -> Frame {
        Frame::from_array(CobId::NMT, self.emit())
    }

    /// Whether the command is for `node`.
    #[must_use]
    pub fn concerns(self, node: NodeId) -> bool {
        self.node.is_none_or(|target| target == node)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_emitted_is_parsed() {
        for code in 0..=0xFF {
            let Some(command) = NmtCommand::from_code(code) else { continue };
            for node in [None, NodeId::new(1), NodeId::new(127)] {
                let message = NmtMessage { command, node };
                assert_eq!(NmtMessage::parse(&message.emit()), Some(message));
            }
        }
    }

    #[test]
    fn a_message_that_is_not_two_known_bytes_is_none() {
        for data in [&[][..], &[0x01], &[0x01, 0x05, 0x00], &[0x03, 0x05], &[0x01, 0x80]] {
            assert_eq!(NmtMessage::parse(data), None, "{data:02X?}");
        }
    }

    #[test]
    fn states_have_the_codes_of_the_standard() {
        let codes: std::vec::Vec<u8> = (0..=0xFF).filter(|&code| NmtState::from_code(code).is_some()).collect();
        assert_eq!(codes, [0x00, 0x04, 0x05, 0x7F]);
        assert!(codes.iter().all(|&code| NmtState::from_code(code).unwrap().code() == code));
    }
}
