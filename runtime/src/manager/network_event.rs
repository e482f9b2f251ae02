//! What a network reports.

use crate::id::NodeId;
use crate::procedure::BootError;
use crate::wire::nmt::NmtState;

/// What happened in the network.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NetworkEvent {
    /// A node has booted: it is what it shall be, and reports OPERATIONAL if it was to be started.
    Booted(NodeId),
    /// A node does not boot. It is tried again with its next boot-up message.
    Failed {
        /// Which node.
        node: NodeId,
        /// Whether the network can do without it.
        mandatory: bool,
        /// Why.
        error: BootError,
    },
    /// All mandatory nodes have booted, for the first time or again. Returned by a call of `handle_timeout` that
    /// is due at once.
    Ready,
    /// Not all mandatory nodes have booted within the boot time (1F89h).
    BootTimeElapsed,
    /// A node that is not booted without asking has sent its boot-up message; [`Network::boot`](super::Network::boot) boots it.
    BootedUp(NodeId),
    /// A node that has booted reports another state than before: somebody commanded it, or it has an error.
    StateChanged {
        /// Which node.
        node: NodeId,
        /// Its state.
        state: NmtState,
    },
    /// A node is lost; it is booted again, or what [`OnLoss`](super::OnLoss) says happens.
    Lost {
        /// Which node.
        node: NodeId,
        /// Whether the network can do without it.
        mandatory: bool,
    },
}
